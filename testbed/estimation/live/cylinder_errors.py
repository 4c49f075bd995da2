"""The errors of the cylinder forces: how the unknowns of the filter (fusion.py) add up to the error
of one force, and what the filter learns from whether a foot is in the air. Compiled.

Cylinders are numbered as in AXES (0 to 11), legs as in LEGS. `weights` (unknowns,) is the row of an
observation: the derivative of the observed force by every unknown of the filter.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from testbed.compiled import njit
from testbed.estimation.live import doubt, unknowns
from testbed.estimation.live.axis import AxisState
from testbed.estimation.live.fusion import observe
from testbed.estimation.live.reported_shares import share_of_constants, share_of_friction
from testbed.formats.arrays import Array
from testbed.formats.records import SET, Record, part, quantity
from testbed.machine.names import JOINTS, LEGS, ROTATION, VERTICAL
from testbed.recording.rows import DataRow

if TYPE_CHECKING:
    from testbed.estimation.live.body_records import BodyBelief, BodyState


UP = 2
"""Of a foot's force in the body frame: along z."""
HELD_BACK = 12
"""Balances by which what is learnt from a foot in the air can be taken back: 60 ms, within which
even soft ground is felt (E).
"""


class LegLearnt(Record):
    """The unknowns of the cylinders of a leg (fusion.Unknowns)."""

    zero = quantity("N", "of its sensors", per=JOINTS)
    out = quantity("N", "of its friction out", per=JOINTS)
    back = quantity("N", "of its friction in", per=JOINTS)
    side = quantity("1", "of its friction by the load across the rod", per=JOINTS)
    deviation = quantity("N", "of its friction beside that", per=JOINTS)


class LearntInAir(Record):
    """The unknowns of a leg in the air as they were before each of the last HELD_BACK balances: a
    ring buffer.
    """

    before = part(LegLearnt, "a balance", per=tuple(map(str, range(HELD_BACK))))
    count = quantity("1", "balances in the air so far")


@njit
def write_cylinder_weights(cylinder: int, weight: float, axis: AxisState, weights: Array) -> None:
    """Write into `weights` how the unknowns of a cylinder enter an observed force, of which the
    cylinder's force is the part `weight`.

    axis.use is the share of its friction that acts, positive extending and negative retracting.
    """
    weights[unknowns.ZERO + cylinder] = weights[unknowns.DEVIATION + cylinder] = weight
    weights[unknowns.OUT + cylinder] = weight * max(axis.use, 0.0)
    weights[unknowns.BACK + cylinder] = weight * min(axis.use, 0.0)
    weights[unknowns.SIDE + cylinder] = weight * axis.use * axis.across


@njit
def write_leg_weights(leg: int, by_cylinder: Array, state: BodyState, weights: Array) -> None:
    """Write the weights of a leg's three cylinders, whose forces enter with `by_cylinder` (3)."""
    for joint in range(len(JOINTS)):
        cylinder = ROTATION[leg] + joint
        write_cylinder_weights(cylinder, by_cylinder[joint], state.axes[cylinder], weights)


@njit
def force_error(cylinder: int, state: BodyState) -> float:
    """Estimated error of a cylinder's force, N: measured less true."""
    found, axis = state.fusion.x, state.axes[cylinder]
    friction = max(axis.use, 0.0) * found[unknowns.OUT + cylinder]
    friction += min(axis.use, 0.0) * found[unknowns.BACK + cylinder]
    friction += axis.use * axis.across * found[unknowns.SIDE + cylinder]
    return float(found[unknowns.ZERO + cylinder] + friction + found[unknowns.DEVIATION + cylinder])


@njit
def leg_variance(covariance: Array, weights: Array, leg: int) -> float:
    """Variance of an observed force due to the cylinders of one leg, N2."""
    groups, first = (
        (unknowns.ZERO, unknowns.OUT, unknowns.BACK, unknowns.SIDE, unknowns.DEVIATION),
        ROTATION[leg],
    )
    total = 0.0
    for group in groups:
        for one in range(group + first, group + first + len(JOINTS)):
            for other_group in groups:
                for other in range(other_group + first, other_group + first + len(JOINTS)):
                    total += weights[one] * covariance[one, other] * weights[other]
    return total


