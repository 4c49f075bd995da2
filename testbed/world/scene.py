"""Pictures of a machine on its slope, with what the engine does not know: ropes, rod, sky."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from testbed.formats.arrays import Array
from testbed.machine.urdf_check import lacking
from testbed.world import plant

if TYPE_CHECKING:
    from testbed.world.assembly import Assembled

ROPE_COLOUR = (0.15, 0.15, 0.17, 1.0)
ROPE_RADIUS_M = 0.03
"""Thicker than the rope: the renderer drops what is thinner than a pixel."""
ROD_COLOUR = (0.62, 0.64, 0.67, 1.0)


def picture(machine: Assembled, width: int, height: int) -> NDArray[np.uint8]:
    """(height, width, 3): the robot from the lower left, looking up the slope."""
    m, b, engine = machine, machine.board, machine.engine
    plant.rotation_matrix(b.body.quaternion, b.rotation)
    origin = m.origin_in_world()
    lines = []
    for rope in b.ropes:
        if rope.whole:
            start = origin + b.rotation @ rope.attachment
            lines.append(
                engine.view.add_line(start, rope.anchor.copy(), ROPE_RADIUS_M, ROPE_COLOUR)
            )
    if "drill_mast" not in lacking(m.belief.machine.urdf):
        top = origin + b.rotation @ b.drill_point
        foot = top - b.rotation[:, 2] * (0.35 + b.drill.depth)
        lines.append(engine.view.add_line(top, foot, 0.038, ROD_COLOUR))
    try:
        slope = m.belief.machine.scale.length * m.ground.rotation_slope_to_world
        target = origin + slope @ np.array([0.15, 0.0, 0.45])
        away = slope @ np.array([-3.0, 5.3, 3.4])
        return engine.view.picture((target + away).tolist(), target.tolist(), width, height)
    finally:
        for line in lines:
            engine.view.remove(line)


def pose(machine: Assembled, origin_m: Array, quaternion: Array, joints: Array) -> None:
    """Put the robot where a recording has it: the body's origin (3) and quaternion xyzw in the
    world, joints (12).
    """
    body, engine = machine.board.body, machine.engine
    for index in range(4):
        body.quaternion[index] = quaternion[index]
    plant.rotation_matrix(body.quaternion, machine.board.rotation)
    rotation = np.array(machine.board.rotation)
    centre = origin_m + rotation @ np.array(machine.board.base_centre)
    for index in range(3):
        body.position[index] = centre[index]
    engine.reset(origin_m, rotation, joints)


def show(machine: Assembled, boards: NDArray[Any]) -> None:
    """Put the robot, its ropes and its drill as the boards have them."""
    machine.boards[:] = boards
    plant.rotation_matrix(machine.board.body.quaternion, machine.board.rotation)
    joints = boards["engine"]["joint"][0]
    machine.engine.reset(machine.origin_in_world(), machine.boards["rotation"][0], joints)


def set_shown(machine: Assembled, ropes_whole: Sequence[bool], hole_depth_m: float) -> None:
    """Which ropes (left, right) a picture shows, and how deep the rod is in the ground."""
    for rope, whole in zip(machine.board.ropes, ropes_whole, strict=True):
        rope.whole = whole
    machine.board.drill.depth = hole_depth_m
