"""What a sound leg has a little of is no finding: pressures late by a converter's filter, gains off
by a transducer's tolerance, a supply set beside its nominal pressure; and a gain error that is gone
at a pressure that the sensor still reads is a bow.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from testbed.benchmarks.reference_leg.rigs import Hidden, make_rig
from testbed.diagnosis.leg.base_models import declared, fit_base
from testbed.diagnosis.leg.fit import Fit
from testbed.diagnosis.leg.hypotheses import fit_with
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.series import series_of
from testbed.effects import by_name
from testbed.effects.sensor_delay import TRANSDUCER_S
from testbed.effects.sensor_gain import RANGE, REFERENCE_PA, TRANSDUCER
from testbed.effects.supply_droop import SOUND_COST, SOUND_SHARE
from testbed.effects.terms import Observed
from testbed.recording.axis import Rig
from testbed.recording.known import Known
from testbed.recording.leg_model import Friction

SUPPLY_PA, FLOW_M3_S = 1e7, 5e-4


def observed(kind: str = "vertical-leg") -> Observed:
    """A rig of a kind with a valve and a supply."""
    known = Known(supply_pressure_nominal_pa=SUPPLY_PA, valve_rated_flow_m3_s=FLOW_M3_S)
    return Observed(kind=kind, known=known, friction=Friction(), signals=(), reference_n=())


@pytest.mark.parametrize("gain", [0.1, -0.1])
def test_a_gain_error_that_vanishes_within_the_range_is_a_bow(gain: float) -> None:
    effect = by_name("sensor.gain_a")
    top = RANGE * SUPPLY_PA / REFERENCE_PA

    def law(bend: float) -> str | None:
        return effect.another_law({"gain_error": gain, "bend": bend}, observed())

    assert law(-gain / (0.6 * top)) == "sensor.linearity"  # right again at six tenths
    assert law(-gain / (1.1 * top)) is None  # and beyond the range
    assert law(0.0) is None and law(gain) is None  # constant, or one that grows


def test_no_other_name_has_shapes_of_another_law() -> None:
    assert by_name("friction.load").another_law({"coefficient": 0.1}, observed()) is None


def test_a_droop_costs_where_any_pump_has_as_much() -> None:
    droop = by_name("supply.droop")
    least = SOUND_SHARE * SUPPLY_PA / FLOW_M3_S
    prices = [
        droop.price({"droop": share * least, "time": 0.1}, observed()) for share in (0.0, 0.5, 1.0)
    ]
    assert prices == pytest.approx([SOUND_COST, 0.5 * SOUND_COST, 0.0])
    assert droop.price({"droop": 0.0, "time": 0.1}, observed("robot")) == 0.0


def fitted(monkeypatch: pytest.MonkeyPatch, numbers: dict[str, float]) -> tuple[Problem, Fit, Rig]:
    """Friction, valve and what is usual of a rig of the reference leg with these numbers."""
    monkeypatch.setattr(
        "testbed.benchmarks.reference_leg.rigs.draw_hidden",
        lambda rng, kind: Hidden((), (), numbers, ()),
    )
    rig = make_rig(12, "clean")[0]
    base = declared(rig)
    problem = Problem(series_of(rig.identify, base.known), base, True)
    return problem, fit_base(problem)[0], rig


def values_of(fit: Fit, name: str) -> float:
    """The first number of an effect."""
    (active,) = [one for one in fit.at.effects if one.effect.name == name]
    return active.values[active.effect.required[0]]


@pytest.mark.slow
def test_a_filters_lateness_is_the_base_models_and_a_long_one_a_delay(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    _, fit, _ = fitted(monkeypatch, {"sensor.delay:delay": 1e-3, "sensor.delay:form": 0.0})
    assert values_of(fit, "sensor.delay") == pytest.approx(1e-3, abs=2e-4)
    problem, fit, _ = fitted(monkeypatch, {"sensor.delay:delay": 6e-3, "sensor.delay:form": 0.0})
    assert values_of(fit, "sensor.delay") == pytest.approx(TRANSDUCER_S)  # no more than usual
    late = fit_with(problem, fit, by_name("sensor.delay"))
    assert values_of(late, "sensor.delay") == pytest.approx(6e-3, abs=5e-4)
    owners = [coordinate.owner for coordinate in late.coordinates]
    assert owners.count("sensor.delay") == 1  # as a finding it is all of the lateness


@pytest.mark.slow
def test_a_transducers_gain_is_the_base_models(monkeypatch: pytest.MonkeyPatch) -> None:
    gain = {"sensor.gain_a:gain": 0.003, "sensor.gain_a:form": 0.0}
    _, fit, _ = fitted(monkeypatch, gain)
    assert values_of(fit, "sensor.gain_a") == pytest.approx(0.003, abs=1.2e-3)
    _, fit, _ = fitted(monkeypatch, {})
    assert abs(values_of(fit, "sensor.gain_a")) < 0.3 * TRANSDUCER + 1e-3


@pytest.mark.slow
def test_a_supply_that_is_set_beside_its_nominal_pressure_is_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem, fit, rig = fitted(monkeypatch, {})
    off = 0.006 * float(rig.known.supply_pressure_nominal_pa or 0.0)
    problem.series = tuple(
        replace(
            one,
            signals=one.signals.with_(
                supply_pressure_pa=np.asarray(one.signals.supply_pressure_pa) + off
            ),
        )
        for one in problem.series
    )
    other, _ = fit_base(problem)
    moved = other.at.edges.supply_off_pa - fit.at.edges.supply_off_pa
    assert moved == pytest.approx(off, rel=0.1)
