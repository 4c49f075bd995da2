"""A machine in a folder of its own: its numbers, its URDF, what it lacks, and that nothing of it is
ROBOCLIMBER's by chance.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from testbed.errors import InputError
from testbed.machine.build import build_machine
from testbed.machine.folder import BODIES, NUMBERS, machine_folder
from testbed.machine.provenance import MARKS
from testbed.machine.scale import Scale, exponent
from testbed.machine.urdf_check import OPTIONAL_LINKS, lacking
from testbed.scenario.machines import machines_of
from testbed.scenario.scenario import load_scenario
from testbed.workflows.machines import check_machine

HEAD = "format: roboclimber-machine/1\nname: mine\n"
BORE = "numbers: {vertical_cylinder: {bore_m: {value: 0.08, unit: %s, mark: E, source: mine}}}\n"


def _folder(tmp_path: Path, text: str) -> Path:
    (tmp_path / NUMBERS).write_text(text)
    return tmp_path


@pytest.mark.parametrize(
    ("unit", "power"),
    [
        ("m", 1.0),
        ("kg", 3.0),
        ("N s/m", 2.5),
        ("m3/(s Pa)", 1.5),
        ("1/s2", -1.0),
        ("m3/s", 2.5),
        ("Hz", -0.5),
        ("J/K", 4.0),
        ("1", 0.0),
        ("m/s2", 0.0),
    ],
)
def test_numbers_grow_by_the_power_that_their_unit_has(unit: str, power: float) -> None:
    assert exponent(unit) == pytest.approx(power)


def test_every_unit_of_the_machine_has_a_power() -> None:
    assert all(isinstance(exponent(q.unit), float) for _, q in build_machine().leaves())


def test_a_machine_of_nothing_but_a_name_is_roboclimber(tmp_path: Path) -> None:
    check_machine(str(_folder(tmp_path, HEAD)))
    shipped, mine = build_machine(), build_machine(folder=tmp_path)
    for path, quantity in shipped.leaves():
        assert mine.quantity(path).value == pytest.approx(quantity.value, rel=1e-9), path
    assert mine.scale == Scale(1.0, 1.0)


def test_one_leg_and_one_cylinder_may_differ(tmp_path: Path) -> None:
    text = (
        "numbers:\n  each_leg: {rl: {radial_offset_m: {value: 0.4, unit: m, mark: E, source: short}}}\n"
        "  axes:\n"
        "    fl_vertical: {limits: {upper_m: {value: 0.8, unit: m, mark: E, source: long}}}\n"
        "    rr_rotation: {limits: {upper_rad: {value: 0.4, unit: rad, mark: E, source: near}}}\n"
    )
    check_machine(str(_folder(tmp_path, HEAD + text)))
    mine = build_machine(folder=tmp_path)
    assert mine.each_leg["rl"].radial_offset_m == pytest.approx(0.4)
    assert mine.each_leg["fl"].radial_offset_m == pytest.approx(0.5)
    assert mine.axes["fl_vertical"].travel_m == pytest.approx(0.8)
    assert mine.axes["fr_vertical"].travel_m == pytest.approx(0.5)
    assert mine.axes["rr_rotation"].limits.ends == pytest.approx((-0.6108652, 0.4))
    assert mine.axes["rl_rotation"].limits is mine.joints.rotation


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (HEAD + BORE % "mm", "bore_m.*another unit or shape.*like 0.07 m"),
        (HEAD + "numbers: {wings: {span_m: {value: 1, unit: m, mark: E, source: x}}}\n", "no such"),
        (HEAD + "numbers: {oil: {entrained_air: 0.1}}\n", "must carry value, unit"),
        (HEAD + "wheels: 4\n", "wheels: unknown key"),
        ("format: roboclimber-machine/9\nname: mine\n", "format"),
        (HEAD + "length_scale: -1\n", "length_scale"),
    ],
)
def test_what_cannot_be_a_machine_is_refused_by_its_number(
    tmp_path: Path, text: str, said: str
) -> None:
    with pytest.raises(InputError, match=said):
        check_machine(str(_folder(tmp_path, text)))


def test_a_folder_without_numbers_or_urdf_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no folder with a machine\.yaml .*climber_8t"):
        machine_folder(tmp_path)
    _folder(tmp_path, HEAD)
    with pytest.raises(InputError, match=r"has no URDF.*testbed machine"):
        build_machine(folder=tmp_path)


@pytest.mark.parametrize("name", ["climber_8t", "quarter_model"])
def test_shipped_machines_are_marked_and_drawn_from_their_numbers(
    name: str, tmp_path: Path
) -> None:
    shipped = machine_folder(name)
    machine = build_machine(folder=shipped)
    assert {q.mark for _, q in machine.leaves()} <= set(MARKS)
    own = [
        q
        for _, q in machine.leaves()
        if q.mark in "ABC" and q.source.startswith(("as ROBO", "ROBO"))
    ]
    assert not own, "nothing that ROBOCLIMBER's authors said holds for another machine"
    _folder(tmp_path, (shipped / NUMBERS).read_text())
    check_machine(str(tmp_path))
    assert (tmp_path / BODIES).read_text() == (shipped / BODIES).read_text()


def test_a_light_leg_asks_for_a_fast_clock_and_its_scenarios_have_it() -> None:
    """1.43 kg on oil and seal of 6.4 MN/m ring at 2112 rad/s, 91.7 kg on 61 MN/m at 816 rad/s."""
    least = {
        name: check_machine(name)["figures"]["least rates.physics_hz"][0]
        for name in ("quarter_model", "climber_8t")
    }
    assert least == {"quarter_model": 2000, "climber_8t": 1000}
    for name, least_hz in least.items():
        for scenario in (f"{name}_stand", f"{name}_crawl"):
            assert load_scenario(scenario).rates.physics_hz >= least_hz


def test_the_model_lacks_drill_and_ropes_and_is_refused_them() -> None:
    lacks = lacking(build_machine(folder=machine_folder("quarter_model")).urdf)
    assert lacks == set(OPTIONAL_LINKS)
    for change, said in (
        ("ropes={enabled: true}", "no traction_left"),
        ("task={kind: drill}", "no drill_mast"),
        ("robot.payload_kg=1", "no rod_store"),
        ("robot.urdf=other.urdf", "beside machine.folder"),
        ("robot.vertical_m=0.2", "stroke at fl.*0 to 0.125 m"),
        ("task={kind: raise, to_m: 0.2}", "stroke.*at most 0.125 m"),
    ):
        with pytest.raises(InputError, match=said):
            load_scenario("quarter_model_stand", [change])


def test_world_and_belief_are_both_the_folders_machine() -> None:
    machines = machines_of(load_scenario("climber_8t_stand"))
    for machine in (machines.truth, machines.belief):
        assert machine.total_mass_kg == pytest.approx(8000.0, rel=1e-3)
        assert machine.scale.force == 2.0


def test_a_number_that_the_urdf_overrules_is_refused(tmp_path: Path) -> None:
    """A mass of all legs, one leg's own and a stroke: what is changed after the URDF was drawn."""
    check_machine(str(_folder(tmp_path, HEAD)))
    for text, said in (
        ("legs: {foot_mass_kg: {value: 20, unit: kg", r"legs\.foot_mass_kg = 20.*says 15"),
        (
            "each_leg: {rl: {hip_y_m: {value: 0.5, unit: m",
            r"each_leg\.rl\.hip_y_m = 0\.5.*says 0\.4",
        ),
        (
            "vertical_cylinder: {stroke_m: {value: 0.8, unit: m",
            r"vertical_cylinder\.stroke_m = 0\.8.*says 0\.5",
        ),
    ):
        closing = ", mark: E, source: mine}" + "}" * text.count("{", 0, text.index("value"))
        (tmp_path / NUMBERS).write_text(f"{HEAD}numbers: {{{text}{closing}\n")
        with pytest.raises(InputError, match=rf"machine\.yaml: numbers\.{said}"):
            build_machine(folder=tmp_path)


