"""What the learned detector looks at: 70 numbers a foot, made of this sample and of memories of the
last ones, 22 of them in histories.py, 13 in motions.py.

Loads are seen through arsinh(load / loss force): fine around nothing, coarse where a foot is safe,
alike on machines of any weight. What moves on a short time scale tells a foot in the air from one
that bears little: on the ground it feels the drill and the other feet, in the air it does not; nor
does it hold back the slope's pull. What the three loads differ by over ten seconds shows a sensor
that drifts, and what all loads together bear beyond the expected how far the balance can be
trusted. What tells one scene from the next (pressures, slope, thrust, longer memories) is left out:
with some hundred scenes to learn from, a network learns those by heart.
"""

from __future__ import annotations

import math
from typing import Any

from testbed.compiled import njit
from testbed.estimation.detectors.histories import (
    HISTORY,
    History,
    look_back,
    remember_history,
)
from testbed.estimation.detectors.motions import MOTION, Motion, look_around, remember_motion
from testbed.formats.records import Record, part, quantity
from testbed.machine.names import LEGS

LOADS = ("own", "carried", "balance")
MEANS_S = (0.002, 0.01, 0.05, 0.3)
"""Time constants of the running means of a load, s."""
MEANS = ("2 ms", "10 ms", "50 ms", "300 ms")
STIRRED = ("carried, 10 ms", "own, 10 ms", "carried, 50 ms", "own, 50 ms")
SIDEWAYS = ("10 ms", "300 ms")
BEHIND = ("carried", "balance")
EXTREMES = ("own, most", "own, least", "carried, most", "carried, least")
VIEW = (
    *(f"{load}, mean over {span}" for load in LOADS for span in MEANS),
    "expected",
    "standard deviation of own",
    *(f"{load}: how far from that mean" for load in STIRRED),
    *(f"{load} of the last 300 ms" for load in EXTREMES),
    "meant to carry",
    "speed of the piston",
    "own of the foot across the body's middle",
    "own of the foot on the same side",
    "own of the foot at the same end",
    *(f"side force, mean size over {span}" for span in SIDEWAYS),
    "side force, size of its mean over 50 ms",
    "side force of all feet, mean size over 50 ms",
    "what all feet bear beyond the expected, mean over 100 ms",
    "own, least of the last 2 s",
    *(f"own less {load}, mean over 10 s" for load in BEHIND),
    *HISTORY,
    *MOTION,
)
PRESENT = len(VIEW) - len(HISTORY) - len(MOTION)
"""So many of them are made here."""
AROUND = len(VIEW) - len(MOTION)
MEAN, STIR = VIEW.index("own, mean over 2 ms"), VIEW.index("carried, 10 ms: how far from that mean")
EXPECTED, CERTAINTY = VIEW.index("expected"), VIEW.index("standard deviation of own")
EXTREME = VIEW.index("own, most of the last 300 ms")
MEANT, SPEED = VIEW.index("meant to carry"), VIEW.index("speed of the piston")
ACROSS = VIEW.index("own of the foot across the body's middle")
SAME_SIDE = VIEW.index("own of the foot on the same side")
SAME_END = VIEW.index("own of the foot at the same end")
SIDE = VIEW.index("side force, mean size over 10 ms")
PUSHED = VIEW.index("side force, size of its mean over 50 ms")
ASIDE = VIEW.index("side force of all feet, mean size over 50 ms")
BEYOND = VIEW.index("what all feet bear beyond the expected, mean over 100 ms")
LEAST = VIEW.index("own, least of the last 2 s")
BEHIND_BY = VIEW.index("own less carried, mean over 10 s")
"""Where each of them, or the first of its kind, stands in a view."""
LATE_S, EXPECTED_S, STIR_S = 0.3, 0.01, (0.02, 0.1)
"""Time constants: of what a foot bore of late; of what is expected; of how much a load is stirred
within 10 and 50 ms, s (E).
"""
ASIDE_S, SHORT_S, WHOLE_S, LEAST_S, DRIFT_S = (0.01, 0.3), 0.05, 0.1, 2.0, 10.0
"""Likewise: of side forces; of their direction; of the whole machine's load; of the least that a
foot bore; of what a sensor's drift adds, s (E).
"""


class FootMemory(Record):
    """Of one foot."""

    started = quantity("1", "1 once there was a sample")
    means = quantity("N", "running means of the loads", per=(LOADS, MEANS))
    expected = quantity("N", "running mean of the expected load")
    stirred = quantity("N", "mean distance of a load from its mean", per=STIRRED)
    extremes = quantity("N", "what the foot bore of late", per=EXTREMES)
    sideways = quantity("N", "mean size of the side force", per=SIDEWAYS)
    aside = quantity("N", "its mean size over 50 ms")
    pushed = quantity("N", "mean side force over 50 ms", per=("x", "y"))
    beyond = quantity("N", "running mean of what the foot bears beyond the expected")
    least = quantity("N", "the least that it bore of late")
    behind = quantity("N", "running mean of `own` less a load", per=BEHIND)
    history = part(History, "its past")
    motion = part(Motion, "its corner of the body")
    odds = quantity("1", "the detector's answer so far")
    judged = quantity("1", "1 once there was one")


