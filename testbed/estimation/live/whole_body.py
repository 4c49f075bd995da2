"""The whole-body estimate, live and compiled: three cylinders of each leg -> three-dimensional foot force -> body.

Every step (1 kHz): axis.py gives each cylinder's force; the legs' equations of motion (robot/loads/foot_forces.py:
weight and inertia of the frames, linkage) turn three cylinder forces into the ground's force on the foot. Every so many
steps fusion.py learns what the cylinders' forces are off by. Forces are ground on foot, body frame, N.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from testbed.compiled import njit
from testbed.estimation.filters import persistent
from testbed.estimation.live import fusion as fu
from testbed.estimation.live.axis import AxisBelief, AxisState, Decisions, Loads, step_axis
from testbed.formats.records import SET, Record, part, quantity
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.recording.rows import XYZ
from testbed.robot.linkage import joint_to_cylinder
from testbed.robot.loads import foot_forces as ff

LEVEL_SHARE = 0.15
"""What a sample weighs in the filtered forces along x and y."""


class BodyBelief(Record):
    """What is believed of the whole machine, and how sure the estimate is of what."""

    believed = quantity(
        "1", "1: the whole machine; 0: each vertical cylinder is estimated by itself"
    )
    every = quantity("1", "steps between two balances")
    gravity = quantity("m/s2", "strength")
    sliding_keep = quantity("s", "for how long friction deviates while sliding")
    rest_keep = quantity("s", "the same at rest")
    balance_keep = quantity("s", "for how long the balance's own error lasts")
    rope_share = quantity("1", "of the ropes' tensions, that the balance may be off by")
    drill_share = quantity("1", "of the ordered thrust, likewise")
    blow_share = quantity("1", "of the thrust, by blows, likewise")
    force_variance = quantity("N2", "of the balance of forces")
    moment_variance = quantity("N2 m2", "of the balance of moments")
    gate = quantity("1", "standard deviations beyond which an observation counts less")
    tail = quantity("s", "within it a zero far beyond its size is set free; 0: never")
    zero_wander = quantity("N2/s", "by which a zero wanders")
    air_load = quantity("N", "less than this a foot that is not meant to carry is in the air")
    air_dwell = quantity("s", "for so long")
    air_sd = quantity("N", "how surely it then carries nothing")
    learns_in_air = quantity("1", "0/1: zeros are learnt from feet in the air")
    balances = quantity("1", "0/1: the body's balance is used")
    noise_sd = quantity("N", "noise of a filtered load")
    news_share = quantity("1", "of a change of force at rest, that may be friction's")
    news_noise = quantity("N", "of such a change, that is noise")
    sd_at_rest = quantity("1", "stated standard deviation over the filter's own, at rest")
    calibrated_at = quantity("degC", "temperature of the sensors' calibration")
    base_mass = quantity("kg", "of body and turntables")
    base_centre = quantity("m", "its centre from the body's origin", per=XYZ)
    inertia = quantity("kg m2", "of the whole machine about the body's origin", per=(XYZ, XYZ))
    balance_sd = quantity("N", "expected error of the balance (moments N m)", per=fu.WRENCH)
    linkage = quantity(
        "m", "pins of joint 1 (angle: rad)", per=("body_anchor", "lever", "neutral", "closed")
    )
    foot_height = quantity("m", "underside of a foot above the origin, joints at 0", per=LEGS)
    rope_point = quantity("m", "where the ropes pull, body frame", per=(SIDES, XYZ))
    rope_direction = quantity("1", "towards the anchors, world frame", per=(SIDES, XYZ))
    pin_gain = quantity("1", "reading of a load pin by true tension", per=SIDES)
    pin_zero = quantity("N", "reading of a slack rope's load pin", per=SIDES)
    unit_roll = quantity("rad", "how the inertial unit is turned against the body")
    unit_pitch = quantity("rad", "the same, about its y axis before x")
    drill_point = quantity("m", "where the drill pushes, body frame", per=XYZ)
    store_point = quantity("m", "where the store of rods is, body frame", per=XYZ)
    filter = part(persistent.Numbers, "of the foot loads")
    decisions = part(Decisions, "common to the axes")
    legs = part(ff.LegNumbers, "masses and geometry", per=LEGS)
    axes = part(AxisBelief, "cylinders", per=AXES)


class Gathered(Record):
    """Between two balances: sums, then means."""

    foot_force = quantity("N", "of the legs' equations, nothing learnt taken off", per=(LEGS, XYZ))
    rope_tension = quantity("N", "tensions", per=SIDES)
    angular_rate = quantity("rad/s", "of the body", per=XYZ)
    specific_force = quantity("m/s2", "of the body's origin", per=XYZ)
    cylinder_force = quantity("N", "friction included", per=AXES)


class BodyState(Record):
    """What is known of the whole machine."""

    joints = part(ff.JointMotion, "of the cylinders' sensors")
    motion = part(ff.BodyMotion, "as if it stood still, body frame")
    axes = part(AxisState, "cylinders", per=AXES)
    attitude = quantity("rad", "of the body", per=("roll", "pitch", "yaw"))
    fusion = part(fu.Fusion, "what the cylinders' forces are off by")
    sums = part(Gathered, "since the last balance, added up")
    means = part(Gathered, "at the last balance")
    count = quantity("1", "samples in the sums")
    started = quantity("1", "1 after the first balance, 2 after the first answer")
    in_air = quantity("s", "for how long a foot has been in the air", per=LEGS)
    filters = part(persistent.PersistentState, "of the foot loads", per=LEGS)
    level = quantity("N", "filtered force along x and y", per=(LEGS, ("x", "y")))
    force_sd = quantity(
        "N", "standard deviation of a foot force at the last balance", per=(LEGS, XYZ)
    )
    last_force = quantity("N", "foot forces of the last step", per=(LEGS, XYZ))
    zero_variance = quantity("N2", "what the zeros' variance has been granted so far", per=AXES)


@njit
def gravity_in_body(attitude: Any, gravity: float, out: Any) -> None:
    """Gravity's vector (3) in the body frame, m/s2, at roll, pitch, yaw."""
    roll, pitch = attitude[0], attitude[1]
    out[0] = gravity * math.sin(pitch)
    out[1] = -gravity * math.cos(pitch) * math.sin(roll)
    out[2] = -gravity * math.cos(pitch) * math.cos(roll)


