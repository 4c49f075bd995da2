"""The testbed's own estimator, live and compiled: three cylinders of each leg -> three-dimensional foot force -> body.

Every step (1 kHz): axis_kernel.py gives each cylinder's force; the legs' equations of motion (robot/foot_forces.py:
weight and inertia of the frames, linkage) turn three cylinder forces into the ground's force on the foot. Every
`EVERY` steps: fusion_kernel.py learns what the cylinders' forces are off by. Forces are ground on foot, body frame, N.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import fill, njit
from testbed.estimation.filters import persistent
from testbed.estimation.live import axis_kernel as ax
from testbed.estimation.live import fusion_kernel as fu
from testbed.formats.records import size
from testbed.laws.drill import IN_HOLE_KG, IN_MAST_KG, MAST_MIDDLE, REACTION, STORED_KG, THRUST
from testbed.robot.linkage import joint_to_cylinder
from testbed.robot.loads import foot_forces as ff

Array = NDArray[np.float64]

# --- what is believed of the whole body (BODY_NUMBERS, then the parts below) --------------------------------------
(
    EVERY,
    SLIDING_KEEP_S,
    REST_KEEP_S,
    BODY_KEEP_S,
    ROPE_SD,
    FORCE_R,
    MOMENT_R,
    GATE,
    TAIL_S,
    ZERO_WANDER,
    AIR_LOAD,
    AIR_DWELL,
    AIR_SD,
    USE_SWING,
    USE_BALANCE,
    NOISE_SD,
    GRAVITY,
    BASE_MASS,
    CALIBRATED_AT,
    DRILL_SHARE,
    NEWS,
    NEWS_NOISE,
    BLOW_SHARE,
    SD_AT_REST,
    BODY_NUMBERS,
) = range(25)
"""Steps between two balances; time constants s of what friction deviates while sliding and at rest, and of the
balance's own error; shares and variances (N2, N2 m2) of the balance; gate in standard deviations; fusion_kernel's
tail s; wander of a zero N2/s; load N, dwell s and standard deviation N of a foot in the air; switches; noise of the
filtered load N; m/s2; kg; degC; how much of the drill's ordered thrust may be wrong, 1; where a
piston may be at rest, the share of a change of its force that may be friction's and not the load's, 1, and how much of
such a change is noise, N; of blows, the share of the thrust; stated standard deviation over the filter's own where a
piston is at rest, 1."""
BODY_SD = BODY_NUMBERS
FILTER = BODY_SD + 6
GEOMETRY = FILTER + 4
BASE_CENTRE = GEOMETRY + 4
FOOT_Z = BASE_CENTRE + 3
ROPE_POINTS = FOOT_Z + 4
ROPE_DIRECTIONS = ROPE_POINTS + 6
DRILL_POINT = ROPE_DIRECTIONS + 6
STORE_POINT = DRILL_POINT + 3
INERTIA = STORE_POINT + 3
"""Of the whole machine about the body's origin, kg m2 (3 x 3)."""
COMMON = INERTIA + 9
LEGS_AT = COMMON + ax.AXIS_COMMON
AXES_AT = LEGS_AT + 4 * size(ff.LegNumbers)
LEG_NUMBERS, JOINT_MOTION, BODY_MOTION = (
    ff.LegNumbers.dtype,
    ff.JointMotion.dtype,
    ff.BodyMotion.dtype,
)
BODY_SIZE = AXES_AT + 12 * ax.AXIS_BELIEFS

