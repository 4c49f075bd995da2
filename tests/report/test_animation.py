"""The moving wireframe: frames as the recording has them, few enough, in the slope's frame."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from shipped import MACHINE

from testbed.machine.names import AXES, LEGS, SIDES
from testbed.report.animation import MOST_FRAMES, animation

SLOPE = math.radians(30.0)
Columns = dict[str, np.ndarray]


def climbing(rows: int) -> tuple[Columns, Columns]:
    """A body that lies parallel to 30 degrees and climbs a metre; 10 kN on each foot along the slope's normal."""
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
        truth |= {
            f"foot_force_in_world_{leg}_{k}": 0 * t + v for k, v in zip("xyz", normal, strict=True)
        }
    for side in SIDES:
        truth |= {f"rope_force_in_world_{side}_{k}": 0 * t for k in "xyz"}
    truth |= {f"drill_wrench_in_world_{k}": 0 * t for k in ("fx", "fy", "fz", "tx", "ty", "tz")}
    return data, truth


def test_the_body_climbs_along_x_its_feet_follow_and_their_forces_point_off_the_slope() -> None:
    text = animation(*climbing(1000), 30.0, MACHINE)
    assert text is not None
    frames = json.loads(text)["frames"]
    first, last = frames[0], frames[-1]
    assert len(frames) == 100 and len(first) == 42
    assert last[1] - first[1] == pytest.approx(1000 * 990 / 999, abs=2) and last[3] == 0
    assert first[4:10] == [1000, 0, 0, 0, 0, 1000]
    assert last[10] - first[10] == last[1] - first[1]
    assert first[22:25] == [0, 0, 1000]
    assert json.loads(text)["ground"] == first[12]


def test_a_long_run_keeps_to_the_frames_that_a_page_can_carry() -> None:
    text = animation(*climbing(60_000), 30.0, MACHINE)
    assert text is not None and len(json.loads(text)["frames"]) <= MOST_FRAMES


def test_a_recording_without_poses_has_no_animation() -> None:
    data, truth = climbing(50)
    del truth["body_pose_in_world_x"]
    assert animation(data, truth, 30.0, MACHINE) is None