@njit
def turn_out_of_unit(vector: Any, roll: float, pitch: float) -> None:
    """A vector (3), in place, into the body frame from an inertial unit that is mounted Ry(pitch) Rx(roll)."""
    if roll == 0.0 and pitch == 0.0:
        return
    x, y, z = vector[0], vector[1], vector[2]
    y, z = math.cos(roll) * y - math.sin(roll) * z, math.sin(roll) * y + math.cos(roll) * z
    vector[0] = math.cos(pitch) * x + math.sin(pitch) * z
    vector[1] = y
    vector[2] = math.cos(pitch) * z - math.sin(pitch) * x


@njit
def leg_map(leg: Any, q: Any, arm: float, out: Any) -> None:
    """Out (3, 3): change of the foot's force (body frame) by each cylinder's force, N/N, at joint positions q (3)."""
    rx, ry = ff.turn_z(q[0], leg.radial[0], leg.radial[1])
    fx, fy = ff.turn_z(q[0], leg.foot[0] + leg.radial[0] * q[1], leg.foot[1] + leg.radial[1] * q[1])
    reach, aside = fx * rx + fy * ry, -fx * ry + fy * rx
    out[0, 0], out[1, 0], out[2, 0] = arm * ry / reach, -arm * rx / reach, 0.0
    out[0, 1], out[1, 1], out[2, 1] = -rx + aside / reach * ry, -ry - aside / reach * rx, 0.0
    out[0, 2], out[1, 2], out[2, 2] = 0.0, 0.0, 1.0


@njit
def foot_point(leg: Any, q: Any, height: float, out: Any) -> None:
    """Underside of the foot in the body frame, m (3)."""
    x, y = ff.turn_z(q[0], leg.foot[0] + leg.radial[0] * q[1], leg.foot[1] + leg.radial[1] * q[1])
    out[0], out[1], out[2] = leg.hip[0] + x, leg.hip[1] + y, height - q[2]