def test_a_clock_that_is_too_slow_for_a_light_leg_is_refused() -> None:
    with pytest.raises(InputError, match=r"rates\.physics_hz = 1000: is too slow.*at least 2000"):
        load_scenario("quarter_model_stand", ["rates.physics_hz=1000"])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "joints: {rotation: {effort_n_m: {value: 9000, unit: N m",
            r"effort_n_m = 9000.*says 3690",
        ),
        ("joints: {vertical: {velocity_m_s: {value: 1, unit: m/s", r"velocity_m_s = 1.*says 0\.2"),
        ("body: {belly_height_m: {value: -0.3, unit: m", r"belly_height_m = -0\.3.*says -0\.18"),
        ("body: {inertia_box_m: {value: [3, 1, 1], unit: m", r"inertia_box_m.*says \(1\.9"),
        ("legs: {foot_radius_m: {value: 0.2, unit: m", r"foot_radius_m = 0\.2.*says 0\.1"),
        (
            "each_leg: {rl: {radial_inertia_centre_m: {value: [0, 0, 0], unit: m",
            r"each_leg\.rl\.radial_inertia_centre_m.*says \(-0\.1",
        ),
        ("power_unit: {tank_oil_m3: {value: 1, unit: m3", r"tank_oil_m3 = 1.*nothing reads it"),
        (
            "axes: {fl_vertical: {oil: {ambient_degc: {value: 9, unit: degC",
            r"ambient_degc = 9.*all axes share it",
        ),
    ],
)
def test_nothing_in_a_folder_is_accepted_without_effect(
    tmp_path: Path, text: str, said: str
) -> None:
    """Efforts, speeds, inertias and shapes as much as lengths: the URDF has them, or nobody."""
    check_machine(str(_folder(tmp_path, HEAD)))
    closing = ", mark: E, source: mine}" + "}" * text.count("{", 0, text.index("value"))
    (tmp_path / NUMBERS).write_text(f"{HEAD}numbers: {{{text}{closing}\n")
    with pytest.raises(InputError, match=said):
        build_machine(folder=tmp_path)


