"""Scenario files: what they say is what the program gets, and defaults are where the schema
says.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from pydantic import ValidationError

from testbed import resources
from testbed.errors import InputError
from testbed.formats.schema import rows
from testbed.formats.yaml_files import parse_yaml
from testbed.machine.build import build_machine
from testbed.scenario.scenario import Scenario, load_scenario

HEAD = "format: roboclimber-scenario/1\n"


@pytest.fixture
def write(tmp_path: Path):
    def _write(text: str, name: str = "hill.yaml") -> Path:
        path = tmp_path / name
        path.write_text(HEAD + text)
        return path

    return _write


def test_an_empty_scenario_is_ten_seconds_of_standing_on_level_ground(write) -> None:
    scenario = load_scenario(write(""))
    assert (scenario.name, scenario.duration_s, scenario.terrain.slope_deg, scenario.task.kind) == (
        "hill",
        10.0,
        0.0,
        "stand",
    )
    assert scenario.robot.vertical_m == (0.25, 0.25, 0.25, 0.25)


def test_one_number_stands_for_four_legs_and_a_list_for_each(write) -> None:
    scenario = load_scenario(write("robot: {vertical_m: 0.3, radial_m: [0.1, 0.2, 0.3, 0.4]}"))
    assert scenario.robot.vertical_m == (0.3,) * 4
    assert scenario.robot.radial_m == (0.1, 0.2, 0.3, 0.4)


def test_overrides_reach_numbers_lists_and_dotted_parameters(write) -> None:
    path = write(
        "task: {kind: drill, phases: [{kind: push, duration_s: 2}, {kind: rest, duration_s: 1}]}"
    )
    changes = [
        "terrain.slope_deg=6e1",
        "task.phases.1.duration_s=9",
        "hydraulics.parameters.oil.entrained_air=0.02",
        "ropes.tension_n=[1, 2]",
    ]
    scenario = load_scenario(path, changes, seed=7, duration=3.0)
    assert scenario.terrain.slope_deg == 60.0
    assert scenario.task.kind == "drill" and scenario.task.phases[1].duration_s == 9.0
    assert scenario.hydraulics.parameters == {"oil.entrained_air": 0.02}
    assert (scenario.seed, scenario.duration_s, scenario.ropes.tension_n) == (7, 3.0, (1.0, 2.0))


def test_what_estimators_reckon_with_may_differ_from_the_urdf_in_the_model(write) -> None:
    believed = load_scenario(
        write("model: {parameters: {legs: {foot_mass_kg: 20, hip_x_m: 0.91}}}")
    )
    assert believed.model.parameters == {"legs.foot_mass_kg": 20, "legs.hip_x_m": 0.91}


RULED = {
    "hydraulics.parameters.ground.friction=0.3": "terrain.friction rules it",
    "hydraulics.parameters.drill.rod_mass_kg=12": "task.rod_kg rules it",
    "hydraulics.parameters.drill.blow_n=100": "task.blow_n rules it",
    "hydraulics.parameters.rope.stiffness_ea_n=1e6": "ropes.stiffness_ea_n rules it",
    "hydraulics.parameters.oil.start_temperature_degc=20": "hydraulics.oil_temperature_degc rules it",
    "hydraulics.parameters.control.loop_gain_1_s=9": "model.parameters.control.loop_gain_1_s rules it",
    "hydraulics.parameters.legs.hip_x_m=0.95": "the URDF alone gives it",
    "hydraulics.parameters.each_leg.fl.hip_x_m=0.95": "the URDF alone gives it",
    "hydraulics.parameters.axes.fl_radial.oil.cooling_w_k=9": "all axes share it",
    "hydraulics.parameters.power_unit.unloading_band_pa=1e6": "only power_unit.supply_kind = 2 reads it",
    "hydraulics.parameters.valve.counterbalance_pilot_ratio=4": "only valve.holding_a = 2 reads it",
    "hydraulics.parameters.power_unit.tank_oil_m3=0.1": "nothing reads it",
    "model.parameters.axes.fl_radial.oil.entrained_air=0.01": "nothing reads it",
    "model.parameters.sensor.line_b_length_m=0.9": "nothing reads it",
}


@pytest.mark.parametrize("change", RULED)
def test_a_number_that_another_field_rules_is_refused_with_its_name(change: str) -> None:
    with pytest.raises(InputError, match=f"would have no effect: {re.escape(RULED[change])}"):
        load_scenario("stand_flat", [change])


def test_two_pressures_of_the_pump_are_refused() -> None:
    path = "hydraulics.parameters.power_unit.supply_pressure_pa=8e6"
    assert load_scenario("stand_flat", [path])
    with pytest.raises(InputError, match=r"hydraulics\.supply_pressure_pa rules it"):
        load_scenario("stand_flat", [path, "hydraulics.supply_pressure_pa=8e6"])


def test_nested_parameters_are_dotted_ones(write) -> None:
    nested = load_scenario(write("model: {parameters: {valve: {deadband: 0.04}}}"))
    assert nested.model.parameters == {"valve.deadband": 0.04}


def test_a_scenario_cannot_be_changed_after_it_was_checked(write) -> None:
    with pytest.raises(ValidationError):
        load_scenario(write("")).terrain.slope_deg = 50.0  # type: ignore[misc]


def test_a_urdf_counts_from_the_scenarios_folder(write, tmp_path: Path) -> None:
    (tmp_path / "variant.urdf").write_text(build_machine().urdf.read_text())
    assert load_scenario(write("robot: {urdf: variant.urdf}")).robot.urdf == str(
        tmp_path / "variant.urdf"
    )


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e8", 1e8),
        ("1.5E-3", 1.5e-3),
        ("010", 10),
        ("off", "off"),
        ("no", "no"),
        ("true", True),
        ("~", None),
        ("", None),
        ("-.5", -0.5),
        ("12:30", "12:30"),
        ("2020-01-01", "2020-01-01"),
        ("0.1.2", "0.1.2"),
    ],
)
def test_yaml_means_what_people_mean(text: str, value: object) -> None:
    found = parse_yaml(f"a: {text}", "x")["a"]
    assert found == value and type(found) is type(value)


@pytest.mark.parametrize(
    "path", sorted(resources.folder("scenarios").glob("*.yaml")), ids=lambda p: p.stem
)
def test_every_shipped_scenario_is_sound_and_says_what_it_is_for(path: Path) -> None:
    scenario = load_scenario(path)
    assert scenario.name == path.stem
    assert len(scenario.description) > 20
    assert scenario.expect.verdict is not None


def test_a_mutation_is_a_change_that_loads(write) -> None:
    text = "mutation: {set: {terrain.friction: 0.1, robot.vertical_m: [0.2, 0.2, 0.3, 0.3]}, because: it slides}"
    path = write(text, "mutant.yaml")
    mutation = load_scenario(path).mutation
    assert mutation is not None and mutation.because == "it slides"
    changed = load_scenario(path, mutation.overrides())
    assert changed.terrain.friction == 0.1 and changed.robot.vertical_m == (0.2, 0.2, 0.3, 0.3)


@pytest.mark.parametrize("name", ["stand_flat", "stand_flat.yaml", "scenarios/stand_flat.yaml"])
def test_shipped_scenarios_go_by_name_from_anywhere(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert load_scenario(name).name == "stand_flat"


def test_a_file_of_ones_own_goes_before_a_shipped_one(
    write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write("duration_s: 3", "stand_flat.yaml")
    monkeypatch.chdir(tmp_path)
    assert load_scenario("stand_flat.yaml").duration_s == 3.0


def test_rates_must_divide_the_physics() -> None:
    with pytest.raises(InputError, match="control_hz = 300 does not divide physics_hz = 1000"):
        load_scenario("stand_flat", ["rates.control_hz=300"])
    assert (
        load_scenario(
            "stand_flat", ["rates.control_hz=250", "rates.physics_hz=4000"]
        ).rates.control_hz
        == 250
    )


def test_every_field_is_described() -> None:
    assert [
        row.path for row in rows(Scenario) if not row.meaning and not row.path.endswith(".kind")
    ] == []


def test_a_scenario_survives_the_way_to_json_and_back() -> None:
    scenario = load_scenario("drill_slope_45")
    assert Scenario.model_validate_json(scenario.model_dump_json()) == scenario


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("vertical_cylinder.dead_volume_a_m3", 5.0),
        ("vertical_cylinder.viscous_out_n_s_m", 1e9),
        ("seal.viscosity_rate_1_k", 3.0),
        ("oil.start_temperature_degc", 1000.0),
        ("end_stop.stiffness_n_m", 1e15),
        ("power_unit.supply_pressure_pa", 1e11),
    ],
)
def test_a_number_that_no_machine_has_is_refused(path: str, value: float) -> None:
    with pytest.raises(InputError, match=path.rpartition(".")[2]):
        load_scenario("stand_flat", [f"hydraulics.parameters.{path}={value:g}"])


@pytest.mark.parametrize(
    ("file", "name"),
    [("Öl stand 机.yaml", "Öl_stand_机"), ("_-.yaml", "scenario"), ("a.b.yaml", "a.b")],
)
def test_a_scenario_without_a_name_is_called_after_its_file_whatever_its_letters(
    write, file: str, name: str
) -> None:
    assert load_scenario(write("", file)).name == name


def test_what_takes_one_number_or_four_says_so(write):
    with pytest.raises(InputError, match=r"robot.vertical_m.*a number, or a list of four"):
        load_scenario(write("robot: {vertical_m: 250mm}"))
