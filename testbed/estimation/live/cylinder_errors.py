"""The errors of the cylinders' forces as the filter of fusion.py estimates them: how its unknowns
add up to the error of one force, and what a foot's contact tells of them. Compiled.

A cylinder goes by its place in AXES (0 to 11), a leg by its place in LEGS. `weights` (fusion.N) is
the row of an observation: how much of every unknown is in the force that is seen, N.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.compiled import njit
from testbed.estimation.live import doubt
from testbed.estimation.live import fusion as fu
from testbed.formats.records import SET
from testbed.machine.names import JOINTS, LEGS, ROTATION, VERTICAL

UP = 2
"""Of a foot's force in the body frame: along z."""


@njit
def weigh_cylinder(cylinder: int, weight: float, axis: Any, weights: Any) -> None:
    """How the unknowns of a cylinder, by `weight`, make up a force that is seen: into `weights`.

    axis: its AxisState, whose `use` says how much of either side's friction is in its force.
    """
    weights[fu.ZERO + cylinder] = weights[fu.DEVIATION + cylinder] = weight
    weights[fu.OUT + cylinder] = weight * max(axis.use, 0.0)
    weights[fu.BACK + cylinder] = weight * min(axis.use, 0.0)
    weights[fu.SIDE + cylinder] = weight * axis.use * axis.across


@njit
def weigh_leg(leg: int, by_cylinder: Any, state: Any, weights: Any) -> None:
    """The same of a leg whose three cylinders' forces weigh `by_cylinder` (3)."""
    for joint in range(len(JOINTS)):
        cylinder = ROTATION[leg] + joint
        weigh_cylinder(cylinder, by_cylinder[joint], state.axes[cylinder], weights)


@njit
def force_error(cylinder: int, state: Any) -> float:
    """Estimated error of a cylinder's force, N: measured less true."""
    found, axis = state.fusion.x, state.axes[cylinder]
    friction = max(axis.use, 0.0) * found[fu.OUT + cylinder]
    friction += min(axis.use, 0.0) * found[fu.BACK + cylinder]
    friction += axis.use * axis.across * found[fu.SIDE + cylinder]
    return float(found[fu.ZERO + cylinder] + friction + found[fu.DEVIATION + cylinder])


@njit
def leg_variance(covariance: Any, weights: Any, leg: int) -> float:
    """Variance of what an observation's `weights` make of a leg's cylinders, N2."""
    groups, first = (fu.ZERO, fu.OUT, fu.BACK, fu.SIDE, fu.DEVIATION), ROTATION[leg]
    total = 0.0
    for group in groups:
        for one in range(group + first, group + first + len(JOINTS)):
            for other_group in groups:
                for other in range(other_group + first, other_group + first + len(JOINTS)):
                    total += weights[one] * covariance[one, other] * weights[other]
    return total


@njit
def told_variance(leg: int, weights: Any, body: Any, state: Any) -> float:
    """Of a leg's force that `weights` observe, N2: as much of the filter's variance as is told (all
    of it where the balance is doubted), and the noise of a filtered load.
    """
    share = body.told_share
    if state.axes[VERTICAL[leg]].has_slid == 0.0:
        share *= body.stuck_told
    share = doubt.told_share(share, state.doubt)
    variance = max(leg_variance(state.fusion.p, weights, leg), 0.0)
    return float(share * share * variance + body.noise_sd * body.noise_sd)


# What contact tells of a foot's force: in the air it is nothing, on the ground it pushes and does
# not pull.


@njit
def is_in_air(leg: int, row: Any, body: Any, state: Any) -> bool:
    """Whether a leg's foot is in the air by now; counts for how long."""
    up = state.means.foot_force[leg, UP] - force_error(VERTICAL[leg], state)
    off = bool(row.carrying[leg] < SET and abs(up) < body.air_load)
    dt = body.every * body.decisions.dt
    state.in_air[leg] = state.in_air[leg] + dt if off else 0.0
    return off


@njit
def learn_in_air(leg: int, map_: Any, body: Any, state: Any) -> None:
    """Three observations: a leg's foot carries nothing. map_ (3, 3): leg_map."""
    weights = np.zeros(fu.N)
    slides = state.axes[VERTICAL[leg]].slides >= 1.0
    for way in range(3):
        weigh_leg(leg, map_[way], state, weights)
        force, learns = state.means.foot_force[leg, way], way == UP and slides
        fu.observe(state.fusion, weights, force, body.air_sd**2, body.gate, learns)


@njit
def learn_no_pull(maps: Any, body: Any, state: Any) -> None:
    """One observation of every foot that seems to pull: it carries nothing; maps (4, 3, 3):
    leg_map. Constants learn nothing from it: it is known of them only that they were too small.
    """
    weights = np.zeros(fu.N)
    for leg in range(len(LEGS)):
        force = state.means.foot_force[leg, UP]
        up = force
        for joint in range(len(JOINTS)):
            up -= maps[leg, UP, joint] * force_error(ROTATION[leg] + joint, state)
        if up < 0.0:
            weights[:] = 0.0
            weigh_leg(leg, maps[leg, UP], state, weights)
            fu.observe(state.fusion, weights, force, body.air_sd**2, body.gate, False)
