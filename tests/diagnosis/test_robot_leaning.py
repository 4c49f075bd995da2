"""The sense of friction at rest: what the encoders last did, forgotten as loads change."""

from __future__ import annotations

import numpy as np
import pytest

from testbed.diagnosis.robot.leaning import FORGOTTEN_BY, leaning_of, leans_hidden, leant
from testbed.machine.build import build_machine
from testbed.machine.names import AXES
from testbed.robot.robot import Robot

RADIAL = AXES.index("fl_radial")
ROTATION = AXES.index("fl_rotation")
ALL_KEPT = 1.0


def sense(steps: list[float], kept: float = ALL_KEPT) -> float:
    """Of friction after these steps, in counts."""
    rows = np.array(steps)[:, None]
    return float(leant(rows, np.full_like(rows, kept))[-1, 0])


def recorded(robot: Robot, moved: dict[int, float], pushed_n: float = 0.0) -> dict[str, np.ndarray]:
    """A second in which cylinders go by so many counts at 0.3 s, and all are loaded by so much more
    at 0.6 s.
    """
    time = np.arange(0.0, 1.0, 1e-3)
    data = {"t": time}
    for i, (name, axis) in enumerate(robot.machine.axes.items()):
        area = axis.cylinder.areas_m2[0]
        data[f"position_{name}"] = np.where(time < 0.3, 0.0, moved.get(i, 0.0) * axis.encoder_count)
        data[f"pressure_a_{name}"] = np.where(time < 0.6, 0.0, pushed_n / area)
        data[f"pressure_b_{name}"] = np.zeros(len(time))
    return data


def test_a_piston_that_has_not_moved_leans_nowhere() -> None:
    assert sense([0.0, 0.0]) == 0.0


def test_it_keeps_the_sense_of_its_last_count_and_one_back_may_have_turned_it_or_not() -> None:
    assert sense([1.0, 0.0, 0.0]) == 1.0
    assert sense([1.0, 1.0, -1.0]) == 0.0
    assert sense([1.0, -1.0, -1.0]) == -1.0


def test_what_a_changing_load_leaves_fades_with_the_change() -> None:
    assert sense([1.0, 0.0, 0.0], kept=0.5) == pytest.approx(0.25)


def test_a_recording_shows_it_of_linear_joints_alone() -> None:
    robot = Robot.of(build_machine())
    leans = leaning_of(recorded(robot, {RADIAL: -1.0, ROTATION: -1.0}), 1e-3, robot)
    assert all(len(lean) == 1000 for lean in leans)
    assert leans[RADIAL][200] == 0.0
    assert leans[RADIAL][-1] == pytest.approx(-1.0)
    assert not np.any(leans[ROTATION])


def test_play_hides_it_at_the_four_rotation_joints() -> None:
    hidden = [axis for axis, is_hidden in zip(AXES, leans_hidden(), strict=True) if is_hidden]
    assert len(hidden) == 4 and all("rotation" in axis for axis in hidden)


def test_a_load_that_changes_by_so_many_times_dry_friction_leaves_its_part() -> None:
    robot = Robot.of(build_machine())
    cylinder = robot.machine.axes["fl_radial"].cylinder
    dry_n = cylinder.coulomb_out_n + cylinder.static_out_n
    leans = leaning_of(recorded(robot, {RADIAL: 1.0}, FORGOTTEN_BY * dry_n), 1e-3, robot)
    assert leans[RADIAL][500] == pytest.approx(1.0)
    assert leans[RADIAL][-1] == pytest.approx(np.exp(-1.0))
