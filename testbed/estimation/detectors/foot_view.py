"""What the learned detector looks at: 70 numbers a foot, made of this sample and of memories of the
last ones, 22 of them in foot_history.py, 13 in body_motion.py; each goes by its name (`View`).

Loads are seen through arsinh(load / loss force): fine around nothing, coarse where a foot is
safe, alike on machines of any weight. What moves on a short time scale tells a foot in the air
from one that bears little: on the ground it feels the drill and the other feet, in the air it
does not; nor does it hold back the slope's pull. What the three loads differ by over ten seconds
shows a sensor that drifts, and what all loads together bear beyond the expected how far the
balance can be trusted. What tells one scene from the next (pressures, slope, thrust, longer
memories) is left out: with some hundred scenes to learn from, a network learns those by heart.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.estimation.detectors.body_motion import (
    Motion,
    MotionView,
    remember_motion,
    view_of_motion,
)
from testbed.estimation.detectors.foot_history import (
    History,
    HistoryView,
    remember_history,
    view_of_history,
)
from testbed.estimation.detectors.sample import Derived, Sample
from testbed.formats.arrays import Array
from testbed.formats.records import Record, Records, part, quantity
from testbed.machine.names import LEGS
from testbed.recording.rows import DataRow

LOADS = ("own", "carried", "balance")
MEANS_S = (0.002, 0.01, 0.05, 0.3)
"""Time constants of the running means of a load, s."""
MEANS = ("2_ms", "10_ms", "50_ms", "300_ms")
STIRRED = ("carried_10_ms", "own_10_ms", "carried_50_ms", "own_50_ms")
SIDEWAYS = ("10_ms", "300_ms")
BEHIND = ("carried", "balance")
EXTREMES = ("own_most", "own_least", "carried_most", "carried_least")
LATE_S, EXPECTED_S, STIR_S = 0.3, 0.01, (0.02, 0.1)
"""Time constants: of what a foot bore of late; of what is expected; of how much a load is stirred
within 10 and 50 ms, s (E).
"""
ASIDE_S, SHORT_S, WHOLE_S, LEAST_S, DRIFT_S = (0.01, 0.3), 0.05, 0.1, 2.0, 10.0
"""Likewise: of side forces; of their direction; of the whole machine's load; of the least that a
foot bore; of what a sensor's drift adds, s (E).
"""


class View(Record):
    """What the network sees of one foot. Loads go through arsinh(load / loss force)."""

    loads = quantity("1", "running means of the loads", per=(LOADS, MEANS))
    expected = quantity("1", "running mean of the expected load")
    own_sd = quantity("1", "spread of `own`, a standard deviation")
    stirred = quantity("1", "mean distance of a load from its mean", per=STIRRED)
    extremes = quantity("1", "what the foot bore of the last 300 ms", per=EXTREMES)
    meant_to_carry = quantity("1", "1 for a foot in stance")
    piston_speed = quantity("1", "through an arc tangent")
    across = quantity("1", "`own` of the foot across the body's middle")
    same_side = quantity("1", "`own` of the foot on the same side")
    same_end = quantity("1", "`own` of the foot at the same end")
    sideways = quantity("1", "mean size of the side force", per=SIDEWAYS)
    pushed = quantity("1", "size of the mean side force over 50 ms")
    aside = quantity("1", "side force of all feet, mean size over 50 ms")
    beyond = quantity("1", "what all feet bear beyond the expected, mean over 100 ms")
    least = quantity("1", "least of `own` of the last 2 s")
    behind = quantity("1", "`own` less a load, mean over 10 s", per=BEHIND)
    history = part(HistoryView, "the foot's past")
    motion = part(MotionView, "the body's motion and the foot's")


VIEW = tuple(View.column_names())
"""Every number of a view, in the network's order."""


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
def remember(
    row: DataRow, derived: Derived, foot: int, numbers: ViewNumbers, memory: FootMemory, dt: float
) -> None:
    """One sample into the memory of one foot."""
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
def remember_slowly(
    row: DataRow, loads: tuple[float, float, float], foot: int, memory: FootMemory, dt: float
) -> None:
    """Remember side forces, the balance and what takes seconds; loads: own, carried, balance, N."""
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
def update_views(
    row: DataRow,
    derived: Derived,
    numbers: ViewNumbers,
    memories: Records[FootMemory],
    dt: float,
    views: Records[View],
) -> None:
    """One sample into the memories (4) of the feet and their views (4)."""
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
                view.loads[load, k] = math.asinh(m.means[load, k] / unit)
        view.expected = math.asinh(m.expected / unit)
        view.own_sd = math.asinh(row.estimate_own.spread[foot] / unit)
        for k in range(len(STIRRED)):
            view.stirred[k] = math.asinh(m.stirred[k] / unit)
        for k in range(len(EXTREMES)):
            view.extremes[k] = math.asinh(m.extremes[k] / unit)
        view.meant_to_carry = row.carrying[foot]
        view.piston_speed = math.atan(100.0 * derived.velocity[foot])
        view.across = math.asinh(memories[3 - foot].means[0, 2] / unit)
        view.same_side = math.asinh(memories[(foot + 2) % len(LEGS)].means[0, 2] / unit)
        view.same_end = math.asinh(memories[foot + 1 - 2 * (foot % 2)].means[0, 2] / unit)
        for k in range(len(SIDEWAYS)):
            view.sideways[k] = math.asinh(m.sideways[k] / unit)
        view.pushed = math.asinh(math.hypot(m.pushed[0], m.pushed[1]) / unit)
        view.aside, view.beyond = math.asinh(aside / unit), math.asinh(beyond / unit)
        view.least = math.asinh(m.least / unit)
        for k in range(len(BEHIND)):
            view.behind[k] = math.asinh(m.behind[k] / unit)
        view_of_history(memories, foot, row.estimate_own.spread[foot], unit, view.history)
        view_of_motion(memories, foot, numbers, view.motion)


def views_over(
    samples: Records[Sample],
    scale: Records[ViewNumbers],
    memories: Records[FootMemory],
    dt: float,
    every: int,
    out: NDArray[np.floating[Any]],
) -> None:
    """For training every so many-th view of samples (n,) -> (n // every, 4, len(VIEW)); scale:
    ViewNumbers (1,).
    """
    views = View.zeros(len(LEGS))
    _views_over(samples, scale, memories, dt, every, views, View.as_table(views), out)


@njit
def _views_over(
    samples: Records[Sample],
    scale: Records[ViewNumbers],
    memories: Records[FootMemory],
    dt: float,
    every: int,
    views: Records[View],
    table: Array,
    out: NDArray[np.floating[Any]],
) -> None:
    for n in range(samples.shape[0]):
        update_views(samples[n].row, samples[n].derived, scale[0], memories, dt, views)
        if n % every == every - 1 and n // every < out.shape[0]:
            out[n // every] = table