# --- state --------------------------------------------------------------------------------------------------------
AXIS = 0
X = AXIS + 12 * ax.AXIS_STATES
P = X + fu.N
SUM = P + fu.N * fu.N
"""Since the last balance, added up: foot forces (12), rope tensions (2), angular rates (3), specific force (3),
cylinder forces friction included (12)."""
COUNT = SUM + 32
STARTED = COUNT + 1
IN_AIR = STARTED + 1
"""For how long each foot has been in the air, s (4)."""
FILTERS = IN_AIR + 4
LEVEL = FILTERS + 4 * persistent.STATE_SIZE
"""Filtered forces along x and y (8)."""
OUTPUT_SD = LEVEL + 8
"""Standard deviations of the foot forces (12) as of the last balance."""
LAST = OUTPUT_SD + 12
"""Foot forces of the last step (12)."""
ZERO_VARIANCE = LAST + 12
"""What the zeros' variance has been granted so far, N2 (12)."""
RATE = ZERO_VARIANCE + 12
"""Mean angular rate at the last balance, rad/s (3)."""
PISTON = RATE + 3
"""Mean cylinder forces at the last balance, N (12)."""
STATE_SIZE = PISTON + 12

OUT_ROWS = 10
"""Of `step_own`'s out: load, low, high, sd; force x, y, z; sd x, y, z."""


@njit
def leg_map(leg: Any, q: Array, arm: float, out: Array) -> None:
    """out (3, 3): change of the foot's force (body frame) by each cylinder's force, N/N, at joint positions q (3)."""
    rx, ry = ff.turn_z(q[0], leg.radial[0], leg.radial[1])
    fx, fy = ff.turn_z(q[0], leg.foot[0] + leg.radial[0] * q[1], leg.foot[1] + leg.radial[1] * q[1])
    reach, aside = fx * rx + fy * ry, -fx * ry + fy * rx
    out[0, 0], out[1, 0], out[2, 0] = arm * ry / reach, -arm * rx / reach, 0.0
    out[0, 1], out[1, 1], out[2, 1] = -rx + aside / reach * ry, -ry - aside / reach * rx, 0.0
    out[0, 2], out[1, 2], out[2, 2] = 0.0, 0.0, 1.0


@njit
def foot_point(leg: Any, q: Array, z0: float, out: Array) -> None:
    """Underside of the foot in the body frame, m (3)."""
    x, y = ff.turn_z(q[0], leg.foot[0] + leg.radial[0] * q[1], leg.foot[1] + leg.radial[1] * q[1])
    out[0], out[1], out[2] = leg.hip[0] + x, leg.hip[1] + y, z0 - q[2]


@njit
def add_force(wrench: Array, force: Array, point: Array, sign: float) -> None:
    """wrench (6) += sign times force (3) at point (3), about the body's origin."""
    for k in range(3):
        wrench[k] += sign * force[k]
    wrench[3] += sign * (point[1] * force[2] - point[2] * force[1])
    wrench[4] += sign * (point[2] * force[0] - point[0] * force[2])
    wrench[5] += sign * (point[0] * force[1] - point[1] * force[0])


@njit
def other_wrench(
    q: Array,
    gravity: Array,
    specific: Array,
    turning: Array,
    tension: Array,
    rotation: Array,
    drill: Array,
    body: Array,
) -> Array:
    """Wrench (6) about the body's origin, body frame, of weight, inertia, ropes and drill at joint positions q (12).

    specific (3) m/s2: the body's acceleration less gravity, and turning (3) rad/s2: its angular acceleration, carry
    the body and the inner links; frames and feet stand still and carry gravity (3) m/s2 alone. tension (2) N;
    rotation (3, 3) body to world; drill (KNOWN): see laws/drill.py.
    """
    wrench, force, point = np.zeros(6), np.empty(3), np.empty(3)
    for k in range(3):
        force[k] = -body[BASE_MASS] * specific[k]
        for j in range(3):
            wrench[3 + k] -= body[INERTIA + 3 * k + j] * turning[j]
    add_force(wrench, force, body[BASE_CENTRE:FOOT_Z], 1.0)
    for k in range(4):
        leg = body[LEGS_AT:AXES_AT].view(LEG_NUMBERS)[k]
        for i in range(3):
            link, out = leg.links[i], q[3 * k + 1] if i > 0 else 0.0
            x, y = ff.turn_z(
                q[3 * k],
                link.centre[0] + leg.radial[0] * out,
                link.centre[1] + leg.radial[1] * out,
            )
            point[0], point[1] = leg.hip[0] + x, leg.hip[1] + y
            point[2] = leg.hip[2] + link.centre[2] - (q[3 * k + 2] if i == 2 else 0.0)
            for j in range(3):
                force[j] = link.mass * (gravity[j] if i == 2 else -specific[j])
            add_force(wrench, force, point, 1.0)
    for r in range(2):
        d = ROPE_DIRECTIONS + 3 * r
        for k in range(3):
            force[k] = 0.0
            for j in range(3):
                force[k] += tension[r] * rotation[j, k] * body[d + j]
        add_force(wrench, force, body[ROPE_POINTS + 3 * r : ROPE_POINTS + 3 * r + 3], 1.0)
    add_drill(wrench, drill, gravity, body)
    return wrench


