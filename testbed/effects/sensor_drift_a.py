"""sensor.drift_a: a zero that wanders as the sensor warms."""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import RobotSeen, Signature
from testbed.effects.terms import Signals, Values


def zero_pa(time_s: Any, rate: float, decay: float = 0.0) -> Any:
    """Zero error in Pa after `time_s` of recording; decay (1/s) lets it settle, 0 in the contract's
    formula.
    """
    if decay <= 0.0:
        return rate * time_s
    return rate * (1.0 - np.exp(-decay * time_s)) / decay


class Drift(Effect):
    """A zero that wanders as the sensor warms."""

    kind = "sensor.drift_a"
    equation = "measured pA = pA + rate t, t from the start of the recording"
    text = "the zero of pressure sensor A wanders"
    parameters = (
        ParameterSpec(
            "rate", "Pa/s", -1e5, 1e5, (-3000.0, 3000.0), "change of the zero per second"
        ),
        ParameterSpec(
            "decay", "1/s", 0.0, 2.0, (0.0, 0.15), "rate at which the drift settles", 0.0
        ),
    )
    needs = ("position", "pressure_a")
    rigs = ("vertical-leg", "cylinder")
    seen_in = ("force", "flow")
    shapes = ("decay",)
    live = {"rate": "drift_a_pa_s"}
    telling_motion = "ten minutes of the same slow sinusoid"
    alike = {"friction.temperature": "friction changes its sign with the direction of motion"}
    hides = {"rate": "drift_a_pa_s"}
    usual = 1.0e4
    """A run of the robot is short, only a quick drift is seen at all."""

    def correct(self, signals: Signals, values: Values) -> Signals:
        """What the sensor should have read."""
        if signals.pressure_a_pa is None:
            return signals
        return signals.with_(
            pressure_a_pa=signals.pressure_a_pa
            - zero_pa(signals.since_s, values["rate"], values["decay"])
        )

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """A force that grows with time."""
        axis = seen.axis(place)
        return {"rate": seen.reads(axis, 0, seen.time_s)}


EFFECTS = (Drift(),)
