"""A film of a recorded run: the robot put where its recording has it, seen by the engine's
camera.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from testbed.errors import InputError
from testbed.machine.names import AXES, SIDES
from testbed.simulation.metrics import rope_tension_n
from testbed.simulation.runs import RecordedRun, read_run, run_scenario_of
from testbed.simulation.video import SIZE, Video

Tell = Callable[[str], None]


def film(folder: Path, path: Path, tell: Tell | None = None) -> Path:
    """Film a run into a .mp4, .gif or .webp, in simulated time; returns the file.

    `tell("3 of 120 pictures")`. Raises InputError where there is no readable run, or no film can be
    made.
    """
    from testbed.world.scene import pose, set_shown
    from testbed.world.simulation import Simulation

    video = Video(path)
    run, scenario = read_run(folder), run_scenario_of(folder)
    if scenario is None:
        raise InputError("holds no scenario.yaml: where would it be filmed?", file=folder)
    rows = picture_rows(run, video.rate_hz)
    last_pulled = [_last_row(rope_tension_n(run.truth, side) > 0.0) for side in SIDES]
    simulation = Simulation(scenario)
    try:
        machine = simulation.machine
        for number, row in enumerate(rows):
            origin, quaternion, joints = _pose(run, int(row))
            pose(machine, origin, quaternion, joints)
            depth_m = float(run.truth["hole_depth"][row]) if "hole_depth" in run.truth else 0.0
            set_shown(machine, [bool(row <= last) for last in last_pulled], depth_m)
            video.add(machine.picture(*SIZE))
            if tell is not None:
                tell(f"{number + 1} of {len(rows)} pictures")
    finally:
        simulation.close()
    video.write()
    return video.path


def picture_rows(run: RecordedRun, rate_hz: float) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Rows of a recording that are nearest to `rate_hz` pictures a simulated second."""
    times = run.truth["t"]
    wanted = np.arange(times[0], times[-1] + 0.5 / rate_hz, 1.0 / rate_hz)
    return np.unique(np.searchsorted(times, wanted).clip(max=len(times) - 1))


def _pose(run: RecordedRun, row: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The body's origin (3) m and quaternion xyzw in the world, and the joints (12), rad and m."""
    origin, quaternion = (
        np.array([run.truth[f"body_pose_in_world_{name}"][row] for name in names])
        for names in ("xyz", ("qx", "qy", "qz", "qw"))
    )
    return origin, quaternion, np.array([run.data[f"position_{axis}"][row] for axis in AXES])


def _last_row(flags: np.ndarray) -> int:
    """Last row that is true, -1 where none is: a rope that never pulls again is gone."""
    found = np.flatnonzero(flags)
    return int(found[-1]) if found.size else -1