@njit
def add_force(wrench: Any, force: Any, point: Any) -> None:
    """Wrench (6) += force (3) at point (3), about the body's origin."""
    for k in range(3):
        wrench[k] += force[k]
    wrench[3] += point[1] * force[2] - point[2] * force[1]
    wrench[4] += point[2] * force[0] - point[0] * force[2]
    wrench[5] += point[0] * force[1] - point[1] * force[0]


@njit
def other_wrench(row: Any, gravity: Any, turning: Any, state: Any, body: Any) -> Any:
    """Wrench (6) about the body's origin, body frame, of weight, inertia, ropes and drill.

    row: DataRow (posture, what the drill's controls know). The specific force of the BodyState's means (the body's
    acceleration less gravity) and `turning` (3) rad/s2 (its angular acceleration) carry the body and the inner links;
    frames and feet stand still and carry gravity (3) m/s2 alone.
    """
    means = state.means
    wrench, force = np.zeros(6), np.empty(3)
    for k in range(3):
        force[k] = -body.base_mass * means.specific_force[k]
        for j in range(3):
            wrench[3 + k] -= body.inertia[k, j] * turning[j]
    add_force(wrench, force, body.base_centre)
    for k in range(4):
        add_links(wrench, body.legs[k], row.position[3 * k : 3 * k + 3], gravity, means)
    rotation = rotation_of(state.attitude)
    for r in range(2):
        for k in range(3):
            force[k] = 0.0
            for j in range(3):
                force[k] += means.rope_tension[r] * rotation[j, k] * body.rope_direction[r, j]
        add_force(wrench, force, body.rope_point[r])
    add_drill(wrench, row, gravity, body)
    return wrench


@njit
def add_links(wrench: Any, leg: Any, q: Any, gravity: Any, means: Any) -> None:
    """Wrench (6) += weight and inertia of a leg's three links at joint positions q (3)."""
    force, point = np.empty(3), np.empty(3)
    for i in range(3):
        link, out = leg.links[i], q[1] if i > 0 else 0.0
        x, y = ff.turn_z(
            q[0], link.centre[0] + leg.radial[0] * out, link.centre[1] + leg.radial[1] * out
        )
        point[0], point[1] = leg.hip[0] + x, leg.hip[1] + y
        point[2] = leg.hip[2] + link.centre[2] - (q[2] if i == 2 else 0.0)
        for j in range(3):
            pull = gravity[j] if i == 2 else -means.specific_force[j]
            force[j] = link.mass * pull
        add_force(wrench, force, point)


@njit
def add_drill(wrench: Any, row: Any, gravity: Any, body: Any) -> None:
    """Wrench (6) += what the drill's controls know: thrust, torque, rods in the hole, mast and store."""
    force, point = np.zeros(3), np.empty(3)
    for k in range(3):
        point[k] = body.drill_point[k]
    force[2] = row.ordered_thrust + row.rods_in_hole * gravity[2]
    add_force(wrench, force, point)
    wrench[5] += row.ordered_torque
    point[2] += row.rods_mast_height
    for k in range(3):
        force[k] = row.rods_in_mast * gravity[k]
    add_force(wrench, force, point)
    for k in range(3):
        force[k] = row.rods_stored * gravity[k]
    add_force(wrench, force, body.store_point)


@njit
def rotation_of(rpy: Any) -> Any:
    """Body to world (3, 3): Rz(yaw) Ry(pitch) Rx(roll)."""
    cr, cp, cy = math.cos(rpy[0]), math.cos(rpy[1]), math.cos(rpy[2])
    sr, sp, sy = math.sin(rpy[0]), math.sin(rpy[1]), math.sin(rpy[2])
    out = np.empty((3, 3))
    out[0, 0], out[0, 1], out[0, 2] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    out[1, 0], out[1, 1], out[1, 2] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    out[2, 0], out[2, 1], out[2, 2] = -sp, cp * sr, cp * cr
    return out


