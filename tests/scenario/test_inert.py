"""A field that another field of the scenario puts out of use is refused by that field's name."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from shipped import MACHINE

from testbed.errors import InputError
from testbed.formats.files import plain
from testbed.formats.yaml_files import yaml_text
from testbed.machine.build import build_machine
from testbed.machine.model import Machine
from testbed.scenario.feasibility import RULES
from testbed.scenario.left_out import OF_HYDRAULICS
from testbed.scenario.parts import HYDRAULIC_PARTS
from testbed.scenario.scenario import load_scenario
from testbed.world.hydraulic_parameters import axis_parameters, unit_parameters
from testbed.world.switches import switch_off

FRAME = ("body", "legs", "joints", "each_leg", "drill", "rope", "ground", "rock", "control")
"""Groups of which the hydraulics are not made."""
KINDS = {"valve.holding_a": 2.0, "valve.holding_b": 1.0, "power_unit.supply_kind": 2.0}
"""Other values of numbers that name a kind."""

BESIDE = (
    ("ropes.enabled=false", "ropes.share=0.5"),
    ("ropes.tension_n=[9000, 9000]", "ropes.share=0.5"),
    ("hydraulics.pump=false", "hydraulics.supply_pressure_pa=8e6"),
    ("control.dither_m=0", "control.dither_hz=3"),
    ("task={kind: stand}", "control.thrust_reserve=0.5"),
    ("terrain.plastic_n_m=null", "terrain.settle_s=2"),
    ("terrain.roughness_m=0", "terrain.hurst=0.5"),
    ("terrain.kind=plane", "terrain.cell_m=0.2"),
    ("sensors.noise=false", "hydraulics.parameters.sensor.rope_tension_noise_n=90"),
    ("sensors.quantisation=false", "hydraulics.parameters.sensor.encoder_linear_m=1e-3"),
    ("sensors.thermal_drift=false", "hydraulics.parameters.sensor.thermal_zero_share=0.02"),
    ("sensors.characteristic=false", "hydraulics.parameters.sensor.pressure_linearity_pa=5e4"),
    ("ropes.strokes=false", "hydraulics.parameters.traction.stroke_m=0.3"),
)
"""What puts a field out of use, and another value of that field: one for each rule but those of
parts that a list leaves out.
"""
LEFT_OUT = (
    ("hydraulics.without=[friction]", "hydraulics.parameters.vertical_cylinder.coulomb_out_n=700"),
    ("hydraulics.without=[coulomb]", "hydraulics.parameters.axes.rl_vertical.seal.dwell_gain=0.3"),
    ("hydraulics.without=[friction]", "hydraulics.stuck_seals=0.5"),
    ("hydraulics.without=[deadband]", "hydraulics.parameters.valve.deadband=0.1"),
    ("hydraulics.without=[load_holding]", "hydraulics.parameters.valve.holding_b=2"),
    ("hydraulics.without=[oil_warming]", "hydraulics.parameters.oil.cooling_w_k=90"),
    ("sensors.without=[pressure]", "hydraulics.parameters.sensor.pressure_noise_pa=2e4"),
    ("sensors.without=[encoder]", "hydraulics.parameters.sensor.encoder_linear_m=1e-3"),
)


@pytest.mark.parametrize(("ruler", "field"), (*BESIDE, *LEFT_OUT))
def test_a_field_that_another_rules_is_refused_by_its_name(ruler: str, field: str) -> None:
    load_scenario("stand_slope_45", [ruler])
    with pytest.raises(InputError) as error:
        load_scenario("stand_slope_45", [ruler, field])
    told = str(error.value)
    assert field.partition("=")[0] in told
    assert f"would have no effect: {ruler.partition('=')[0]} rules it" in told


def test_every_rule_is_tried() -> None:
    others = [rule.ruler for rule in RULES if not rule.ruler.endswith(".without")]
    assert others == [ruler.partition("=")[0] for ruler, _ in BESIDE]


def _hydraulics(machine: Machine) -> dict[str, bytes]:
    """What the world's hydraulics are made of, without each part, and ("") with all."""
    found = {}
    axes, unit = axis_parameters(machine), unit_parameters(machine)
    for part in ("", *HYDRAULIC_PARTS):
        left = axes.copy(), unit.copy()
        switch_off([part] if part else [], *left)
        found[part] = left[0].tobytes() + left[1].tobytes()
    return found


LAG = ("transducer_lag", "sensor.transducer_bandwidth_hz")
"""What the lag lets pass of a ripple remains."""