@njit
def reported_variance(leg: int, weights: Array, belief: BodyBelief, state: BodyState) -> float:
    """Variance to report for a foot force, N2: shares of the filter's variance by the machine's
    constants and by friction (reported_shares.py), larger ones where the balance is doubted, and
    the noise of the filtered load.
    """
    piston, ends = state.axes[VERTICAL[leg]], state.ranges[leg]
    friction = share_of_friction(piston, ends, belief.range_noise, belief.reported)
    share = doubt.reported_share(friction, state.doubt)
    variance = max(leg_variance(state.fusion.p, weights, leg), 0.0)
    fixed = min(max(leg_variance(state.fusion.fixed, weights, leg), 0.0), variance)
    known = doubt.reported_share(share_of_constants(piston, belief.reported), state.doubt)
    shared = known * known * fixed + share * share * (variance - fixed)
    return shared + belief.noise_sd * belief.noise_sd


@njit
def spread_variance(leg: int, weights: Array, belief: BodyBelief, state: BodyState) -> float:
    """Variance by which detectors of contact losses weigh a foot force, N2: one share of all that
    the filter does not know, constants and friction alike. It is `spread_share` of the belief, less
    while the leg has never slid, all of it where the balance is doubted.
    """
    stuck = state.axes[VERTICAL[leg]].has_slid == 0.0
    share = belief.spread_share * (belief.spread_stuck if stuck else 1.0)
    share = doubt.reported_share(share, state.doubt)
    variance = max(leg_variance(state.fusion.p, weights, leg), 0.0)
    return share * share * variance + belief.noise_sd * belief.noise_sd


# What contact says about the force on a foot: it is zero in the air; on the ground it pushes and
# never pulls.


@njit
def is_in_air(leg: int, row: DataRow, belief: BodyBelief, state: BodyState) -> bool:
    """Whether the foot of a leg is in the air now; counts for how long, s."""
    up = state.means.foot_force[leg, UP] - force_error(VERTICAL[leg], state)
    off = bool(row.carrying[leg] < SET and abs(up) < belief.air_load)
    dt = belief.every * belief.decisions.dt
    state.in_air[leg] = state.in_air[leg] + dt if off else 0.0
    return off


@njit
def learn_in_air(leg: int, map_: Array, belief: BodyBelief, state: BodyState) -> None:
    """Observe that the foot of a leg carries nothing, along three axes. map_ (3, 3): leg_map."""
    learnt, found = state.learnt_in_air[leg], state.fusion.x
    before = learnt.before[int(learnt.count) % HELD_BACK]
    learnt.count += 1.0
    for joint in range(len(JOINTS)):
        cylinder = ROTATION[leg] + joint
        before.zero[joint] = found[unknowns.ZERO + cylinder]
        before.out[joint] = found[unknowns.OUT + cylinder]
        before.back[joint] = found[unknowns.BACK + cylinder]
        before.side[joint] = found[unknowns.SIDE + cylinder]
        before.deviation[joint] = found[unknowns.DEVIATION + cylinder]
    weights = np.zeros(unknowns.COUNT)
    slides = state.axes[VERTICAL[leg]].slides >= 1.0
    for along in range(3):
        write_leg_weights(leg, map_[along], state, weights)
        force, learns = state.means.foot_force[leg, along], along == UP and slides
        observe(state.fusion, weights, force, belief.air_sd**2, belief.gate, learns)


@njit
def forget_touchdown(leg: int, state: BodyState) -> None:
    """Take back what the last HELD_BACK balances taught of a leg that is no longer in the air: its
    foot carried something before the touchdown was noticed, and that was taken for friction.
    """
    learnt, found = state.learnt_in_air[leg], state.fusion.x
    if learnt.count == 0.0:
        return
    oldest = int(learnt.count) % HELD_BACK if learnt.count > HELD_BACK else 0
    before = learnt.before[oldest]
    learnt.count = 0.0
    for joint in range(len(JOINTS)):
        cylinder = ROTATION[leg] + joint
        found[unknowns.ZERO + cylinder] = before.zero[joint]
        found[unknowns.OUT + cylinder] = before.out[joint]
        found[unknowns.BACK + cylinder] = before.back[joint]
        found[unknowns.SIDE + cylinder] = before.side[joint]
        found[unknowns.DEVIATION + cylinder] = before.deviation[joint]


@njit
def learn_no_pull(maps: Array, belief: BodyBelief, state: BodyState) -> None:
    """Observe that every foot that seems to pull carries nothing; maps (4, 3, 3): leg_map.

    Constants are not updated: such a foot only bounds them from below.
    """
    weights = np.zeros(unknowns.COUNT)
    for leg in range(len(LEGS)):
        force = state.means.foot_force[leg, UP]
        up = force
        for joint in range(len(JOINTS)):
            up -= maps[leg, UP, joint] * force_error(ROTATION[leg] + joint, state)
        if up < 0.0:
            weights[:] = 0.0
            write_leg_weights(leg, maps[leg, UP], state, weights)
            observe(state.fusion, weights, force, belief.air_sd**2, belief.gate, False)