@njit
def add_drill(wrench: Array, drill: Array, gravity: Array, body: Array) -> None:
    """wrench (6) += what the drill's controls know (KNOWN): thrust, torque, rods in the hole, mast and store."""
    force, point = np.zeros(3), body[DRILL_POINT:STORE_POINT].copy()
    force[2] = drill[THRUST] + drill[IN_HOLE_KG] * gravity[2]
    add_force(wrench, force, point, 1.0)
    wrench[5] += drill[REACTION]
    point[2] += drill[MAST_MIDDLE]
    for k in range(3):
        force[k] = drill[IN_MAST_KG] * gravity[k]
    add_force(wrench, force, point, 1.0)
    for k in range(3):
        force[k] = drill[STORED_KG] * gravity[k]
    add_force(wrench, force, body[STORE_POINT:INERTIA], 1.0)


@njit
def rotation_of(rpy: Array) -> Array:
    """Body to world (3, 3): Rz(yaw) Ry(pitch) Rx(roll)."""
    cr, cp, cy = math.cos(rpy[0]), math.cos(rpy[1]), math.cos(rpy[2])
    sr, sp, sy = math.sin(rpy[0]), math.sin(rpy[1]), math.sin(rpy[2])
    out = np.empty((3, 3))
    out[0, 0], out[0, 1], out[0, 2] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    out[1, 0], out[1, 1], out[1, 2] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    out[2, 0], out[2, 1], out[2, 2] = -sp, cp * sr, cp * cr
    return out


