"""What the drill and its rods do to the machine, as far as its own controls know it.

Controls order the feed and the torque, and count the rods: how many hang in the hole, how many
stand in the mast, how many are left in the store. A rod on its way from the store to the hole moves
its weight across the platform, and in the hole a part of that weight lies on the hole's wall.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from testbed.formats.arrays import Array
from testbed.robot.loads.foot_loads import drill_wrench, point_wrench
from testbed.robot.model import RobotModel


def rods_wrench(model: RobotModel, known: Any, gravity_in_body: ArrayLike) -> Array:
    """Weight of the rods on the machine (6,), body frame, beyond what the store carried at the
    start.

    `known`: a DrillKnown or a row with its fields; gravity (3,) m/s2. The string in the hole hangs
    on the feed by its part along the hole; what stands in the mast, and what the store gains or
    loses, acts with all its weight at its place.
    """
    gravity = np.asarray(gravity_in_body, dtype=float)
    in_hole, in_mast = float(known["rods_in_hole"]), float(known["rods_in_mast"])
    height, stored = float(known["rods_mast_height"]), float(known["rods_stored"])
    if in_hole == 0.0 and in_mast == 0.0 and stored == 0.0:
        return np.zeros(6)
    hanging = drill_wrench(model, in_hole * float(gravity[2]))
    standing = point_wrench(in_mast * gravity, model.drill_mount_m + np.array([0.0, 0.0, height]))
    return hanging + standing + point_wrench(stored * gravity, model.rod_store_m)


def known_wrench(model: RobotModel, known: Any, gravity_in_body: ArrayLike) -> Array:
    """Everything of the drill that controls know of (6,): `known` as in `rods_wrench`, gravity (3,)
    in the body frame.
    """
    ordered = drill_wrench(model, float(known["ordered_thrust"]), float(known["ordered_torque"]))
    return ordered + rods_wrench(model, known, gravity_in_body)
