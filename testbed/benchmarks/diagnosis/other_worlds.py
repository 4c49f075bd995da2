"""Worlds of other laws: a simulated recording as another machine would have made it, whose seals,
sensors, pump and ropes follow laws that the simulator does not have.

The motion stays, and the columns change: right where valves hold positions and all is slow. What a
piston draws in oil beside, and what a load-sensing pump makes of another pressure, is left out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from testbed.benchmarks.diagnosis import other_friction, other_sensors
from testbed.benchmarks.diagnosis.robot_recordings import Run
from testbed.errors import check_one_of
from testbed.formats.arrays import Array
from testbed.machine.build import build_machine
from testbed.machine.names import SIDES
from testbed.robot.robot import Robot

SAG = "catenary"
"""Ropes that sag by their own weight: they lead less steeply than to their anchors."""
FRICTION = tuple(other_friction.LAWS)
SENSORS = ("coloured_noise", "coarse_counts", "hysteresis", "hum", "uneven_clock", "other_filter")
BESIDE = ("encoders", "ripple", "rope_friction", SAG)
FAMILIES = (*FRICTION, *SENSORS, *BESIDE)
KG_M = (0.4, 0.9)
"""Of wire ropes of 12 to 16 mm (D)."""
GRAVITY_M_S2 = 9.81
CHANCE = 0.4
"""How often a world has each of BESIDE."""


@dataclass(frozen=True)
class OtherWorld:
    """Which laws a world has. `families`: each of them; none: drawn anew for each machine.
    `size`: times what a workshop leaves; at 0 the recording stays as it is.
    """

    families: tuple[str, ...] = ()
    size: float = 1.0

    def __post_init__(self) -> None:
        for family in self.families:
            check_one_of(family, FAMILIES, "--family", "no such family of laws")

    def of_machine(self, seed: int) -> tuple[str, ...]:
        """The laws of a machine's world: one or two of friction, two of sensors, some beside."""
        if self.families:
            return self.families
        rng = np.random.default_rng([seed, 61])
        rubs = rng.choice(FRICTION, rng.integers(1, 3), replace=False)
        reads = rng.choice(SENSORS, 2, replace=False)
        beside = [family for family in BESIDE if rng.random() < CHANCE]
        chosen = {*rubs.tolist(), *reads.tolist(), *beside}
        return tuple(family for family in FAMILIES if family in chosen)

    def recorded(self, run: Run, seed: int, recording: int = 0) -> Run:
        """A simulated run of the machine of this seed as it would be in its world; `recording`: of
        the same machine another one, whose noise is another.
        """
        for family in self.of_machine(seed):
            run = _with(family, run, self.size, (seed, recording))
        return run


def _with(family: str, run: Run, size: float, seeds: tuple[int, int]) -> Run:
    """A run with one law more; `seeds`: of the machine and of the recording."""
    index = FAMILIES.index(family)
    own = np.random.default_rng([seeds[0], 67, index])
    if family == SAG:
        return replace(run, surveyed=_sagging(run, size, own))
    robot = _robot(run)
    if family in FRICTION:
        changes = other_friction.change_of(family, run.data, robot, own, size)
    else:
        passing = np.random.default_rng([seeds[0], 71, index, seeds[1]])
        recorded = other_sensors.Recorded(run.data, robot, own, passing, size)
        changes = other_sensors.change_of(family, recorded)
    return replace(run, data=_changed(run.data, changes, robot))


def _robot(run: Run) -> Robot:
    from testbed.workflows.estimate import survey_of

    return survey_of(run.surveyed, Path("run")).robot(build_machine())


def _changed(
    data: Mapping[str, Array], changes: Mapping[str, Array], robot: Robot
) -> dict[str, Array]:
    """The columns with these changes; pressures stay within their range, and where
    they had ended at an end of it they stay there.
    """
    out, most = dict(data), robot.machine.sensor.pressure_range_pa
    for name, change in changes.items():
        read = data[name]
        made = read + change
        if name in other_sensors.PRESSURES:
            ended = (read <= 0.0) | (read >= most)
            made = np.where(ended, read, np.clip(made, 0.0, most))
        out[name] = made
    return out


def _sagging(run: Run, size: float, rng: np.random.Generator) -> Any:
    """What is surveyed where ropes sag: anchors that lie above where the ropes lead. A rope of
    weight w per metre leads w cos(elevation) L / (2 T) below its chord.
    """
    weight_n_m = GRAVITY_M_S2 * rng.uniform(*KG_M)
    found = {}
    for side in SIDES:
        to_anchor = np.asarray(run.surveyed["rope_directions_in_world"][side], dtype=float)
        way = to_anchor / np.linalg.norm(to_anchor)
        level = float(np.hypot(way[0], way[1]))
        pull_n = float(np.median(run.data[f"rope_tension_{side}"]))
        length_m = float(run.surveyed["rope_lengths_m"][side])
        below = size * weight_n_m * level * length_m / (2.0 * max(pull_n, 1.0))
        up = np.array([-way[0] * way[2] / level, -way[1] * way[2] / level, level])
        found[side] = (to_anchor + np.tan(below) * up).tolist()
    return {**run.surveyed, "rope_directions_in_world": found}
