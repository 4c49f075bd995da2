"""The whole-body estimate, live and compiled: from the cylinders' forces to the feet and the body.

Every step (1 kHz), axis.py estimates the force of each cylinder, and the equations of motion of the
leg (robot/loads/foot_forces.py: linkage, weight and inertia of the frames) turn the forces of its
three cylinders into the force of the ground on its foot. Every `body.every` steps, fusion.py
updates the estimated errors of the cylinder forces from the balance of the whole body. Foot forces
are those of the ground on the foot, body frame, N.
"""

from __future__ import annotations

import math

import numpy as np

from testbed.compiled import njit
from testbed.estimation.filters import persistent
from testbed.estimation.live import doubt, faulty_sensor, unknowns
from testbed.estimation.live.axis import Loads, step_axis
from testbed.estimation.live.belly_support import something_else_carries
from testbed.estimation.live.body_acceleration import add_fast_changes
from testbed.estimation.live.body_records import BodyBelief, BodyState
from testbed.estimation.live.body_stirred import moving_variance, stir
from testbed.estimation.live.body_wrench import write_body_wrench
from testbed.estimation.live.cylinder_errors import (
    UP,
    force_error,
    forget_touchdown,
    is_in_air,
    learn_in_air,
    learn_no_pull,
    reported_variance,
    spread_variance,
    write_cylinder_weights,
    write_leg_weights,
)
from testbed.estimation.live.fusion import observe, predict, start, stay_in_sets
from testbed.estimation.live.reported_shares import follow_force, just_begun
from testbed.estimation.live.surprise import NONE as NO_SURPRISE
from testbed.estimation.live.surprise import follow_surprise, widening
from testbed.estimation.live.wrench import (
    DOWN,
    MOMENT,
    OUT,
    X,
    Y,
    Z,
    add_force,
    foot_point,
    gravity_in_body,
    leg_map,
    of_leg,
)
from testbed.formats.arrays import Array
from testbed.formats.intervals import Z90
from testbed.machine.names import AXES, JOINTS, LEGS, ROTATION, SIDES, VERTICAL
from testbed.recording.rows import DataRow, Interval
from testbed.robot.linkage import joint_to_cylinder
from testbed.robot.loads.foot_forces import foot_forces
from testbed.robot.model import write_rotation
from testbed.robot.rope_bearings import follow

LEVEL_SHARE = 0.15
"""Weight of a new sample in the low-pass filter of the forces along x and y, 1."""
UNSTEADY = 0.7
"""Share of the change of the body's inertial force since the last balance that counts as the
standard deviation of this one (E).
"""


@njit
def update_sizes(row: DataRow, belief: BodyBelief, state: BodyState) -> None:
    """Fill fusion.sizes: how far the unknowns of the filter may have moved since the last balance,
    from the means over that time.
    """
    sizes, means, dt = state.fusion.sizes, state.means, belief.every * belief.decisions.dt
    warm = row.oil_temperature - belief.calibrated_at
    sizes.dt = dt
    suspicion = state.fusion.suspicion
    suspicion.memory, suspicion.threshold = belief.blame_memory, belief.blame_threshold
    sizes.balance_keep = math.exp(-dt / belief.balance_keep)
    for index in range(len(AXES)):
        axis, thermal_sd = state.axes[index], belief.axes[index].thermal_sd
        keep_s = belief.sliding_keep if axis.slides >= 1.0 else belief.rest_keep
        sizes.keep[index] = 0.0 if axis.changed != 0.0 else math.exp(-dt / keep_s)
        axis.changed = 0.0
        sizes.spread[index] = axis.spread
        variance = belief.known[unknowns.ZERO + index] ** 2 + (thermal_sd * warm) ** 2
        sizes.zero_sd[index] = math.sqrt(variance)
        sizes.zero_grown[index] = (
            max(variance - state.zero_variance[index], 0.0) + belief.zero_wander * dt
        )
        state.zero_variance[index] = max(variance, state.zero_variance[index])
        margin = 2.0 * axis.spread if axis.slides > 0.0 else 0.0
        margin += belief.set_margin * (axis.high - axis.low)
        sizes.low[index] = axis.low - axis.friction - margin
        sizes.high[index] = axis.high - axis.friction + margin
    for leg in range(len(LEGS)):
        rested = state.axes[VERTICAL[leg]].rested
        sizes.alike[leg] = belief.alike * (1.0 - math.exp(-rested / belief.alike_after))
    for equation in range(len(unknowns.WRENCH)):
        sizes.balance_sd[equation] = belief.balance_sd[equation]
    sizes.balance_sd[UP] += belief.drill_share * abs(row.ordered_thrust)
    for along in range(MOMENT):
        sizes.balance_sd[along] += belief.rope_share * (
            means.rope_tension[0] + means.rope_tension[1]
        )
    doubt.widen_balance(sizes, state.doubt)


