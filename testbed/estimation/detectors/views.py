"""What the learned detector looks at: forty numbers a foot, made of this sample and of short
memories of the last ones.

Loads are seen through arsinh(load / loss force): fine around nothing, coarse where a foot is safe,
alike on machines of any weight. What moves on a short time scale tells a foot in the air from one
that bears little: on the ground it feels the drill and the other feet, in the air it does not.
"""

from __future__ import annotations

import math
from typing import Any

from testbed.compiled import njit
from testbed.formats.records import Record, quantity
from testbed.machine.names import LEGS, VERTICAL

MEANS_S = (0.002, 0.01, 0.05, 0.3)
"""Time constants of the running means of a load, s."""
MEANS = ("2 ms", "10 ms", "50 ms", "300 ms")
VIEW = (
    *(f"{load}, mean over {span}" for span in MEANS for load in ("own", "carried", "balance")),
    "friction, mean over 10 ms",
    "own, low end of its interval",
    "own, high end of its interval",
    "expected",
    "own of the foot across the body's middle",
    "own of the foot on the same side",
    "own of the foot at the same end",
    "carried, stirred within 10 ms",
    "carried, stirred within 50 ms",
    "the same, all feet, 10 ms",
    "the same, all feet, 50 ms",
    "speed of the piston",
    "its size, mean over 100 ms",
    "meant to carry",
    "the same, mean over 300 ms",
    "all feet meant to carry",
    "ordered thrust",
    "least that the foot bore of late",
    "most that the foot bore of late",
    "valve command",
    "behind its set point",
    "force of chamber A",
    "force of chamber B",
    "force of chamber A, rate",
    "force of chamber B, rate",
    "gravity along the joint",
    "body, stirred within 50 ms",
    "force aside",
)
LATE_S, SEEN_S, STIR_S = 3.0, 0.02, (0.03, 0.15)
"""Time constants: of what a foot bore of late; of commands; of how much a load is stirred, s
(E).
"""
FAST_S, MEANT_S = 0.1, 0.3


class FootMemory(Record):
    """Of one foot."""

    started = quantity("1", "1 once there was a sample")
    own = quantity("N", "running means of the whole-body estimate", per=MEANS)
    carried = quantity("N", "running means of `carried`", per=MEANS)
    balance = quantity("N", "running means of `balance`", per=MEANS)
    friction = quantity("N", "running mean of the load less friction (7)")
    stirred = quantity("N", "mean distance of `carried` from its mean", per=("10 ms", "50 ms"))
    speed = quantity("m/s", "mean size of the piston's speed")
    meant = quantity("1", "mean of `carrying`")
    least = quantity("N", "the least that the foot bore of late")
    most = quantity("N", "the most that the foot bore of late")
    command = quantity("1", "mean valve command")
    behind = quantity("m", "mean distance from the set point")
    last = quantity("N", "forces of both chambers one sample ago", per=("a", "b"))
    rates = quantity("N/s", "mean size of their change", per=("a", "b"))
    lift = quantity("m/s2", "mean specific force of the body along its z")
    shaken = quantity("m/s2", "mean distance of it from that")
    aside = quantity("N", "mean force along x and y")
    odds = quantity("1", "the detector's answer so far")
    judged = quantity("1", "1 once there was one")


class ViewNumbers(Record):
    """The scale of a machine."""

    loss_force = quantity("N", "load below which a foot has lost its contact")
    area_a = quantity("m2", "piston side of a vertical cylinder")
    area_b = quantity("m2", "rod side")


@njit
def _share(dt: float, time_s: float) -> float:
    return dt / (time_s + dt)