@njit(apart=True)
def balance(
    q: Array,
    arms: Array,
    gravity: Array,
    attitude: Array,
    carrying: Array,
    drill: Array,
    oil_degc: float,
    body: Array,
    s: Array,
) -> None:
    """One fusion: what the cylinders' forces are off by, from the means since the last one."""
    x, p = s[X:P], s[P:SUM].reshape(fu.N, fu.N)
    axes = s[AXIS:X].reshape(12, ax.AXIS_STATES)
    beliefs = body[AXES_AT:BODY_SIZE].reshape(12, ax.AXIS_BELIEFS)
    dt, mean = body[EVERY] * body[COMMON + ax.DT], s[SUM:COUNT] / s[COUNT]
    keep, spread, zero_sd, grown, news = (
        np.empty(12),
        np.empty(12),
        np.empty(12),
        np.empty(12),
        np.empty(12),
    )
    low, high, body_sd = np.empty(12), np.empty(12), body[BODY_SD:FILTER].copy()
    warm = oil_degc - body[CALIBRATED_AT]
    for i in range(12):
        a = axes[i]
        tau = body[SLIDING_KEEP_S] if a[ax.SLIDES] >= 1.0 else body[REST_KEEP_S]
        keep[i] = 0.0 if a[ax.CHANGED] != 0.0 else math.exp(-dt / tau)
        a[ax.CHANGED] = 0.0
        spread[i] = a[ax.SPREAD]
        news[i] = 0.0
        if i % 3 == 2 and a[ax.SLIDES] < 1.0 and s[STARTED] != 0.0:
            news[i] = (
                body[NEWS] * max(abs(mean[20 + i] - s[PISTON + i]) - body[NEWS_NOISE], 0.0)
            ) ** 2
        variance = beliefs[i, ax.ZERO_SD] ** 2 + (beliefs[i, ax.THERMAL_N_K] * warm) ** 2
        zero_sd[i] = math.sqrt(variance)
        grown[i] = max(variance - s[ZERO_VARIANCE + i], 0.0) + body[ZERO_WANDER] * dt
        s[ZERO_VARIANCE + i] = max(variance, s[ZERO_VARIANCE + i])
        margin = 2.0 * a[ax.SPREAD] if a[ax.SLIDES] > 0.0 else 0.0
        low[i], high[i] = a[ax.LOW] - a[ax.FRICTION] - margin, a[ax.HIGH] - a[ax.FRICTION] + margin
    body_sd[2] += body[DRILL_SHARE] * abs(drill[THRUST])
    for k in range(3):
        body_sd[k] += body[ROPE_SD] * (mean[12] + mean[13])
    first = 1.0 if s[STARTED] == 0.0 else 0.0
    if first != 0.0:
        fu.start(x, p, zero_sd, spread, body_sd)
        s[STARTED] = 1.0
    else:
        fu.predict(
            x,
            p,
            keep,
            spread,
            news,
            zero_sd,
            grown,
            body_sd,
            math.exp(-dt / body[BODY_KEEP_S]),
            dt,
            body[TAIL_S],
        )
    maps, h = np.zeros((4, 3, 3)), np.zeros(fu.N)
    on_ground = np.ones(4)
    for k in range(4):
        leg = body[LEGS_AT:AXES_AT].view(LEG_NUMBERS)[k]
        leg_map(leg, q[3 * k : 3 * k + 3], arms[3 * k], maps[k])
        up = mean[3 * k + 2] - x[fu.Z + 3 * k + 2] - x[fu.D + 3 * k + 2]
        off = carrying[k] < 0.5 and abs(up) < body[AIR_LOAD]
        s[IN_AIR + k] = s[IN_AIR + k] + dt if off else 0.0
        on_ground[k] = 0.0 if carrying[k] < 0.5 and abs(up) < body[AIR_LOAD] else 1.0
        if s[IN_AIR + k] >= body[AIR_DWELL] and body[USE_SWING] != 0.0:
            for r in range(3):
                h[:] = 0.0
                for j in range(3):
                    h[fu.Z + 3 * k + j] = h[fu.D + 3 * k + j] = maps[k, r, j]
                fu.observe(x, p, h, mean[3 * k + r], body[AIR_SD] ** 2, body[GATE])
    if body[USE_BALANCE] != 0.0:
        turning = np.zeros(3)
        for k in range(3):
            turning[k] = (mean[14 + k] - s[RATE + k]) / dt if first == 0.0 else 0.0
        _balance_body(q, gravity, turning, attitude, drill, mean, maps, on_ground, body, x, p)
    fill(s[RATE:PISTON], mean[14:17])
    fill(s[PISTON:STATE_SIZE], mean[20:32])
    fu.stay_in_sets(x, p, low, high)
    for k in range(4):
        for r in range(3):
            total = 0.0
            for i in range(3):
                for j in range(3):
                    zi, zj, di, dj = (
                        fu.Z + 3 * k + i,
                        fu.Z + 3 * k + j,
                        fu.D + 3 * k + i,
                        fu.D + 3 * k + j,
                    )
                    total += (
                        maps[k, r, i]
                        * maps[k, r, j]
                        * (p[zi, zj] + p[di, dj] + p[zi, dj] + p[di, zj])
                    )
            s[OUTPUT_SD + 3 * k + r] = math.sqrt(max(total, 0.0) + body[NOISE_SD] ** 2)