@njit
def expect_sizes(row: Any, body: Any, state: Any) -> None:
    """How large what is to be learnt may be by now, from the means since the last balance, into fusion.sizes."""
    sizes, means, dt = state.fusion.sizes, state.means, body.every * body.decisions.dt
    warm = row.oil_temperature - body.calibrated_at
    sizes.dt, sizes.tail = dt, body.tail
    sizes.balance_keep = math.exp(-dt / body.balance_keep)
    for i in range(12):
        axis, belief = state.axes[i], body.axes[i]
        keep_s = body.sliding_keep if axis.slides >= 1.0 else body.rest_keep
        sizes.keep[i] = 0.0 if axis.changed != 0.0 else math.exp(-dt / keep_s)
        axis.changed = 0.0
        sizes.spread[i] = axis.spread
        variance = belief.zero_sd**2 + (belief.thermal_sd * warm) ** 2
        sizes.zero_sd[i] = math.sqrt(variance)
        sizes.zero_grown[i] = max(variance - state.zero_variance[i], 0.0) + body.zero_wander * dt
        state.zero_variance[i] = max(variance, state.zero_variance[i])
        margin = 2.0 * axis.spread if axis.slides > 0.0 else 0.0
        sizes.low[i] = axis.low - axis.friction - margin
        sizes.high[i] = axis.high - axis.friction + margin
    for k in range(6):
        sizes.balance_sd[k] = body.balance_sd[k]
    sizes.balance_sd[2] += body.drill_share * abs(row.ordered_thrust)
    for k in range(3):
        sizes.balance_sd[k] += body.rope_share * (means.rope_tension[0] + means.rope_tension[1])


@njit
def take_means(body: Any, state: Any) -> Any:
    """Turn the sums into means; returns the body's angular acceleration (3), rad/s2. News of a piston at rest: the
    change of its mean force.
    """
    sums, means, sizes, count = state.sums, state.means, state.fusion.sizes, state.count
    turning, started = np.zeros(3), state.started != 0.0
    dt = body.every * body.decisions.dt
    for k in range(3):
        rate = sums.angular_rate[k] / count
        turning[k] = (rate - means.angular_rate[k]) / dt if started else 0.0
        means.angular_rate[k] = rate
        means.specific_force[k] = sums.specific_force[k] / count
        sums.angular_rate[k] = sums.specific_force[k] = 0.0
    turn_out_of_unit(means.specific_force, body.unit_roll, body.unit_pitch)
    for k in range(2):
        tension = sums.rope_tension[k] / count
        means.rope_tension[k] = (tension - body.pin_zero[k]) / body.pin_gain[k]
        sums.rope_tension[k] = 0.0
    for k in range(4):
        for j in range(3):
            means.foot_force[k, j] = sums.foot_force[k, j] / count
            sums.foot_force[k, j] = 0.0
    for i in range(12):
        force = sums.cylinder_force[i] / count
        sizes.news[i] = 0.0
        if i % 3 == 2 and state.axes[i].slides < 1.0 and started:
            change = abs(force - means.cylinder_force[i])
            sizes.news[i] = (body.news_share * max(change - body.news_noise, 0.0)) ** 2
        means.cylinder_force[i] = force
        sums.cylinder_force[i] = 0.0
    state.count = 0.0
    return turning


@njit
def balance(row: Any, arms: Any, body: Any, state: Any) -> None:
    """One fusion: what the cylinders' forces are off by, from the means since the last one; arms (12) m/rad or 1."""
    first, fusion = state.started == 0.0, state.fusion
    turning = take_means(body, state)
    expect_sizes(row, body, state)
    if first:
        fu.start(fusion)
        state.started = 1.0
    else:
        fu.predict(fusion)
    maps, on_ground = np.zeros((4, 3, 3)), np.ones(4)
    for k in range(4):
        leg_map(body.legs[k], row.position[3 * k : 3 * k + 3], arms[3 * k], maps[k])
        if hangs(k, row, body, state):
            on_ground[k] = 0.0
            if state.in_air[k] >= body.air_dwell and body.learns_in_air != 0.0:
                learn_in_air(k, maps[k], body, state)
    if body.balances != 0.0:
        balance_body(row, turning, maps, on_ground, body, state)
    fu.stay_in_sets(fusion)
    for k in range(4):
        for r in range(3):
            variance = max(force_variance(fusion.p, maps[k, r], 3 * k), 0.0)
            state.force_sd[k, r] = math.sqrt(variance + body.noise_sd**2)