def test_a_number_of_which_a_switched_off_part_leaves_nothing_is_ruled_by_it() -> None:
    """Every number in turn, beside every part: what the part's switch wipes out of all that the
    world's hydraulics are made of.
    """
    drawn = _hydraulics(MACHINE)
    wiped = []
    for path, quantity in MACHINE.leaves():
        if isinstance(quantity.value, tuple) or path.split(".")[0] in FRAME:
            continue
        other = KINDS.get(path, 1.03 * quantity.value if quantity.value else 1e-3)
        changed = _hydraulics(build_machine({path: other}))
        if changed[""] != drawn[""]:
            wiped += [(part, path) for part in HYDRAULIC_PARTS if changed[part] == drawn[part]]
    ruled = [
        (part, path)
        for part, path in wiped
        if re.fullmatch(OF_HYDRAULICS.get(part, ""), path) is not None
    ]
    assert set(wiped) - set(ruled) == {LAG}
    assert {part for part, _ in ruled} == set(OF_HYDRAULICS)


@pytest.mark.parametrize("part", OF_HYDRAULICS)
def test_numbers_of_other_parts_stay(part: str) -> None:
    """What every part leaves alone: bores, the oil's stiffness, the full flow."""
    for path in ("vertical_cylinder.bore_m", "oil.bulk_modulus_pa", "power_unit.full_flow_m3_s"):
        assert re.fullmatch(OF_HYDRAULICS[part], path) is None


def test_what_a_change_puts_out_of_use_becomes_what_it_is_by_default(tmp_path: Path) -> None:
    """The file's author gave it for the ropes that the user takes away; the run's own copy of the
    scenario loads again.
    """
    file = tmp_path / "roped.yaml"
    file.write_text("format: roboclimber-scenario/1\nropes: {share: 0.5, sag: true}\n")
    plain_ropes = load_scenario(file, ["ropes.enabled=false"])
    assert (plain_ropes.ropes.share, plain_ropes.ropes.sag) == (0.9, False)
    copy = tmp_path / "scenario.yaml"
    copy.write_text(yaml_text(plain(plain_ropes.model_dump(mode="json"))))
    assert load_scenario(copy) == plain_ropes.model_copy(update={"name": "roped"})


def test_a_file_that_gives_both_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "both.yaml"
    file.write_text("format: roboclimber-scenario/1\nropes: {enabled: false, share: 0.5}\n")
    with pytest.raises(InputError, match=r"ropes\.share = 0\.5: would have no effect"):
        load_scenario(file)


@pytest.mark.parametrize(
    ("needed", "change"),
    [
        ("ropes.enabled", "events=[{kind: cut_rope, at_s: 1, rope: left}]"),
        ("ropes.enabled", "events=[{kind: set_rope, at_s: 1, rope: left, pay_out_m: 0.1}]"),
        ("hydraulics.pump", "events=[{kind: set_supply, at_s: 1, pressure_pa: 5e6}]"),
    ],
)
def test_what_acts_on_something_that_is_not_there_is_refused(needed: str, change: str) -> None:
    load_scenario("stand_slope_45", [change])
    with pytest.raises(InputError, match=rf"0 = \S+: would have no effect .*{needed}: true"):
        load_scenario("stand_slope_45", [change, f"{needed}=false"])


def test_a_task_that_moves_feet_and_ropes_by_itself_takes_no_orders_for_them() -> None:
    for order in ("lift_foot, leg: fl", "set_rope, rope: left, pay_out_m: 0.1"):
        change = [f"events=[{{kind: {order}, at_s: 1}}]", "task={kind: commission}"]
        with pytest.raises(InputError, match="moves what the task commission moves itself"):
            load_scenario("stand_slope_45", change)


@pytest.mark.parametrize(
    ("patch", "said"),
    [
        ("{foot: fl, x_m: 3, friction: 0.1}", "a foot's place beside x_m or y_m"),
        ("{x_m: 3}", "a patch of the same ground"),
    ],
)
def test_a_patch_is_one_place_of_other_ground(patch: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        load_scenario("stand_slope_45", [f"terrain.patches=[{patch}]"])


def test_a_run_that_would_be_over_before_its_first_row_is_refused() -> None:
    load_scenario("stand_slope_45", ["rates.record_hz=2"], duration=0.5)
    load_scenario("stand_slope_45", ["rates.record_hz=100"], duration=0.001)
    with pytest.raises(InputError, match=r"rates\.record_hz = 1: records no row .*at least 2"):
        load_scenario("stand_slope_45", ["rates.record_hz=1"], duration=0.5)