@njit
def take_means(belief: BodyBelief, state: BodyState) -> Array:
    """Turn the sums since the last balance into means, and clear the sums.

    Returns the body's angular acceleration (3), rad/s2. Also sets `sizes.news` of every vertical
    piston at rest, from the change of its mean force, and `state.unsteady`, N.
    """
    sums, means, sizes, count = state.sums, state.means, state.fusion.sizes, state.count
    angular_acceleration, started = np.zeros(3), state.started != 0.0
    dt = belief.every * belief.decisions.dt
    change = 0.0
    for index in range(3):
        rate = sums.angular_rate[index] / count
        angular_acceleration[index] = (rate - means.angular_rate[index]) / dt if started else 0.0
        means.angular_rate[index] = rate
        felt = sums.specific_force[index] / count
        change += (felt - means.specific_force[index]) ** 2
        means.specific_force[index] = felt
    stir(means.specific_force, dt, state.stirred)
    for index in range(3):
        sums.angular_rate[index] = sums.specific_force[index] = 0.0
    state.unsteady = belief.weight / belief.gravity * math.sqrt(change)
    for rope in range(len(SIDES)):
        tension = sums.rope_tension[rope] / count
        means.rope_tension[rope] = (tension - belief.pin_zero[rope]) / belief.pin_gain[rope]
        sums.rope_tension[rope] = 0.0
    for leg in range(len(LEGS)):
        for axis in range(3):
            means.foot_force[leg, axis] = sums.foot_force[leg, axis] / count
            sums.foot_force[leg, axis] = 0.0
        piston = VERTICAL[leg]
        force, slides = sums.cylinder_force[piston] / count, state.axes[piston].slides
        follow_force(force, slides, state.ranges[leg])
        sizes.news[piston] = 0.0
        if slides < 1.0 and started:
            change = abs(force - means.cylinder_force[piston])
            sizes.news[piston] = (belief.news_share * max(change - belief.news_noise, 0.0)) ** 2
    for index in range(len(AXES)):
        means.cylinder_force[index] = sums.cylinder_force[index] / count
        sums.cylinder_force[index] = 0.0
    state.count = 0.0
    return angular_acceleration


@njit
def balance(row: DataRow, arms: Array, belief: BodyBelief, state: BodyState) -> None:
    """One step of the filter: the errors of the cylinder forces, from the means since the last one.

    arms (12): the rod's way by the joint's, m/rad for rotations and 1 otherwise.
    """
    first, fusion = state.started == 0.0, state.fusion
    if first:
        state.doubt = doubt.NONE
    angular_acceleration = take_means(belief, state)
    update_sizes(row, belief, state)
    if first:
        start(fusion, belief.known)
        state.started = 1.0
    else:
        predict(fusion)
    maps, on_ground = np.zeros((4, 3, 3)), np.ones(4)
    for leg in range(len(LEGS)):
        leg_map(belief.legs[leg], of_leg(row.position, leg), of_leg(arms, leg), maps[leg])
        if is_in_air(leg, row, belief, state):
            on_ground[leg] = 0.0
            if state.in_air[leg] >= belief.air_dwell and belief.learns_in_air != 0.0:
                learn_in_air(leg, maps[leg], belief, state)
        else:
            forget_touchdown(leg, state)
    if belief.balances != 0.0:
        follow_ropes(row, on_ground, belief, state)
        balance_body(row, angular_acceleration, maps, on_ground, belief, state)
    if belief.only_pushes != 0.0:
        learn_no_pull(maps, belief, state)
    stay_in_sets(fusion)
    if belief.balances != 0.0:
        cost, believable = doubt.cost_of_balance(fusion), doubt.believable_cost(state.axes, belief)
        state.doubt = doubt.followed(state.doubt, cost, believable, belief)
        follow_surprise(fusion, belief.surprise, state.surprise)
    weights = np.zeros(unknowns.COUNT)
    for leg in range(len(LEGS)):
        for axis in range(3):
            write_leg_weights(leg, maps[leg, axis], state, weights)
            state.force_sd[leg, axis] = math.sqrt(reported_variance(leg, weights, belief, state))
        state.spread[leg] = math.sqrt(spread_variance(leg, weights, belief, state))