@njit
def _balance_body(
    q: Array,
    gravity: Array,
    turning: Array,
    attitude: Array,
    drill: Array,
    mean: Array,
    maps: Array,
    on_ground: Array,
    body: Array,
    x: Array,
    p: Array,
) -> None:
    """The six equations: feet that carry, weight, ropes and drill add up to nothing but the balance's own error b."""
    wrench = other_wrench(
        q, gravity, mean[17:20], turning, mean[12:14], rotation_of(attitude), drill, body
    )
    point, column = np.empty(3), np.empty(3)
    rows = np.zeros((6, fu.N))
    effect = np.empty(6)
    for k in range(4):
        if on_ground[k] == 0.0:
            continue
        leg = body[LEGS_AT:AXES_AT].view(LEG_NUMBERS)[k]
        foot_point(leg, q[3 * k : 3 * k + 3], body[FOOT_Z + k], point)
        add_force(wrench, mean[3 * k : 3 * k + 3], point, 1.0)
        for j in range(3):
            for r in range(3):
                column[r] = maps[k, r, j]
            effect[:] = 0.0
            add_force(effect, column, point, 1.0)
            for r in range(6):
                rows[r, fu.Z + 3 * k + j] = rows[r, fu.D + 3 * k + j] = effect[r]
    for r in range(6):
        rows[r, fu.B + r] = 1.0
        variance = body[FORCE_R] if r < 3 else body[MOMENT_R]
        if r == 2:
            variance += (body[BLOW_SHARE] * drill[THRUST]) ** 2
        fu.observe(x, p, rows[r], wrench[r], variance, body[GATE])


@njit
def legs_forces(
    legs: Array,
    joints: Array,
    rotation: Array,
    motions: Array,
    normals: Array,
    force: Array,
    up: Array,
) -> None:
    """foot_forces.foot_forces on the first of `joints` and `motions`."""
    ff.foot_forces(legs, joints[0], rotation, motions[0], normals, force, up)


