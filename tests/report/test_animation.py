"""The moving wireframe: frames as the recording has them, few enough, in the slope's frame."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from shipped import MACHINE

from testbed.machine.build import build_machine
from testbed.machine.folder import machine_folder
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.report.animation import animation, arrows
from testbed.report.motion import (
    MOST_FRAMES,
    Motion,
    footholds,
    frame_rows,
    heights_around,
    motion_at,
    recorded,
    support,
)
from testbed.robot.robot import Robot
from testbed.scenario.terrain import Terrain

SLOPE = math.radians(30.0)
Columns = dict[str, np.ndarray]
ROBOT = Robot.of(MACHINE)


def climbing(rows: int) -> tuple[Columns, Columns]:
    """A body that lies parallel to 30 degrees and climbs a metre; 10 kN on each foot along the
    slope's normal.
    """
    t = np.linspace(0.0, rows / 100.0, rows)
    way = t / t[-1]
    data = {"t": t} | {
        f"position_{axis}": np.full(rows, (0.0, 0.2, 0.25)[k % 3]) for k, axis in enumerate(AXES)
    }
    pose = {"x": way * math.cos(SLOPE), "y": 0 * t, "z": way * math.sin(SLOPE)}
    turn = {
        "qx": 0 * t,
        "qy": 0 * t - math.sin(SLOPE / 2),
        "qz": 0 * t,
        "qw": 0 * t + math.cos(SLOPE / 2),
    }
    truth = {"t": t} | {f"body_pose_in_world_{k}": v for k, v in (pose | turn).items()}
    normal = (-1e4 * math.sin(SLOPE), 0.0, 1e4 * math.cos(SLOPE))
    for leg in LEGS:
        truth[f"contact_normal_{leg}"] = np.full(rows, 1e4)
        truth |= {
            f"foot_force_in_world_{leg}_{k}": 0 * t + v for k, v in zip("xyz", normal, strict=True)
        }
    for side in SIDES:
        truth |= {f"rope_force_in_world_{side}_{k}": 0 * t for k in "xyz"}
    truth |= {f"drill_wrench_in_world_{k}": 0 * t for k in ("fx", "fy", "fz", "tx", "ty", "tz")}
    return data, truth


def moving(rows: int) -> Motion:
    data, truth = climbing(rows)
    return motion_at(data, truth, 30.0, ROBOT, frame_rows(truth))


def test_the_body_climbs_along_x_its_feet_follow_and_their_forces_point_off_the_slope() -> None:
    text = animation(moving(1000), 30.0, ROBOT)
    frames = json.loads(text)["frames"]
    first, last = frames[0], frames[-1]
    assert len(frames) == 100 and len(first) == 42
    assert last[1] - first[1] == pytest.approx(1000 * 990 / 999, abs=2) and last[3] == 0
    assert first[4:10] == [1000, 0, 0, 0, 0, 1000]
    assert last[10] - first[10] == last[1] - first[1]
    assert first[22:25] == [0, 0, 1000]
    assert json.loads(text)["ground"] == first[12]


def test_a_long_run_keeps_to_the_frames_that_a_page_can_carry() -> None:
    text = animation(moving(60_000), 30.0, ROBOT)
    assert len(json.loads(text)["frames"]) <= MOST_FRAMES


def test_a_recording_without_poses_has_no_animation() -> None:
    data, truth = climbing(50)
    assert recorded(data, truth)
    del truth["body_pose_in_world_x"]
    assert not recorded(data, truth)


def test_a_foot_that_is_lifted_once_has_two_footholds_where_it_stood() -> None:
    data, truth = climbing(200)
    air = slice(90, 120)
    truth["contact_normal_fl"][air] = 0.0
    motion = motion_at(data, truth, 30.0, ROBOT, np.arange(200))
    places = footholds(motion, 0)
    assert len(places) == 2 and len(footholds(motion, 1)) == 1
    assert places[1, 0] - places[0, 0] == pytest.approx((159.5 - 44.5) / 199, abs=1e-6)
    corners, _ = support(motion, 100)
    assert len(corners) == 3


def test_the_load_of_four_even_feet_acts_in_their_middle() -> None:
    motion = moving(100)
    corners, load = support(motion, 0)
    assert load == pytest.approx(corners.mean(axis=0), abs=1e-9)


def test_rock_is_drawn_as_it_is_and_a_plane_as_one_height() -> None:
    path = np.array([[0.0, 0.0], [2.0, 1.0]])
    assert heights_around(Terrain(slope_deg=30.0), path) is None
    profile = Terrain(
        slope_deg=30.0, kind="profile", profile_m=((-9.0, 0.0), (1.0, 0.0), (2.0, 0.5), (9.0, 0.5))
    )
    rock = heights_around(profile, path)
    assert rock is not None
    x = rock.x0_m + rock.cell_m * np.arange(len(rock.values_m))
    assert rock.values_m[:, 3] == pytest.approx(np.interp(x, [1.0, 2.0], [0.0, 0.5]), abs=1e-9)
    ground = json.loads(animation(moving(100), 30.0, ROBOT, rock))["ground"]
    assert (
        len(ground["heights"]) == rock.values_m.size and ground["columns"] == rock.values_m.shape[1]
    )
    assert max(ground["heights"]) == 500


def test_a_machine_of_another_size_is_drawn_to_its_own_scale_and_without_what_it_lacks() -> None:
    small = Robot.of(build_machine(folder=machine_folder("quarter_model")))
    assert small.machine.scale.force == 0.012
    large, own = (json.loads(animation(moving(100), 30.0, robot)) for robot in (ROBOT, small))
    assert large["size"] == 1.0 and large["mast"] and arrows(ROBOT) == "100 mm is 2000 N"
    assert own["size"] == 0.23 and own["mast"] is None and arrows(small) == "23 mm is 24 N"
    assert own["frames"][0][24] == round(large["frames"][0][24] / 0.012)
