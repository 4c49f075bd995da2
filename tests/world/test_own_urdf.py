"""A robot of one's own by its URDF alone: kinematics, planning, hydraulics and pages follow it, or
it is refused.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from shipped import MACHINE

from testbed.errors import InputError
from testbed.machine.build import build_machine
from testbed.machine.names import LEGS
from testbed.machine.urdf_geometry import urdf_numbers
from testbed.robot.robot import Robot
from testbed.robot.urdf.generate import urdf_text
from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation
from testbed.world.summary import surveyed, world_summary

LONGER_M = 0.2


def written(folder: Path, **changes: object) -> Path:
    """The URDF of the shipped machine with some numbers changed; dots of paths are written as two
    underscores.
    """
    path = folder / "own.urdf"
    numbers = {name.replace("__", "."): value for name, value in changes.items()}
    path.write_text(urdf_text(MACHINE.replaced(numbers)))
    return path


@pytest.fixture
def long_arms(tmp_path: Path) -> Path:
    return written(tmp_path, legs__radial_offset_m=MACHINE.legs.radial_offset_m + LONGER_M)


def test_the_shipped_urdf_says_nothing_that_the_shipped_numbers_do_not() -> None:
    assert not [q for _, q in build_machine(urdf=MACHINE.urdf).leaves() if "read from" in q.source]


def test_numbers_that_the_urdf_gives_replace_the_declared_ones(tmp_path: Path) -> None:
    machine = build_machine(
        urdf=written(
            tmp_path,
            joints__vertical__upper_m=0.8,
            each_leg__rl__hip_x_m=0.95,
            body__mass_kg=1400.0,
        )
    )
    assert machine.axes["rr_vertical"].travel_m == 0.8
    assert machine.each_leg["rl"].hip_x_m == 0.95 and machine.each_leg["fl"].hip_x_m == 0.90
    assert machine.total_mass_kg == pytest.approx(4000.0 - 63.2)
    assert machine.quantity("body.mass_kg").source == "read from own.urdf"


@pytest.mark.parametrize("longer", [0.0, LONGER_M])
def test_controls_feet_are_the_engines(tmp_path: Path, longer: float) -> None:
    own = written(
        tmp_path,
        legs__radial_offset_m=0.5 + longer,
        each_leg__rr__hip_y_m=0.43,
        each_leg__fl__radial_direction_rad=0.9,
        each_leg__rl__foot_height_retracted_m=-0.2,
    )
    world = Simulation(load_scenario("stand_flat", [f"robot.urdf={own}"]))
    try:
        engine, legs = world.machine.engine, world.machine.belief.legs
        joints = np.random.default_rng(4).uniform(0.05, 0.3, 12)
        engine.reset(np.zeros(3), np.eye(3), joints)
        soles = [float(f["height"]) for f in _soles(own)]
        for leg, link in enumerate(engine.foot_links):
            state = engine.bullet.getLinkState(engine.robot, link, computeForwardKinematics=1)
            foot = np.array(state[4]) + np.array([0.0, 0.0, soles[leg]])
            np.testing.assert_allclose(legs.feet(joints)[leg], foot, atol=1e-6)
            np.testing.assert_allclose(legs.joints(legs.feet(joints)), joints, atol=1e-9)
    finally:
        world.close()


def _soles(urdf: Path) -> list[dict[str, float]]:
    numbers = urdf_numbers(urdf)
    return [
        {
            "height": numbers[f"each_leg.{leg}.foot_height_retracted_m"]
            - numbers[f"each_leg.{leg}.hip_z_m"]
        }
        for leg in LEGS
    ]


def _slip_m(*changes: str) -> tuple[str, float, float]:
    world = Simulation(load_scenario("crawl_slope_45", list(changes), duration=12.0))
    try:
        while not world.finished:
            world.run_block(1000)
        return (
            world.verdict,
            world_summary(world)["foot_slip_m"],
            world_summary(world)["body_travel_m"],
        )
    finally:
        world.close()


@pytest.mark.slow
def test_longer_arms_crawl_with_as_little_slip_as_the_shipped_ones(long_arms: Path) -> None:
    shipped, own = _slip_m(), _slip_m(f"robot.urdf={long_arms}")
    assert own[0] == shipped[0] == "stood"
    assert own[1] < shipped[1] + 0.005
    assert own[2] > 0.7 * shipped[2]


def test_control_believes_a_urdf_of_its_own(long_arms: Path) -> None:
    world = Simulation(load_scenario("stand_flat", [f"model.urdf={long_arms}"]))
    try:
        truth, belief = world.machines.truth, world.machine.belief
        assert truth.legs.radial_offset_m == 0.5 and belief.machine.legs.radial_offset_m == 0.7
        np.testing.assert_allclose(belief.legs.offsets_m, 0.7)
        assert surveyed(world)["urdf"] == str(long_arms)
    finally:
        world.close()


def test_a_longer_stroke_in_the_urdf_may_be_used(tmp_path: Path) -> None:
    own = written(tmp_path, joints__vertical__upper_m=0.8)
    assert load_scenario("stand_flat", [f"robot.urdf={own}", "robot.vertical_m=0.7"])
    with pytest.raises(InputError, match=r"robot\.vertical_m = 0\.7: .*0 to 0\.5 m"):
        load_scenario("stand_flat", ["robot.vertical_m=0.7"])


BROKEN = {
    "tilted hip": ('rpy="0 0 1.0471975512"', 'rpy="0.1 0 1.0471975512"', "joint fl_rotation axis"),
    "rising leg": ('xyz="0 0 -1"', 'xyz="0 0 1"', "joint fl_vertical axis"),
    "foot aside": ('<origin xyz="0.5 0 0"', '<origin xyz="0.5 0.02 0"', "link fl_foot.*20 mm"),
    "part extended": ('lower="0" upper="0.4"', 'lower="0.1" upper="0.4"', "fl_radial lower limit"),
    "one traction device": ("traction_left", "winch", "link traction_right: .*without the other"),
    "a foot in the ground": (
        '<sphere radius="0.1" />',
        '<sphere radius="0.15" />',
        "link fl_foot.*-0.05 m",
    ),
    "a foot of nothing": ("collision>", "visual>", "link fl_foot.*none"),
    "degrees": ('lower="-0.610865238198"', 'lower="-35"', "fl_rotation lower limit = -35.*rad"),
    "millimetres": ('upper="0.5"', 'upper="500"', "fl_vertical upper limit = 500.*in m "),
    "no effort": (
        'upper="0.5" effort="34600"',
        'upper="0.5"',
        "fl_vertical: its limit has no effort",
    ),
    "damped": ('damping="0"', 'damping="50"', "fl_rotation damping = 50.*no effect"),
    "a loose link": (
        'name="drill_mast_mount" type="fixed"',
        'name="x" type="floating"',
        "joint x: .*loose",
    ),
    "gram millimetres": ('ixx="125.847393333"', 'ixx="9e9"', "link body inertia.*kg m2"),
    "another order": (
        '<parent link="fl_rotation" />',
        '<parent link="body" />',
        "joint fl_radial parent",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", BROKEN)
def test_legs_of_another_plan_are_refused_with_what_is_wrong(case: str, tmp_path: Path) -> None:
    old, new, said = BROKEN[case]
    text = MACHINE.urdf.read_text()
    assert old in text
    path = tmp_path / "own.urdf"
    path.write_text(text.replace(old, new))
    with pytest.raises(InputError, match=rf"own\.urdf: .*{said}"):
        build_machine(urdf=path)


def test_a_machine_with_its_bodies_agrees_with_itself(long_arms: Path) -> None:
    robot = Robot.of(build_machine(urdf=long_arms))
    joints = np.tile([0.1, 0.2, 0.3], 4)
    np.testing.assert_allclose(
        robot.legs.feet(joints), robot.model.foot_positions_m(joints), atol=1e-9
    )