@njit
def follow_ropes(row: DataRow, on_ground: Array, belief: BodyBelief, state: BodyState) -> None:
    """Bring the ropes' directions up to date; on_ground (4): feet that are not in the air.

    Feet that carry nothing do not say how the body goes: they may hang, or feel for the ground.
    """
    attitude, rotation = np.empty(3), np.empty((3, 3))
    for axis in range(3):
        attitude[axis] = row.attitude[axis]
    attitude[0] -= belief.unit_roll
    attitude[1] -= belief.unit_pitch
    write_rotation(attitude, rotation)
    point, feet, stands = np.empty(3), np.zeros((4, 3)), np.zeros(4)
    for leg in range(len(LEGS)):
        up = state.means.foot_force[leg, UP] - force_error(VERTICAL[leg], state)
        stands[leg] = 1.0 if on_ground[leg] != 0.0 and up > belief.air_load else 0.0
        foot_point(belief.legs[leg], of_leg(row.position, leg), belief.foot_height[leg], point)
        for axis in range(3):
            for j in range(3):
                feet[leg, axis] += rotation[axis, j] * point[j]
    follow(belief.rope_direction, belief.rope_distance, feet, stands, state.ropes)


@njit
def balance_body(
    row: DataRow,
    angular_acceleration: Array,
    maps: Array,
    on_ground: Array,
    belief: BodyBelief,
    state: BodyState,
) -> None:
    """Observe the body's six equations: the wrenches of the feet that carry, of weight, ropes and
    drill sum to zero, but for the error of the balance itself.

    Constants (zeros, masses, rope directions) are learnt only from the equations that the vertical
    cylinders dominate, and only while these slide and the drill does not push: at rest, friction
    may hide as much as there is to learn. The variance of these equations grows with the change of
    the body's acceleration, since seals, encoders and pressures respond to the start of a motion
    with different delays.
    """
    rows = np.zeros((6, unknowns.COUNT))
    wrench = write_body_wrench(row, angular_acceleration, belief, state, rows)
    point, column, effect = np.empty(3), np.empty(3), np.empty(6)
    slides = True
    for leg in range(len(LEGS)):
        if on_ground[leg] == 0.0:
            continue
        slides = slides and state.axes[VERTICAL[leg]].slides >= 1.0
        foot_point(belief.legs[leg], of_leg(row.position, leg), belief.foot_height[leg], point)
        add_force(wrench, state.means.foot_force[leg], point)
        for joint in range(len(JOINTS)):
            cylinder = ROTATION[leg] + joint
            axis_state = state.axes[cylinder]
            for axis in range(3):
                column[axis] = maps[leg, axis, joint]
            effect[:] = 0.0
            add_force(effect, column, point)
            for equation in range(len(unknowns.WRENCH)):
                write_cylinder_weights(cylinder, effect[equation], axis_state, rows[equation])
    variance = np.empty(6)
    for equation in range(len(unknowns.WRENCH)):
        rows[equation, unknowns.BALANCE + equation] = 1.0
        is_force = equation < MOMENT
        variance[equation] = belief.force_variance if is_force else belief.moment_variance
    variance[UP] += (belief.blow_share * row.ordered_thrust) ** 2
    if something_else_carries(rows, wrench, variance[UP], belief, state):
        return
    slides = slides and state.support.otherwise == 0.0
    if slides:
        reach = np.empty(2)
        reach[0], reach[1] = belief.belly_length, belief.belly_width
        faulty_sensor.take_balance(rows, wrench, variance, reach, state.fusion)
    shows = slides and row.ordered_thrust == 0.0
    for equation in range(len(unknowns.WRENCH)):
        learns = equation in unknowns.VERTICAL_EQUATIONS and shows
        if learns:
            variance[equation] *= 1.0 + (UNSTEADY * state.unsteady) ** 2 / belief.force_variance
        missing, error = wrench[equation], variance[equation]
        observe(state.fusion, rows[equation], missing, error, belief.gate, learns)


@njit
def step_body(row: DataRow, belief: BodyBelief, state: BodyState) -> None:
    """Advance the estimate by one step: reads the measured part of `row` and writes its `own`
    estimates, N.
    """
    extension, arms = np.empty(12), np.empty(12)
    joint_to_cylinder(row.position, belief.linkages, extension, arms)
    joints, lift = state.joints, state.motion.lift
    for leg in range(len(LEGS)):
        # A foot in the air carries no load: what its cylinders seem to push is friction.
        in_air = state.in_air[leg] >= belief.air_dwell
        for joint in range(len(JOINTS)):
            index = ROTATION[leg] + joint
            axis, arm = state.axes[index], arms[index]
            readings = row.pressure_a[index], row.pressure_b[index], extension[index]
            loads = Loads(0.0, 0.0) if in_air else rod_loads(joint, state.last_force[leg], arm)
            step_axis(
                readings, loads, row.oil_temperature, belief.decisions, belief.axes[index], axis
            )
            joints.position[index] = row.position[index]
            joints.rate[index] = axis.speed / arm
            joints.acceleration[index] = axis.acceleration / arm
            joints.torque[index] = (axis.force - axis.friction) * arm
    force, up, rotation, normals = np.zeros((4, 3)), np.zeros(4), np.zeros((3, 3)), np.zeros((4, 3))
    attitude = np.empty(2)
    attitude[0] = row.attitude[0] - belief.unit_roll
    attitude[1] = row.attitude[1] - belief.unit_pitch
    gravity_in_body(attitude, belief.gravity, lift)
    for k in range(3):
        rotation[k, k], lift[k] = 1.0, -lift[k]
    foot_forces(belief.legs, joints, rotation, state.motion, normals, force, up)
    gather(row, force, state)
    if state.count >= belief.every or (state.started == 0.0 and state.count > 0.0):
        balance(row, arms, belief, state)
    answer(row, arms, force, belief, state)


