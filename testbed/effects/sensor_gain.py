"""sensor.gain_a, sensor.gain_b: a pressure sensor whose gain is not its calibration's."""

from __future__ import annotations

from typing import Any, ClassVar

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.sensor_linearity import Linearity
from testbed.effects.signature import RobotSeen, Signature
from testbed.effects.terms import Observed, Signals, Values

REFERENCE_PA = 1e7
TRANSDUCER = 0.004
"""By such a share the gain of any transducer, times the area of any piston, differs from what is
declared (E: a quarter of a per cent of the one, a bore to H8 of the other)."""
RANGE = 1.6
"""A pressure sensor's range over the supply pressure (E)."""


def true_pa(measured: Any, gain_error: float, bend: float = 0.0) -> Any:
    """The pressure behind a reading; bend is a gain that changes with pressure, 0 in the contract's
    formula.
    """
    return measured / (1.0 + gain_error + bend * measured / REFERENCE_PA)


class Gain(Effect):
    """What both gains have in common."""

    channel: ClassVar[str]
    """`pressure_a` or `pressure_b`."""
    parameters = (
        ParameterSpec("gain_error", "1", -0.5, 1.0, (-0.06, 0.06), "relative error of the gain"),
        ParameterSpec("bend", "1", -0.3, 0.3, (-0.05, 0.05), "further gain error at 100 bar", 0.0),
    )
    rigs = ("vertical-leg", "cylinder")
    seen_in = ("force", "flow")
    shapes = ("bend",)
    usual_on_legs = (-TRANSDUCER, TRANSDUCER)
    may_be_another_law = True
    alike = {
        "friction.load": "friction changes its sign with the direction of motion",
        "friction.pressure": "friction changes its sign with the direction of motion",
        "force.spring": "a gain error grows with the pressure, wherever the piston is",
        "inertia.mass": "a gain error shows under load, a mass in the air",
    }

    def correct(self, signals: Signals, values: Values) -> Signals:
        """The pressure behind the reading."""
        name = f"{self.channel}_pa"
        measured = getattr(signals, name)
        if measured is None:
            return signals
        return signals.with_(**{name: true_pa(measured, values["gain_error"], values["bend"])})

    def another_law(self, values: Values, observed: Observed) -> str | None:
        """A bow, where the error is gone at a pressure that the sensor still reads: it is true at
        both ends of its range, or nearly so, and its gain is not off.
        """
        supply_pa = observed.known.supply_pressure_nominal_pa
        if not supply_pa or not values["gain_error"]:
            return None
        top = RANGE * supply_pa / REFERENCE_PA
        left = 1.0 + values["bend"] * top / values["gain_error"]
        return Linearity.kind if left < 0.0 else None

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """Too much force by the share of pA A_A, or too little by that of pB A_B."""
        axis, chamber = seen.axis(place), "ab".index(self.channel[-1])
        read = getattr(seen, f"{self.channel}_pa")[:, axis]
        return {"gain_error": seen.reads(axis, chamber, read)}


class GainA(Gain):
    """A pressure sensor A whose gain is not its calibration's."""

    kind, channel = "sensor.gain_a", "pressure_a"
    equation = "measured pA = (1 + gain_error) pA"
    text = (
        "the gain of pressure sensor A is off; on a cylinder of nominal bore also the piston area"
    )
    needs = ("position", "pressure_a")
    live = {"gain_error": "gain_a"}
    telling_motion = "press at rising loads with chamber B at tank pressure"
    hides = {"gain_error": "gain_error_a"}


class GainB(Gain):
    """The gain of pressure sensor B."""

    kind, channel = "sensor.gain_b", "pressure_b"
    equation = "measured pB = (1 + gain_error) pB"
    text = "the gain of pressure sensor B is off"
    needs = ("position", "pressure_a", "pressure_b")
    live = {"gain_error": "gain_b"}
    telling_motion = "retract against rising loads with chamber A at tank pressure"
    hides = {"gain_error": "gain_error_b"}


EFFECTS = (GainA(), GainB())
BOTH = frozenset(effect.kind for effect in EFFECTS)
"""Named together in one cylinder they are more likely one sensor that bends (sensor_linearity.py)
than two gains that are off.
"""