def test_what_a_folder_draws_its_urdf_says(tmp_path: Path) -> None:
    """Inertias, efforts and shapes come back out of a URDF as they were drawn into it."""
    text = (
        "numbers:\n  joints: {rotation: {effort_n_m: {value: 9000, unit: N m, mark: E, source: x}}}\n"
        "  legs: {radial_inertia_box_m: {value: [0.5, 0.3, 0.9], unit: m, mark: E, source: x}}\n"
        "  each_leg: {rr: {foot_radius_m: {value: 0.14, unit: m, mark: E, source: x}}}\n"
    )
    check_machine(str(_folder(tmp_path, HEAD + text)))
    mine = build_machine(folder=tmp_path)
    assert mine.axes["fl_rotation"].limits.model_dump()["effort_n_m"] == pytest.approx(9000.0)
    assert mine.each_leg["rl"].radial_inertia_box_m == pytest.approx((0.5, 0.3, 0.9))
    assert mine.each_leg["rr"].foot_radius_m == pytest.approx(0.14)


def test_a_scenario_that_says_nothing_has_its_machines_ropes() -> None:
    """A folder's number is the default of the field that rules it; the scenario's own word wins."""
    assert load_scenario("climber_8t_stand").ropes.breaking_load_n == 2.33e5
    told = load_scenario("climber_8t_stand", ["ropes.breaking_load_n=1e5"])
    assert told.ropes.breaking_load_n == 1e5
    hole = load_scenario("climber_8t_drill", ["task={kind: drill_hole}"]).task
    assert hole.model_dump()["rod_length_m"] == 2.0
    without = load_scenario("climber_8t_stand", ["ropes.enabled=false", "terrain.slope_deg=0"])
    assert without.ropes.breaking_load_n == load_scenario("stand_flat").ropes.breaking_load_n
