"""What the learned detector knows of a foot's own past: fast changes against a slow baseline.

A sensor that drifts moves a load for ever, friction by no more than the break-away force: what
`carried` differs from `own` beyond that, over ten seconds, is taken for the sensor's and given back
(as in combined.py). No load is less than nothing: by what the least of the last ten seconds lies
below that, the zero is off. How long ago the foot was low, and for which share of the last seconds,
tells a foot that bounces from one that stands; how much it is stirred beside the other feet one
that hangs from one that bears little.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from testbed.compiled import njit
from testbed.estimation.detectors.combined import beyond
from testbed.formats.records import Record, Records, quantity
from testbed.machine.names import LEGS

if TYPE_CHECKING:
    from testbed.estimation.detectors.foot_view import FootMemory


SETTLED = ("10_ms", "50_ms")
SETTLED_S = (0.01, 0.05)
SINCE = ("below", "well_below", "well_above")
SINCE_LOSSES = (1.0, -0.5, 5.0)
"""Below and well below the loss force, and well above it: of the held load, of the held load and of
`own`, levels in shares of the loss force (E).
"""
BREAK_AWAY = 2.72
"""What friction explains of a difference of loads, shares of the loss force: 800 N of 294 N."""
HELD_S, HELD_OWN = 0.005, 0.83
"""Time constant of the held load, and the weight of `own` in it (combined.py)."""
LEAST_S, MOST_S, SHARE_S, SPEED_S = 10.0, 2.0, 2.0, 0.05
"""Time constants: of the least and the most that a foot bore; of the share of the time in which it
was low; of the piston's speed, s (E).
"""
LONGEST_S, SHORTEST_S = 20.0, 0.02
"""Nothing is longer ago; what is shorter ago hardly differs from now, s (E)."""
LITTLE, SURE = 0.017, 0.17
"""A stir, and a standard deviation, that count as none, shares of the loss force (E)."""


class HistoryView(Record):
    """What the network sees of a foot's past; "free" is `carried` without drift. Loads go through
    arsinh(load / loss force), differences through tanh, ratios and times through a logarithm.
    """

    free = quantity("1", "running means of `carried` without drift", per=SETTLED)
    above_zero = quantity("1", "`own` above its zero")
    least_own = quantity("1", "least of `own` of the last 10 s")
    free_above_zero = quantity("1", "`carried` without drift, above its zero")
    least_free = quantity("1", "least of `carried` without drift of the last 10 s")
    beside = quantity("1", "how much `carried` is stirred beside all feet", per=SETTLED)
    all_feet = quantity("1", "how much `carried` of all feet is stirred", per=SETTLED)
    since = quantity("1", "how long ago the foot was there", per=SINCE)
    low = quantity("1", "share of the last 2 s in which it was below the loss force")
    most_own = quantity("1", "most of `own` of the last 2 s")
    held = quantity("1", "held load")
    fall = quantity("1", "`own` over 10 ms less over 50 ms")
    free_fall = quantity("1", "`carried` over 10 ms less over 50 ms")
    quick_fall = quantity("1", "`own` over 2 ms less over 10 ms")
    surely_lost = quantity("1", "how sure `own` is below the loss force")
    diagonal = quantity("1", "internal force of all feet beyond the expected")
    speed = quantity("1", "size of the piston's speed")


class History(Record):
    """Of one foot."""

    settled = quantity("N", "running means of `carried` without drift", per=SETTLED)
    held = quantity("N", "running mean of `own` and `carried` without drift")
    least_own = quantity("N", "least of `own` of the last 10 s")
    least_settled = quantity("N", "least of `carried` without drift")
    most_own = quantity("N", "most of `own` of the last 2 s")
    since = quantity("s", "how long ago", per=SINCE)
    low = quantity("1", "share of the time below the loss force")
    speed = quantity("m/s", "mean size of the piston's speed")


@njit
def _moved(mean: float, value: float, dt: float, time_s: float, fresh: bool) -> float:
    """A running mean after one more sample; `fresh`: its first."""
    return value if fresh else mean + dt / (time_s + dt) * (value - mean)


@njit
def remember_history(
    own: float,
    carried: float,
    speed: float,
    unit: float,
    memory: FootMemory,
    fresh: bool,
    dt: float,
) -> None:
    """One sample into `memory.history` of a foot, whose running means already hold it; `unit`: loss
    force, N.
    """
    history = memory.history
    free = carried + unit * beyond(memory.behind[0] / unit, BREAK_AWAY)
    for k in range(2):
        history.settled[k] = _moved(history.settled[k], free, dt, SETTLED_S[k], fresh)
    held = HELD_OWN * own + (1.0 - HELD_OWN) * free
    history.held = _moved(history.held, held, dt, HELD_S, fresh)
    own_10, own_50 = memory.means[0, 1], memory.means[0, 2]
    least = _moved(history.least_own, own_50, dt, LEAST_S, fresh)
    history.least_own = min(least, own_50)
    least = _moved(history.least_settled, history.settled[1], dt, LEAST_S, fresh)
    history.least_settled = min(least, history.settled[1])
    history.most_own = max(_moved(history.most_own, own_10, dt, MOST_S, fresh), own_10)
    for k in range(3):
        level = SINCE_LOSSES[k] * unit
        now = own_10 > level if k == 2 else history.held < level
        before = LONGEST_S if fresh else history.since[k]
        history.since[k] = 0.0 if now else min(before + dt, LONGEST_S)
    low = 1.0 if history.held < unit else 0.0
    history.low = _moved(history.low, low, dt, SHARE_S, fresh)
    history.speed = _moved(history.speed, abs(speed), dt, SPEED_S, fresh)


@njit
def stirred_on_average(memories: Records[FootMemory], kind: int) -> float:
    """Mean over the feet of how much `carried` is stirred, N; kind: place in views.STIRRED."""
    total = 0.0
    for foot in range(len(LEGS)):
        total += memories[foot].stirred[kind]
    return total / len(LEGS)


@njit
def view_of_history(
    memories: Records[FootMemory], foot: int, sd: float, unit: float, view: HistoryView
) -> None:
    """Into `view`: what the foot's history says; `sd`: of `own`, N."""
    memory = memories[foot]
    history, means = memory.history, memory.means
    settled, own_10 = history.settled, means[0, 1]
    for k in range(2):
        stir, all_feet = memory.stirred[2 * k], stirred_on_average(memories, 2 * k)
        view.free[k] = math.asinh(settled[k] / unit)
        view.beside[k] = math.log((stir + LITTLE * unit) / (all_feet + LITTLE * unit))
        view.all_feet[k] = math.asinh(all_feet / unit)
    view.above_zero = math.asinh((own_10 - min(history.least_own, 0.0)) / unit)
    view.least_own = math.asinh(history.least_own / unit)
    view.free_above_zero = math.asinh((settled[0] - min(history.least_settled, 0.0)) / unit)
    view.least_free = math.asinh(history.least_settled / unit)
    for k in range(3):
        view.since[k] = math.log10(1.0 + history.since[k] / SHORTEST_S)
    view.low, view.most_own = history.low, math.asinh(history.most_own / unit)
    view.held = math.asinh(history.held / unit)
    view.fall = math.tanh((own_10 - means[0, 2]) / unit)
    view.free_fall = math.tanh((settled[0] - settled[1]) / unit)
    view.quick_fall = math.tanh((means[0, 0] - own_10) / unit)
    view.surely_lost = math.tanh(0.5 * (unit - own_10) / max(sd, SURE * unit))
    diagonal = memories[0].beyond - memories[1].beyond - memories[2].beyond + memories[3].beyond
    view.diagonal = math.asinh((diagonal if foot in (0, 3) else -diagonal) / unit)
    view.speed = math.log1p(1000.0 * history.speed)