@njit
def rod_loads(joint: int, foot_force: Array, arm: float) -> Loads:
    """The loads on the rod at a joint of a leg (TURN, OUT, DOWN), from the force (3) on its foot in
    the last step and the arm of its linkage.
    """
    if joint == DOWN:
        return Loads(foot_force[Z] / arm, math.sqrt(foot_force[X] ** 2 + foot_force[Y] ** 2))
    return Loads(0.0, abs(foot_force[Z]) if joint == OUT else 0.0)


@njit
def gather(row: DataRow, force: Array, state: BodyState) -> None:
    """Add this step to the sums of the next balance; a step with a missing sample is left out."""
    sums = state.sums
    whole = row.rope_tension[0] + row.rope_tension[1]
    for leg in range(len(LEGS)):
        for axis in range(3):
            whole += force[leg, axis]
    if not math.isfinite(whole):
        return
    for leg in range(len(LEGS)):
        for axis in range(3):
            sums.foot_force[leg, axis] += force[leg, axis]
    for rope in range(len(SIDES)):
        sums.rope_tension[rope] += row.rope_tension[rope]
    for index in range(3):
        sums.angular_rate[index] += row.angular_rate[index]
        sums.specific_force[index] += row.specific_force[index]
    for index in range(len(AXES)):
        sums.cylinder_force[index] += state.axes[index].force
    state.count += 1.0


@njit
def answer(row: DataRow, arms: Array, force: Array, belief: BodyBelief, state: BodyState) -> None:
    """Subtract the estimated errors from the foot forces (4, 3), filter them, and write them into
    the row with their uncertainty.
    """
    map_, loads, own, interval = np.empty((3, 3)), np.empty(4), row.own, row.estimate_own
    wider = widening(state.surprise)
    for leg in range(len(LEGS)):
        leg_map(belief.legs[leg], of_leg(row.position, leg), of_leg(arms, leg), map_)
        for joint in range(len(JOINTS)):
            off = force_error(ROTATION[leg] + joint, state)
            for axis in range(3):
                force[leg, axis] -= map_[axis, joint] * off
        loads[leg] = persistent.step(state.filters[leg], force[leg, UP], belief.filter)
        for axis in range(UP):
            level = state.level[leg, axis]
            share = LEVEL_SHARE if state.started > 1.0 else 1.0
            if math.isfinite(force[leg, axis]):
                state.level[leg, axis] = level + share * (force[leg, axis] - level)
            state.last_force[leg, axis] = state.level[leg, axis]
        own.x[leg], own.y[leg] = state.level[leg, X], state.level[leg, Y]
        own.x_sd[leg], own.y_sd[leg] = (
            wider * state.force_sd[leg, X],
            wider * state.force_sd[leg, Y],
        )
    if belief.shakes != 0.0:
        add_fast_changes(row.specific_force[UP], loads, belief, state.shaken)
    for leg in range(len(LEGS)):
        load = loads[leg]
        state.last_force[leg, UP] = row.estimate.own[leg] = own.z[leg] = load
        bounds(leg, load, belief, state, interval)
        own.z_sd[leg] = interval.sd[leg]
    row.own_balance_doubt = max(state.doubt, doubt.NONE)
    row.own_surprise = max(state.surprise.level, NO_SURPRISE)
    if state.started > 0.0:
        state.started = 2.0


@njit
def bounds(leg: int, load: float, belief: BodyBelief, state: BodyState, interval: Interval) -> None:
    """Write the standard deviation, the 90 % interval and the spread of a foot's load (N) into
    `interval`.
    """
    piston, filtered = state.axes[VERTICAL[leg]], state.filters[leg].estimate.variance
    slides, begun = piston.slides, just_begun(piston, belief.reported)
    moving = slides**2 * moving_variance(load, begun, belief, state.stirred)
    sd = math.sqrt(state.force_sd[leg, UP] ** 2 + (filtered + moving)) * widening(state.surprise)
    other = filtered + (slides * belief.moving_sd) ** 2
    interval.spread[leg] = math.sqrt(state.spread[leg] ** 2 + other)
    interval.sd[leg] = sd
    interval.low[leg], interval.high[leg] = load - Z90 * sd, load + Z90 * sd
