"""One array that holds everything a run steps, with a named view for each part.

A compiled call pays for every array it is handed; on one board they come as one. A copy of the board is a snapshot of
the world outside the engine.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.control.valve_loop import GAIN_COLUMNS
from testbed.formats.records import size
from testbed.laws import columns as c
from testbed.laws import drill as d
from testbed.robot.loads.foot_forces import LegNumbers
from testbed.world import plant, sensing

Array = NDArray[np.float64]

LAYOUT: dict[str, tuple[int, ...]] = {
    # read from the engine in one go: joints, their rates, base (centre of mass, quaternion of its principal axes)
    "q": (12,),
    "qd": (12,),
    "pose": (7,),
    # the body's motion: the base's centre of mass, the body frame's quaternion xyzw, linear and angular velocity
    "base": (13,),
    "base_turn": (4,),
    # joints and their rates before the last engine step
    "q_before": (12,),
    "qd_before": (12,),
    "foot_force": (4, 3),
    "normal_force": (4,),
    "legs": (4, size(LegNumbers)),
    "ground_normals": (4, 3),
    # given to the engine
    "joint_torque": (12,),
    "force": (3,),
    "torque": (3,),
    # the plant
    "axes": (12, c.AXIS_STATES),
    "params": (12, c.AXIS_PARAMETERS),
    "supply": (c.SUPPLY_STATES,),
    "unit": (c.SUPPLY_PARAMETERS,),
    "geometry": (4,),
    "ropes": (2, plant.ROPE_COLUMNS),
    "body": (plant.BODY_COLUMNS,),
    "drill_loads": (d.DRILL_COLUMNS,),
    "drill_wrench": (6,),
    "scratch": (5, 12),
    "rotation": (3, 3),
    # sensors
    "transducers": (24, sensing.PRESSURE_COLUMNS),
    "sensors": (sensing.COMMON_COLUMNS,),
    "late": (24, sensing.DELAY_LENGTH),
    "gravity_in_body": (3,),
    # valve loops
    "command": (12,),
    "reference": (12,),
    "reference_rate": (12,),
    "integral": (12,),
    "gains": (12, GAIN_COLUMNS),
    # the base's centre of mass: acceleration less gravity, and angular acceleration, both in the world frame
    "change": (6,),
}


def _offsets() -> tuple[dict[str, int], int]:
    start, out = 0, {}
    for name, shape in LAYOUT.items():
        out[name] = start
        start += int(np.prod(shape))
    return out, start


OFFSETS, SIZE = _offsets()


class Board:
    """The array and its views. `board.q`, `board.axes`, ... share memory with `board.array`."""

    q: Array
    qd: Array
    pose: Array
    base: Array
    base_turn: Array
    q_before: Array
    qd_before: Array
    foot_force: Array
    normal_force: Array
    legs: Array
    ground_normals: Array
    joint_torque: Array
    force: Array
    torque: Array
    axes: Array
    params: Array
    supply: Array
    unit: Array
    geometry: Array
    ropes: Array
    body: Array
    drill_loads: Array
    drill_wrench: Array
    scratch: Array
    rotation: Array
    transducers: Array
    sensors: Array
    late: Array
    gravity_in_body: Array
    command: Array
    reference: Array
    reference_rate: Array
    integral: Array
    gains: Array
    change: Array

    def __init__(self) -> None:
        self.array: Array = np.zeros(SIZE)
        for name, shape in LAYOUT.items():
            start = OFFSETS[name]
            setattr(self, name, self.array[start : start + int(np.prod(shape))].reshape(shape))
        self.engine_state = self.array[: OFFSETS["base"]]
        """q, qd and pose in one stretch, as the engine fills them."""
        self.given = self.array[OFFSETS["joint_torque"] : OFFSETS["axes"]]
        """Joint torques, force and torque on the base in one stretch, as the engine takes them."""
