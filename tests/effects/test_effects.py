"""Every named effect: its law at one hand-computed point, its bounds, and its place in the list."""

from __future__ import annotations

import pytest

from testbed.effects import (
    ALL,
    OF_A_CYLINDER,
    build,
    by_name,
    force_cushion,
    force_periodic,
    force_spring,
    friction_load,
    friction_position,
    friction_pressure,
    friction_temperature,
    hydraulics_air,
    hydraulics_hose,
    leakage_internal,
    sensor_drift_a,
    sensor_gain,
    valve_deadband,
)
from testbed.errors import InputError
from testbed.recording.leg_model import EffectEntry


def test_the_list_holds_every_name_once_and_the_nineteen_of_a_single_axis() -> None:
    assert len({effect.name for effect in ALL}) == len(ALL)
    assert len(OF_A_CYLINDER) == 19


def test_every_effect_takes_its_own_prior_and_refuses_what_is_beyond_its_bounds() -> None:
    for effect in ALL:
        middle = {p.name: 0.5 * sum(p.prior) for p in effect.parameters if p.default is None}
        assert set(effect.complete(middle)) == {p.name for p in effect.parameters}
        first = effect.parameters[0]
        with pytest.raises(InputError, match="out of bounds"):
            effect.complete(middle | {first.name: 2.0 * abs(first.high) + 1.0})


@pytest.mark.parametrize(
    ("name", "parameters", "words"),
    [
        ("friction.colour", {}, "no effect has that name"),
        ("friction.position", {}, "lacks parameter 'slope'"),
        ("friction.position", {"slop": 1.0}, "unknown parameter"),
        ("friction.position", {"slope": 1e6}, "out of bounds"),
    ],
)
def test_a_wrong_entry_of_a_model_is_refused_with_its_reason(
    name: str, parameters: dict[str, float], words: str
) -> None:
    with pytest.raises(InputError, match=words):
        build([EffectEntry.model_validate({"name": name, "parameters": parameters})])


def test_a_further_shape_that_is_left_out_has_its_default() -> None:
    entry = EffectEntry.model_validate({"name": "sensor.delay", "parameters": {"delay": 0.02}})
    (active,) = build([entry])
    assert active.values == {"delay": 0.02, "lag_share": 0.0}
    assert active.effect is by_name("sensor.delay")


def test_laws_at_points_computed_by_hand() -> None:
    assert friction_position.coulomb_factor(0.5, 0.5, 0.8) == pytest.approx(
        1.4
    )  # 1 + 0.8 (0.5 - 0.25) / 0.5
    assert friction_pressure.coulomb_increase_n(3e6, 2e6, 6e-5) == pytest.approx(300.0)
    assert friction_load.coulomb_increase_n(5000.0, 0.04) == pytest.approx(200.0)
    assert friction_load.coulomb_increase_n(-5000.0, 0.04) == 0.0
    assert friction_temperature.viscous_factor(40.0, 0.02) == pytest.approx(0.6703, rel=1e-4)
    assert force_spring.force_n(0.3, 1000.0, 0.2) == pytest.approx(-100.0)
    assert force_cushion.force_n(0.1, 2000.0, 0.15) == pytest.approx(100.0)
    assert force_cushion.force_n(0.2, 2000.0, 0.15) == 0.0
    assert force_periodic.force_n(0.25 / 10.0, 150.0, 10.0) == pytest.approx(150.0)
    assert sensor_gain.true_pa(4.2e6, 0.05) == pytest.approx(4e6)
    assert sensor_drift_a.zero_pa(30.0, -1000.0) == pytest.approx(-3e4)
    assert leakage_internal.flow_m3_s(2e6, 5e-12) == pytest.approx(1e-5)
    assert leakage_internal.flow_m3_s(4e6, 5e-12, 0.5) == pytest.approx(1e-5)  # 5e-6 sqrt(4)
    assert hydraulics_air.compliance_1_pa(0.0, 0.014) == pytest.approx(1e-7)  # 0.014 / 1.4 / 1e5
    assert hydraulics_hose.flow_m3_s(2e6, 1e6, 1e-12, 0.5) == pytest.approx(2e-6)
    assert valve_deadband.opening(0.55, 0.1) == pytest.approx(0.5)
    assert valve_deadband.opening(-0.05, 0.1) == 0.0
