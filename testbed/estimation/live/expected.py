"""Expected foot loads, live: posture from the encoders, attitude, rope tensions and what the
drill's controls know.
"""

from __future__ import annotations

import numpy as np

from testbed.formats.arrays import Array
from testbed.formats.records import SET
from testbed.robot.loads.foot_loads import ExpectedLoads, Footing, known_wrench
from testbed.robot.model import rotation_from_attitude


class Expectation:
    """The believed machine's foot loads along the vertical joints, N (4), from measurements alone.

    `rope_directions_in_world` (2, 3): unit vectors from the traction devices to the anchors, as
    surveyed at the start (a 30 m rope turns by less than 2 degrees a metre climbed).
    """

    def __init__(self, loads: ExpectedLoads, rope_directions_in_world: Array) -> None:
        self._loads = loads
        self.rope_directions_in_world = rope_directions_in_world
        self._rope_forces = np.zeros((2, 3))

    def loads(
        self,
        position: Array,
        gravity_in_body: Array,
        tension_n: Array,
        attitude_rad: Array,
        drill: Array,
        standing: Array,
    ) -> Array:
        """Loads (4), N: position (12), gravity (3) in body, tensions (2), roll pitch yaw (3), drill
        (KNOWN).

        `standing` (4): 1 for a foot that is meant to carry, 0 for one in the air.
        """
        rotation = rotation_from_attitude(attitude_rad)
        self._rope_forces[:] = tension_n[:, None] * (self.rope_directions_in_world @ rotation)
        found = self._loads.solve(
            position,
            gravity_in_body,
            rope_forces_in_body=self._rope_forces,
            drill_wrench_in_body=known_wrench(self._loads.model, drill, gravity_in_body),
            footing=Footing(in_contact=standing > SET),
        )
        return np.asarray(found.vertical_load_n)
