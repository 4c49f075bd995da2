"""Expected loads with what is known of the footing: measured under load, or known by its deviation
alone.

Three of the four loads' combinations are fixed by equilibrium; the fourth, an internal force that
loads one diagonal and unloads the other, by heights and compliances. A tenth of a millimetre
decides hundreds of newtons, so an encoder cannot tell it: then a load is an interval. Where the
feet's heights under load are known exactly (a survey, a simulator), it is a number.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from testbed.formats.arrays import Array
from testbed.formats.intervals import Z90
from testbed.machine.names import AXES, LEGS, VERTICAL
from testbed.robot.contact.geometry import FootLoads
from testbed.robot.loads.foot_loads import ExpectedLoads, Footing, internal_force_of

LEAST_SLOPE = 1e-9
"""Loss of load by push below which a foot never leaves, N/N."""

FRICTION_HOLD_N = 150.0
"""Standard deviation of what the cylinders' friction holds of the internal force (E; seen in thirty
simulated stands).
"""


def heights_under_load(
    expected: ExpectedLoads, positions: ArrayLike, normals: ArrayLike | None = None
) -> Array:
    """(4,) heights, m, at which flat ground meets feet whose joint positions (12) were measured
    under load.

    normals (4, 3): the ground's, in the body frame; default body z. Add the true heights of ground
    that is not flat.
    """
    up = (
        np.tile([0.0, 0.0, 1.0], (len(LEGS), 1))
        if normals is None
        else np.asarray(normals, dtype=float)
    )
    heights = -np.einsum("ij,ij->i", expected.model.foot_positions_m(positions), up)
    return np.asarray(heights - heights.mean())


def loads_of_measured_posture(
    expected: ExpectedLoads,
    positions: ArrayLike,
    gravity_in_body: ArrayLike,
    footing: Footing,
    **acts: Any,
) -> FootLoads:
    """Loads of a posture measured under load, heights of the footing given (heights_under_load).

    The joints' give is in their positions already, so only the ground gives. A further load changes
    the joints too: sensitivities and reserves are those of joints, oil and ground together, at
    these loads.
    """
    held = np.zeros(len(AXES))
    now = expected.solve(positions, gravity_in_body, footing=footing, joint_compliance=held, **acts)
    given = expected.oil.joint_compliance(positions)
    jacobians = expected.model.feet(positions)[1]
    give = np.array([jacobians[index, 2] ** 2 @ given for index in range(len(LEGS))])
    unloaded = replace(footing, heights_m=np.asarray(footing.heights_m) + give * now.normal_n)
    free = expected.solve(positions, gravity_in_body, footing=unloaded, **acts)
    slopes = np.where(free.reserve_n > 0.0, free.normal_n / free.reserve_n, 0.0)
    reserve = np.divide(
        now.normal_n, slopes, out=np.full(len(LEGS), np.inf), where=slopes > LEAST_SLOPE
    )
    return now._replace(
        load_per_height_n_m=free.load_per_height_n_m,
        load_per_wrench=free.load_per_wrench,
        reserve_n=reserve,
    )


def load_interval_n(
    expected: ExpectedLoads,
    positions: ArrayLike,
    gravity_in_body: ArrayLike,
    footing_deviation_m: float,
    **acts: Any,
) -> tuple[Array, Array]:
    """Ends (4,), (4,) of each foot's vertical load, N, between which it lies nine times in ten.

    The feet's height errors are independent and normal with the given deviation; only their part
    along the internal force matters, widened by what the cylinders' friction may hold of it.
    Lifting feet and sliding ones are reckoned with by solving at both ends.
    """
    internal = internal_force_of(expected.model.foot_positions_m(positions)[:, :2])
    given = acts.get("joint_compliance")
    joints = expected.oil.joint_compliance(positions) if given is None else np.asarray(given)
    held_m = FRICTION_HOLD_N * (joints[list(VERTICAL)].mean() + expected.ground_compliance_m_n)
    reach = Z90 * float(np.hypot(footing_deviation_m, held_m)) * internal
    ends = [
        expected.solve(
            positions, gravity_in_body, footing=Footing(heights_m=way * reach), **acts
        ).vertical_load_n
        for way in (-1.0, 1.0)
    ]
    return np.minimum(*ends), np.maximum(*ends)


def fixed_combinations(feet_xy: Array) -> Array:
    """(3, 4) orthonormal combinations of the loads on feet (4, 2) that equilibrium fixes."""
    return np.asarray(np.linalg.svd(np.vstack([np.ones(len(LEGS)), feet_xy.T]))[2][:3])
