"""At the start nothing but feet is in the ground: a robot that lies rests on its belly and is not
thrown out of it, one on its feet with another part in the ground is refused.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from testbed import resources
from testbed.errors import InputError
from testbed.machine.build import build_machine
from testbed.machine.names import LEGS
from testbed.scenario.scenario import load_scenario
from testbed.simulation.live_run import simulate


@pytest.mark.parametrize("drawn_out_m", [0.0, 0.01])
def test_a_robot_on_its_belly_lies_still(drawn_out_m: float) -> None:
    scenario = load_scenario("raise_from_belly", [f"robot.vertical_m={drawn_out_m}"], duration=0.3)
    up = np.array([-np.sin(np.radians(30.0)), 0.0, np.cos(np.radians(30.0))])
    with simulate(scenario) as run:
        run.step(300)
        places = np.stack([run.truth[f"body_pose_in_world_{axis}"] for axis in "xyz"], axis=1)
        loads = np.stack([run.truth[f"foot_load_{leg}"] for leg in LEGS])
    assert places[0] @ up == pytest.approx(0.18, abs=1e-4)
    assert np.abs(places - places[0]).max() < 1e-3
    assert loads.max() == 0.0


def _with_shape(tmp_path: Path, link: str, height_m: float) -> Path:
    """The shipped URDF with a small sphere on a link, its underside at a height in that link's
    frame.
    """
    shape = (
        f'<collision><origin xyz="0 0 {height_m + 0.05}" rpy="0 0 0" />'
        '<geometry><sphere radius="0.05" /></geometry></collision>'
    )
    text, count = re.subn(
        rf'(<link name="{link}">)', rf"\1{shape}", resources.urdf().read_text(), count=1
    )
    assert count == 1
    path = tmp_path / "own.urdf"
    path.write_text(text)
    return path


@pytest.mark.parametrize(("lowest_m", "refused"), [(-0.35, False), (-0.45, True)])
def test_an_arm_in_the_ground_is_refused_by_its_link(
    tmp_path: Path, lowest_m: float, refused: bool
) -> None:
    """At 0.25 m of extension the ground is 0.41 m below the hips."""
    urdf = _with_shape(tmp_path, "rl_radial", lowest_m)
    scenario = load_scenario("stand_flat", [f"robot.urdf={urdf}"], duration=0.1)
    if not refused:
        with simulate(scenario) as run:
            run.step(100)
            assert min(run.truth[f"foot_load_{leg}"][-1] for leg in LEGS) > 0.0
        return
    with pytest.raises(
        InputError, match=r"rl_radial lies 40 mm in the ground.*at least 0\.29"
    ) as e:
        simulate(scenario)
    assert e.value.field == "robot.vertical_m"


def test_lengths_of_single_legs_are_kept_where_they_come_down_and_refused_where_they_would_vanish() -> (
    None
):
    """Legs that start on the ground reach for it; a longer one carries more only if put down so."""
    longer = ["robot.vertical_m=[0.25, 0.25, 0.25, 0.2505]", "hydraulics.valves_locked=true"]
    with pytest.raises(InputError, match=r"reach for it.*height_offset_m above 0") as e:
        simulate(load_scenario("stand_flat", longer, duration=0.1))
    assert e.value.field == "robot.vertical_m"
    put_down = [*longer, "robot.height_offset_m=0.0005"]
    with simulate(load_scenario("stand_flat", put_down, duration=1.0)) as run:
        run.step(1000)
        loads_n = {leg: run.truth[f"foot_load_{leg}"][-1] for leg in LEGS}
    assert loads_n["rr"] > 1.1 * loads_n["rl"]


def test_what_goes_down_with_a_foot_may_not_be_lower(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"link fr_vertical <collision> underside = '-0\.04 m'"):
        build_machine(urdf=_with_shape(tmp_path, "fr_vertical", -0.2))


def test_a_machine_that_its_cylinders_cannot_lift_is_refused_with_the_bound(tmp_path: Path) -> None:
    heavy = re.sub(
        r'\b(mass value|i[xyz][xyz])="([\d.e-]+)"',
        lambda found: f'{found[1]}="{1e3 * float(found[2])}"',
        resources.urdf().read_text(),
    )
    path = tmp_path / "own.urdf"
    path.write_text(heavy)
    with pytest.raises(InputError, match=r"total mass = '4e\+06 kg'.*138\.5 kN.*at most 14123 kg"):
        build_machine(urdf=path)
    low = {"power_unit.supply_pressure_pa": 3.0e5}
    assert build_machine(low).power_unit.supply_pressure_pa == 3.0e5


def test_each_foot_has_its_own_radius(tmp_path: Path) -> None:
    from testbed.robot.model import RobotModel

    text = resources.urdf().read_text()
    start = text.index('<link name="rr_foot">')
    large = text[start:].replace('sphere radius="0.1"', 'sphere radius="0.14"', 1)
    large = large.replace('xyz="0 0 0.1"', 'xyz="0 0 0.14"', 1)
    path = tmp_path / "own.urdf"
    path.write_text(text[:start] + large)
    assert RobotModel(path).foot_radii_m.tolist() == [0.1, 0.1, 0.1, 0.14]
    assert build_machine(urdf=path).each_leg["rr"].foot_radius_m == pytest.approx(0.14)


def test_uneven_legs_hang_as_they_are_drawn_in_where_the_robot_lies(tmp_path: Path) -> None:
    """One foot is 0.1 m higher than the others, drawn in: on its belly nothing must reach down."""
    text = resources.urdf().read_text()
    old = '<origin xyz="0 0 -0.16" rpy="0 0 0" />'
    at = text.index('name="rl_foot_mount"')
    assert old in text[at:]
    path = tmp_path / "own.urdf"
    path.write_text(text[:at] + text[at:].replace(old, old.replace("-0.16", "-0.06"), 1))
    scenario = load_scenario("raise_from_belly", [f"robot.urdf={path}"], duration=0.2)
    with simulate(scenario) as run:
        run.step(200)
        assert max(run.truth[f"foot_load_{leg}"].max() for leg in LEGS) == 0.0
        assert abs(run.rows["position_rl_vertical"]).max() < 1e-3
    with pytest.raises(InputError, match="terrain"):
        simulate(load_scenario("stand_flat", [f"robot.urdf={path}", "robot.vertical_m=0.48"]))
