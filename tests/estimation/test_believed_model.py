"""What a model file of one leg says is believed by a run, or refused by its name: nothing is
without effect.
"""

from __future__ import annotations

import pytest
from shipped import MACHINE

from testbed.effects import ALL
from testbed.errors import InputError
from testbed.estimation.live.believed import Believed
from testbed.estimation.live.uncertainty import Uncertainty, constants
from testbed.recording.known import Circuit, Known
from testbed.recording.leg_model import EffectEntry, Friction, LegModel
from testbed.world.believed_robot import OF_TOLERANCES, spreads_of_leg

KNOWN = {
    "bore_m": 0.07,
    "rod_m": 0.056,
    "stroke_m": 0.5,
    "moving_mass_kg": 90.0,
    "supply_pressure_nominal_pa": 9.0e6,
    "tank_pressure_pa": 1.0e5,
    "dead_volume_a_m3": 3.0e-4,
    "dead_volume_b_m3": 3.0e-4,
    "bulk_modulus_pa": 1.2e9,
    "valve_rated_flow_m3_s": 5.0e-4,
    "valve_rated_drop_per_edge_pa": 3.5e6,
    "valve_natural_frequency_hz": 30.0,
    "valve_damping": 0.8,
    "valve_deadband": 0.02,
    "internal_leakage_m3_s_pa": 1.0e-13,
}
REFUSED = {"inclination_deg": 20.0, "cushion_length_m": 0.05}
ELSEWHERE = {"circuit", "tolerances"}
"""The circuit is tried part by part, tolerances number by number."""


def told(**changes: object) -> bytes:
    """All that a model with this in it makes a run believe, as bytes."""
    model = LegModel.model_validate({"known": KNOWN} | changes)
    found = Believed.from_model(model, 1e-3, MACHINE)
    return repr((found.legs, found.supply_pa)).encode() + found.valves.tobytes()


def test_every_declared_number_is_tried() -> None:
    assert set(KNOWN) | set(REFUSED) | ELSEWHERE == set(Known.model_fields)


@pytest.mark.parametrize("number", KNOWN)
def test_a_declared_number_is_believed(number: str) -> None:
    assert told(known=KNOWN | {number: 1.1 * KNOWN[number]}) != told()


@pytest.mark.parametrize("number", [name for name in Circuit.model_fields if name != "supply"])
def test_a_part_of_the_circuit_is_believed(number: str) -> None:
    other = "check" if number.startswith("holding") else 0.5
    varying = {"supply": "varying"}
    plain = told(known=KNOWN | {"circuit": varying})
    assert told(known=KNOWN | {"circuit": varying | {number: other}}) != plain


def test_a_supply_that_a_run_does_not_have_is_refused() -> None:
    with pytest.raises(InputError, match=r"known\.circuit\.supply = 'constant': would have no eff"):
        told(known=KNOWN | {"circuit": {"edge_at": 2.0}})


@pytest.mark.parametrize("number", Known.model_fields)
def test_a_tolerance_widens_what_the_robot_believes_or_is_refused(number: str) -> None:
    if number in ELSEWHERE:
        return
    model = LegModel.model_validate({"known": KNOWN | {"tolerances": {number: 0.05}}})
    if number not in OF_TOLERANCES:
        with pytest.raises(
            InputError, match=rf"tolerances\.{number} = 0\.05: would have no effect"
        ):
            spreads_of_leg(model)
        return
    found = Uncertainty("workshop", spreads_of_leg(model))
    assert (
        constants(found, MACHINE).tobytes() != constants(Uncertainty("workshop"), MACHINE).tobytes()
    )


@pytest.mark.parametrize("number", Friction.model_fields)
def test_a_parameter_of_friction_is_believed(number: str) -> None:
    assert told(friction={number: 0.5}) != told()


def test_a_constant_force_is_believed() -> None:
    assert told(force_offset_n=10.0) != told()


@pytest.mark.parametrize("number", REFUSED)
def test_a_number_that_no_live_estimate_knows_is_refused(number: str) -> None:
    with pytest.raises(InputError, match=rf"known\.{number} = .*would have no effect"):
        told(known=KNOWN | {number: REFUSED[number]})


@pytest.mark.parametrize("effect", [e for e in ALL if e.rigs], ids=lambda e: e.kind)
def test_an_effect_is_believed_or_refused(effect: object) -> None:
    live = effect.live  # type: ignore[attr-defined]
    name = effect.kind  # type: ignore[attr-defined]
    entry = EffectEntry(name=name, parameters={p: {"value": 0.01} for p in live} or {})
    if live:
        assert told(effects=[entry]) != told()
        assert told(effects=[entry.model_copy(update={"place": "fl"})]) != told(effects=[entry])
    else:
        with pytest.raises(InputError, match=rf"effects\.{name}: would have no effect"):
            told(effects=[entry])


def test_an_effect_at_a_cylinder_that_is_not_vertical_is_refused() -> None:
    entry = {"name": "sensor.zero_a", "place": "fl_radial", "parameters": {"zero": 1e4}}
    with pytest.raises(InputError, match=r"place = 'fl_radial': would have no effect"):
        told(effects=[entry])