@njit
def step_own(
    pa: Array,
    pb: Array,
    q: Array,
    gravity: Array,
    u: Array,
    oil_degc: float,
    rope: Array,
    attitude: Array,
    inertial: Array,
    carrying: Array,
    drill: Array,
    body: Array,
    s: Array,
    out: Array,
) -> None:
    """One step of all: pa, pb Pa, q rad or m, u (12) by axis; gravity (3) m/s2, rope (2) N, attitude (3) rad,
    inertial (6): angular rate rad/s, specific force m/s2; carrying (4), drill (KNOWN) as in `other_wrench`;
    body (BODY_SIZE), s (STATE_SIZE), out (OUT_ROWS, 4)."""
    axes = s[AXIS:X].reshape(12, ax.AXIS_STATES)
    beliefs = body[AXES_AT:BODY_SIZE].reshape(12, ax.AXIS_BELIEFS)
    legs = body[LEGS_AT:AXES_AT].view(LEG_NUMBERS)
    extension, arms = np.empty(12), np.empty(12)
    joint_to_cylinder(q, body[GEOMETRY:BASE_CENTRE], extension, arms)
    joints = np.empty(1, JOINT_MOTION)
    for i in range(12):
        k = 3 * (i // 3)
        load = s[LAST + k + 2]
        across = math.sqrt(s[LAST + k] ** 2 + s[LAST + k + 1] ** 2)
        side = across if i % 3 == 2 else abs(load) if i % 3 == 1 else 0.0
        a = axes[i]
        ax.step_axis(
            pa[i],
            pb[i],
            extension[i],
            u[i],
            load if i % 3 == 2 else 0.0,
            side,
            oil_degc,
            i % 3 == 2,
            body[COMMON:LEGS_AT],
            beliefs[i],
            a,
        )
        joints[0].position[i] = q[i]
        joints[0].rate[i] = a[ax.SPEED] / arms[i]
        joints[0].acceleration[i] = a[ax.ACCELERATION] / arms[i]
        joints[0].torque[i] = (a[ax.FORCE] - a[ax.FRICTION]) * arms[i]
    force, up, rotation = np.zeros((4, 3)), np.zeros(4), np.zeros((3, 3))
    still = np.zeros(1, BODY_MOTION)
    for k in range(3):
        rotation[k, k], still[0].lift[k] = 1.0, -gravity[k]
    normals = np.zeros((4, 3))
    legs_forces(legs, joints, rotation, still, normals, force, up)
    whole = rope[0] + rope[1]
    for k in range(12):
        whole += force[k // 3, k % 3]
    if math.isfinite(whole):  # a step with a missing sample teaches nothing
        for k in range(12):
            s[SUM + k] += force[k // 3, k % 3]
        s[SUM + 12] += rope[0]
        s[SUM + 13] += rope[1]
        for k in range(6):
            s[SUM + 14 + k] += inertial[k]
        for i in range(12):
            s[SUM + 20 + i] += axes[i, ax.FORCE]
        s[COUNT] += 1.0
    if s[COUNT] >= body[EVERY] or (s[STARTED] == 0.0 and s[COUNT] > 0.0):
        balance(q, arms, gravity, attitude, carrying, drill, oil_degc, body, s)
        s[SUM:STARTED] = 0.0
    answer(q, arms, legs, axes, force, body, s, out)


@njit
def answer(
    q: Array, arms: Array, legs: Array, axes: Array, force: Array, body: Array, s: Array, out: Array
) -> None:
    """What is learnt taken off the legs' forces (4, 3), filtered, with its uncertainty, into out (OUT_ROWS, 4)."""
    x, map_ = s[X:P], np.empty((3, 3))
    for k in range(4):
        leg_map(legs[k], q[3 * k : 3 * k + 3], arms[3 * k], map_)
        for j in range(3):
            off = x[fu.Z + 3 * k + j] + x[fu.D + 3 * k + j]
            for r in range(3):
                force[k, r] -= map_[r, j] * off
        vertical = axes[3 * k + 2]
        memory = s[FILTERS + k * persistent.STATE_SIZE : FILTERS + (k + 1) * persistent.STATE_SIZE]
        load = persistent.step(memory, force[k, 2], body[FILTER:GEOMETRY])
        for r in range(2):
            level = s[LEVEL + 2 * k + r]
            share = 0.15 if s[STARTED] > 1.0 else 1.0
            s[LEVEL + 2 * k + r] = (
                level + share * (force[k, r] - level) if math.isfinite(force[k, r]) else level
            )
            out[4 + r, k] = s[LEVEL + 2 * k + r]
            s[LAST + 3 * k + r] = out[4 + r, k]
        s[LAST + 3 * k + 2] = load
        out[0, k] = out[6, k] = load
        friction, sd = vertical[ax.FRICTION] + x[fu.D + 3 * k + 2], s[OUTPUT_SD + 3 * k + 2]
        sensors = (
            2.0 * math.sqrt(max(s[P + (fu.Z + 3 * k + 2) * (fu.N + 1)], 0.0)) + 2.0 * body[NOISE_SD]
        )
        out[1, k] = min(load, load + friction - vertical[ax.HIGH] - sensors)
        out[2, k] = max(load, load + friction - vertical[ax.LOW] + sensors)
        stated = body[SD_AT_REST] if vertical[ax.SLIDES] <= 0.0 else 1.0
        out[3, k] = math.sqrt((stated * sd) ** 2 + memory[persistent.P])
        for r in range(3):
            out[7 + r, k] = s[OUTPUT_SD + 3 * k + r] if r < 2 else out[3, k]
    if s[STARTED] > 0.0:
        s[STARTED] = 2.0