@njit
def remember(row: Any, derived: Any, foot: int, numbers: Any, memory: Any, dt: float) -> None:
    """One sample into the memory of one foot: DataRow, Derived -> FootMemory."""
    axis = VERTICAL[foot]
    loads = (row.estimate.own[foot], derived.carried[foot], derived.balance[foot])
    force_a, force_b = row.pressure_a[axis] * numbers.area_a, row.pressure_b[axis] * numbers.area_b
    lift, behind = row.specific_force[2], row.reference[axis] - row.position[axis]
    aside = math.hypot(row.own.x[foot], row.own.y[foot])
    if memory.started == 0.0:
        memory.started = 1.0
        for k in range(4):
            memory.own[k], memory.carried[k], memory.balance[k] = loads
        memory.friction, memory.meant = row.estimate.friction[foot], row.carrying[foot]
        memory.least = memory.most = loads[0]
        memory.last[0], memory.last[1] = force_a, force_b
        memory.lift, memory.aside, memory.behind = lift, aside, behind
    for k in range(4):
        share = _share(dt, MEANS_S[k])
        memory.own[k] += share * (loads[0] - memory.own[k])
        memory.carried[k] += share * (loads[1] - memory.carried[k])
        memory.balance[k] += share * (loads[2] - memory.balance[k])
    memory.friction += _share(dt, MEANS_S[1]) * (row.estimate.friction[foot] - memory.friction)
    for k in range(2):
        away = abs(loads[1] - memory.carried[k + 1])
        memory.stirred[k] += _share(dt, STIR_S[k]) * (away - memory.stirred[k])
    memory.speed += _share(dt, FAST_S) * (abs(derived.velocity[foot]) - memory.speed)
    memory.meant += _share(dt, MEANT_S) * (row.carrying[foot] - memory.meant)
    now, late = memory.own[1], dt / LATE_S
    memory.least = min(memory.least + (now - memory.least) * late, now)
    memory.most = max(memory.most + (now - memory.most) * late, now)
    memory.command += _share(dt, SEEN_S) * (row.valve[axis] - memory.command)
    memory.behind += _share(dt, SEEN_S) * (behind - memory.behind)
    share = _share(dt, MEANS_S[2])
    memory.rates[0] += share * (abs(force_a - memory.last[0]) / dt - memory.rates[0])
    memory.rates[1] += share * (abs(force_b - memory.last[1]) / dt - memory.rates[1])
    memory.last[0], memory.last[1] = force_a, force_b
    memory.lift += share * (lift - memory.lift)
    memory.shaken += _share(dt, FAST_S) * (abs(lift - memory.lift) - memory.shaken)
    memory.aside += _share(dt, SEEN_S) * (aside - memory.aside)


@njit
def look(row: Any, derived: Any, numbers: Any, memories: Any, dt: float, views: Any) -> None:
    """One sample: DataRow, Derived, FootMemory (4) -> views (4, len(VIEW))."""
    all_meant, stir_fast, stir_slow = 1.0, 0.0, 0.0
    for foot in range(len(LEGS)):
        remember(row, derived, foot, numbers, memories[foot], dt)
        all_meant = min(all_meant, row.carrying[foot])
        stir_fast += 0.25 * memories[foot].stirred[0]
        stir_slow += 0.25 * memories[foot].stirred[1]
    unit = numbers.loss_force
    thrust = math.asinh(row.ordered_thrust / unit)
    along = math.cos(row.attitude[0]) * math.cos(row.attitude[1])
    for foot in range(len(LEGS)):
        m, view, axis = memories[foot], views[foot], VERTICAL[foot]
        for k in range(4):
            view[3 * k] = math.asinh(m.own[k] / unit)
            view[3 * k + 1] = math.asinh(m.carried[k] / unit)
            view[3 * k + 2] = math.asinh(m.balance[k] / unit)
        view[12] = math.asinh(m.friction / unit)
        view[13] = math.asinh(row.estimate_own.low[foot] / unit)
        view[14] = math.asinh(row.estimate_own.high[foot] / unit)
        view[15] = math.asinh(row.expected[foot] / unit)
        view[16] = math.asinh(memories[3 - foot].own[1] / unit)
        view[17] = math.asinh(memories[(foot + 2) % 4].own[1] / unit)
        view[18] = math.asinh(memories[foot + 1 - 2 * (foot % 2)].own[1] / unit)
        view[19] = math.log1p(10.0 * m.stirred[0] / unit)
        view[20] = math.log1p(10.0 * m.stirred[1] / unit)
        view[21] = math.log1p(10.0 * stir_fast / unit)
        view[22] = math.log1p(10.0 * stir_slow / unit)
        view[23] = math.atan(100.0 * derived.velocity[foot])
        view[24] = math.log1p(1000.0 * m.speed)
        view[25], view[26], view[27], view[28] = row.carrying[foot], m.meant, all_meant, thrust
        view[29] = math.asinh(m.least / unit)
        view[30] = math.asinh(m.most / unit)
        view[31] = math.atan(10.0 * m.command)
        view[32] = math.atan(500.0 * m.behind)
        view[33] = math.log1p(max(row.pressure_a[axis] * numbers.area_a, 0.0) / (10.0 * unit))
        view[34] = math.log1p(max(row.pressure_b[axis] * numbers.area_b, 0.0) / (10.0 * unit))
        view[35] = math.log1p(0.01 * m.rates[0] / unit)
        view[36] = math.log1p(0.01 * m.rates[1] / unit)
        view[37], view[38] = along, math.log1p(10.0 * m.shaken)
        view[39] = math.asinh(m.aside / unit)
