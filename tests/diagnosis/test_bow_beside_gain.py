"""What a leg's recordings cannot tell from a gain: of a sensor that bends a bow is named beside it,
of one whose gain is off over the whole range it is not.
"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from testbed.benchmarks.reference_leg.rigs import Hidden, make_rig
from testbed.diagnosis.leg.base_models import declared, fit_base
from testbed.diagnosis.leg.fit import Fit
from testbed.diagnosis.leg.hypotheses import fit_with
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.rival_laws import other_laws_within
from testbed.diagnosis.leg.series import series_of
from testbed.effects import by_name
from testbed.effects.sensor_gain import RANGE
from testbed.formats.arrays import Array

GAIN = 0.05


def with_a_gain(read: Any, monkeypatch: pytest.MonkeyPatch) -> tuple[Problem, Fit]:
    """A sound leg whose sensor A reads `read(pressure, range)`, fitted with a gain of that
    sensor.
    """
    monkeypatch.setattr(
        "testbed.benchmarks.reference_leg.rigs.draw_hidden",
        lambda rng, kind: Hidden((), (), {}, ()),
    )
    rig = make_rig(12, "clean")[0]
    top = RANGE * float(rig.known.supply_pressure_nominal_pa or 0.0)
    identify = tuple(
        replace(one, pressure_a_pa=read(np.asarray(one.pressure_a_pa), top)) for one in rig.identify
    )
    base = declared(replace(rig, identify=identify))
    problem = Problem(series_of(identify, base.known), base, True)
    return problem, fit_with(problem, fit_base(problem)[0], by_name("sensor.gain_a"))


def within(problem: Problem, fit: Fit) -> tuple[str, ...]:
    """The other laws that these recordings cannot tell from the gain."""
    chosen = SimpleNamespace(names=("sensor.gain_a",), fit=fit)
    state: Any = SimpleNamespace(problem=problem)
    return other_laws_within(state, chosen, "sensor.gain_a")  # type: ignore[arg-type]


@pytest.mark.slow
def test_a_sensor_that_bends_is_named_beside_its_gain(monkeypatch: pytest.MonkeyPatch) -> None:
    def bent(pressure: Array, top: float) -> Array:
        return pressure + GAIN * pressure * (1.0 - pressure / (0.6 * top))

    assert within(*with_a_gain(bent, monkeypatch)) == ("sensor.linearity",)


@pytest.mark.slow
def test_a_gain_that_is_off_everywhere_is_no_bow(monkeypatch: pytest.MonkeyPatch) -> None:
    def steep(pressure: Array, top: float) -> Array:
        return (1.0 + GAIN) * pressure

    assert within(*with_a_gain(steep, monkeypatch)) == ()