@njit
def hangs(k: int, row: Any, body: Any, state: Any) -> bool:
    """Whether foot k is in the air by now; counts for how long."""
    axis, x = 3 * k + 2, state.fusion.x
    up = state.means.foot_force[k, 2] - x[fu.ZERO + axis] - x[fu.DEVIATION + axis]
    off = bool(row.carrying[k] < SET and abs(up) < body.air_load)
    dt = body.every * body.decisions.dt
    state.in_air[k] = state.in_air[k] + dt if off else 0.0
    return off


@njit
def learn_in_air(k: int, map_: Any, body: Any, state: Any) -> None:
    """Three observations: foot k carries nothing. map_ (3, 3): leg_map."""
    h = np.zeros(fu.N)
    for r in range(3):
        for j in range(3):
            h[fu.ZERO + 3 * k + j] = h[fu.DEVIATION + 3 * k + j] = map_[r, j]
        force = state.means.foot_force[k, r]
        fu.observe(state.fusion, h, force, body.air_sd**2, body.gate)


@njit
def force_variance(p: Any, weights: Any, first: int) -> float:
    """Variance of a foot force that weighs (3) the forces of the cylinders from `first` on, N2."""
    total = 0.0
    for i in range(3):
        for j in range(3):
            zi, zj = fu.ZERO + first + i, fu.ZERO + first + j
            di, dj = fu.DEVIATION + first + i, fu.DEVIATION + first + j
            both = p[zi, zj] + p[di, dj] + p[zi, dj] + p[di, zj]
            total += weights[i] * weights[j] * both
    return total


@njit
def balance_body(row: Any, turning: Any, maps: Any, on_ground: Any, body: Any, state: Any) -> None:
    """The six equations: feet that carry, weight, ropes and drill add up to nothing but the balance's own error."""
    gravity, means = np.empty(3), state.means
    gravity_in_body(state.attitude, body.gravity, gravity)
    wrench = other_wrench(row, gravity, turning, state, body)
    point, column, effect = np.empty(3), np.empty(3), np.empty(6)
    rows = np.zeros((6, fu.N))
    for k in range(4):
        if on_ground[k] == 0.0:
            continue
        foot_point(body.legs[k], row.position[3 * k : 3 * k + 3], body.foot_height[k], point)
        add_force(wrench, means.foot_force[k], point)
        for j in range(3):
            for r in range(3):
                column[r] = maps[k, r, j]
            effect[:] = 0.0
            add_force(effect, column, point)
            for r in range(6):
                rows[r, fu.ZERO + 3 * k + j] = rows[r, fu.DEVIATION + 3 * k + j] = effect[r]
    for r in range(6):
        rows[r, fu.BALANCE + r] = 1.0
        variance = body.force_variance if r < 3 else body.moment_variance
        if r == 2:
            variance += (body.blow_share * row.ordered_thrust) ** 2
        fu.observe(state.fusion, rows[r], wrench[r], variance, body.gate)