class ViewNumbers(Record):
    """The scale of a machine."""

    loss_force = quantity("N", "load below which a foot has lost its contact")
    half_length = quantity("m", "from the body's middle ahead to the feet")
    half_width = quantity("m", "from there aside to the feet")


@njit
def _share(dt: float, time_s: float) -> float:
    return dt / (time_s + dt)


@njit
def remember(row: Any, derived: Any, foot: int, numbers: Any, memory: Any, dt: float) -> None:
    """One sample into the memory of one foot: DataRow, Derived, ViewNumbers -> FootMemory."""
    loads = (row.estimate.own[foot], derived.carried[foot], derived.balance[foot])
    means = memory.means
    started = memory.started != 0.0
    for load in range(3):
        for k in range(4):
            share = _share(dt, MEANS_S[k]) if started else 1.0
            means[load, k] += share * (loads[load] - means[load, k])
    share = _share(dt, EXPECTED_S) if started else 1.0
    memory.expected += share * (row.expected[foot] - memory.expected)
    for k in range(2):
        for j in range(2):
            load = 1 - j  # carried, own
            away = abs(loads[load] - means[load, k + 1])
            memory.stirred[2 * k + j] += _share(dt, STIR_S[k]) * (away - memory.stirred[2 * k + j])
    fade = _share(dt, LATE_S) if started else 1.0
    for load in range(2):
        now, most, least = means[load, 1], 2 * load, 2 * load + 1
        memory.extremes[most] += fade * (now - memory.extremes[most])
        memory.extremes[least] += fade * (now - memory.extremes[least])
        memory.extremes[most] = max(memory.extremes[most], now)
        memory.extremes[least] = min(memory.extremes[least], now)
    remember_slowly(row, loads, foot, memory, dt)
    speed = derived.velocity[foot]
    remember_history(loads[0], loads[1], speed, numbers.loss_force, memory, not started, dt)
    remember_motion(row, derived, foot, numbers, memory, not started, dt)
    memory.started = 1.0


@njit
def remember_slowly(row: Any, loads: Any, foot: int, memory: Any, dt: float) -> None:
    """The same of side forces, of the balance and of what takes seconds; loads: own, carried,
    balance, N.
    """
    started = memory.started != 0.0
    side = (row.own.x[foot], row.own.y[foot])
    size = math.hypot(side[0], side[1])
    short = _share(dt, SHORT_S) if started else 1.0
    for k in range(2):
        share = _share(dt, ASIDE_S[k]) if started else 1.0
        memory.sideways[k] += share * (size - memory.sideways[k])
        memory.pushed[k] += short * (side[k] - memory.pushed[k])
        share = _share(dt, DRIFT_S) if started else 1.0
        memory.behind[k] += share * (loads[0] - loads[k + 1] - memory.behind[k])
    memory.aside += short * (size - memory.aside)
    share = _share(dt, WHOLE_S) if started else 1.0
    memory.beyond += share * (loads[0] - row.expected[foot] - memory.beyond)
    share = _share(dt, LEAST_S) if started else 1.0
    memory.least = min(
        memory.least + share * (memory.means[0, 1] - memory.least), memory.means[0, 1]
    )


@njit
def look(row: Any, derived: Any, numbers: Any, memories: Any, dt: float, views: Any) -> None:
    """One sample: DataRow, Derived, FootMemory (4) -> views (4, len(VIEW))."""
    unit = numbers.loss_force
    for foot in range(len(LEGS)):
        remember(row, derived, foot, numbers, memories[foot], dt)
    aside = beyond = 0.0
    for foot in range(len(LEGS)):
        aside += memories[foot].aside
        beyond += memories[foot].beyond
    for foot in range(len(LEGS)):
        m, view = memories[foot], views[foot]
        for load in range(3):
            for k in range(len(MEANS)):
                view[MEAN + len(MEANS) * load + k] = math.asinh(m.means[load, k] / unit)
        view[EXPECTED] = math.asinh(m.expected / unit)
        view[CERTAINTY] = math.asinh(row.estimate_own.sd[foot] / unit)
        for k in range(len(STIRRED)):
            view[STIR + k] = math.asinh(m.stirred[k] / unit)
        for k in range(len(EXTREMES)):
            view[EXTREME + k] = math.asinh(m.extremes[k] / unit)
        view[MEANT] = row.carrying[foot]
        view[SPEED] = math.atan(100.0 * derived.velocity[foot])
        view[ACROSS] = math.asinh(memories[3 - foot].means[0, 2] / unit)
        view[SAME_SIDE] = math.asinh(memories[(foot + 2) % len(LEGS)].means[0, 2] / unit)
        view[SAME_END] = math.asinh(memories[foot + 1 - 2 * (foot % 2)].means[0, 2] / unit)
        for k in range(len(SIDEWAYS)):
            view[SIDE + k] = math.asinh(m.sideways[k] / unit)
        view[PUSHED] = math.asinh(math.hypot(m.pushed[0], m.pushed[1]) / unit)
        view[ASIDE], view[BEYOND] = math.asinh(aside / unit), math.asinh(beyond / unit)
        view[LEAST] = math.asinh(m.least / unit)
        for k in range(len(BEHIND)):
            view[BEHIND_BY + k] = math.asinh(m.behind[k] / unit)
        look_back(memories, foot, row.estimate_own.sd[foot], unit, view[PRESENT:AROUND])
        look_around(memories, foot, numbers, view[AROUND:])