@njit
def step_body(row: Any, body: Any, state: Any) -> None:
    """One step of all: reads the measured part of a DataRow, writes its own estimates (N); BodyBelief, BodyState."""
    extension, arms = np.empty(12), np.empty(12)
    joint_to_cylinder(row.position, body.linkage, extension, arms)
    joints, lift = state.joints, state.motion.lift
    for i in range(12):
        axis = state.axes[i]
        readings = row.pressure_a[i], row.pressure_b[i], extension[i], row.valve[i]
        loads = loads_of(i, state.last_force[i // 3])
        step_axis(readings, loads, row.oil_temperature, body.decisions, body.axes[i], axis)
        joints.position[i] = row.position[i]
        joints.rate[i], joints.acceleration[i] = axis.speed / arms[i], axis.acceleration / arms[i]
        joints.torque[i] = (axis.force - axis.friction) * arms[i]
    for k in range(3):
        state.attitude[k] = row.attitude[k]
    state.attitude[0] -= body.unit_roll
    state.attitude[1] -= body.unit_pitch
    force, up, rotation, normals = np.zeros((4, 3)), np.zeros(4), np.zeros((3, 3)), np.zeros((4, 3))
    gravity_in_body(state.attitude, body.gravity, lift)
    for k in range(3):
        rotation[k, k], lift[k] = 1.0, -lift[k]
    ff.foot_forces(body.legs, joints, rotation, state.motion, normals, force, up)
    gather(row, force, state)
    if state.count >= body.every or (state.started == 0.0 and state.count > 0.0):
        balance(row, arms, body, state)
    answer(row, arms, force, body, state)


@njit
def loads_of(axis: int, foot_force: Any) -> Loads:
    """What acts on an axis' rod, from the last step's force (3) on its foot."""
    if axis % 3 == 2:
        across = math.sqrt(foot_force[0] ** 2 + foot_force[1] ** 2)
        return Loads(foot_force[2], across, True)
    return Loads(0.0, abs(foot_force[2]) if axis % 3 == 1 else 0.0, False)


@njit
def gather(row: Any, force: Any, state: Any) -> None:
    """Add this step to the sums; one with a missing sample teaches nothing."""
    sums = state.sums
    whole = row.rope_tension[0] + row.rope_tension[1]
    for k in range(4):
        for j in range(3):
            whole += force[k, j]
    if not math.isfinite(whole):
        return
    for k in range(4):
        for j in range(3):
            sums.foot_force[k, j] += force[k, j]
    for k in range(2):
        sums.rope_tension[k] += row.rope_tension[k]
    for k in range(3):
        sums.angular_rate[k] += row.angular_rate[k]
        sums.specific_force[k] += row.specific_force[k]
    for i in range(12):
        sums.cylinder_force[i] += state.axes[i].force
    state.count += 1.0


@njit
def answer(row: Any, arms: Any, force: Any, body: Any, state: Any) -> None:
    """What is learnt taken off the legs' forces (4, 3), filtered, with its uncertainty, into the row."""
    x, map_, own, interval = state.fusion.x, np.empty((3, 3)), row.own, row.estimate_own
    for k in range(4):
        leg_map(body.legs[k], row.position[3 * k : 3 * k + 3], arms[3 * k], map_)
        for j in range(3):
            off = x[fu.ZERO + 3 * k + j] + x[fu.DEVIATION + 3 * k + j]
            for r in range(3):
                force[k, r] -= map_[r, j] * off
        load = persistent.step(state.filters[k], force[k, 2], body.filter)
        for r in range(2):
            level = state.level[k, r]
            share = LEVEL_SHARE if state.started > 1.0 else 1.0
            if math.isfinite(force[k, r]):
                state.level[k, r] = level + share * (force[k, r] - level)
            state.last_force[k, r] = state.level[k, r]
        state.last_force[k, 2] = load
        row.estimate.own[k] = own.z[k] = load
        own.x[k], own.y[k] = state.level[k, 0], state.level[k, 1]
        own.x_sd[k], own.y_sd[k] = state.force_sd[k, 0], state.force_sd[k, 1]
        bounds(k, load, body, state, interval)
        own.z_sd[k] = interval.sd[k]
    if state.started > 0.0:
        state.started = 2.0


@njit
def bounds(k: int, load: float, body: Any, state: Any, interval: Any) -> None:
    """How sure the load (N) of foot k is, into the row's Interval."""
    i = 3 * k + 2
    axis, fusion = state.axes[i], state.fusion
    friction = axis.friction + fusion.x[fu.DEVIATION + i]
    zero_variance = max(fusion.p[fu.ZERO + i, fu.ZERO + i], 0.0)
    sensors = 2.0 * math.sqrt(zero_variance) + 2.0 * body.noise_sd
    interval.low[k] = min(load, load + friction - axis.high - sensors)
    interval.high[k] = max(load, load + friction - axis.low + sensors)
    stated = body.sd_at_rest if axis.slides <= 0.0 else 1.0
    variance = state.filters[k].estimate.variance
    interval.sd[k] = math.sqrt((stated * state.force_sd[k, 2]) ** 2 + variance)
