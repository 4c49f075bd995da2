"""Early warning: the load is low for this foot, falls, and will soon be gone before anything known
ends its fall.

A critically damped alpha-beta filter gives level L and slope V of each foot's load, and the rate of
the ordered thrust. What the thrust may explain of a fall, at most `kappa` of its rate, ends when
the thrust stops rising, which the drill's program knows beforehand; the rest may go on. A warning
is raised where

    L + V_thrust min(look_thrust, rising, left) + V_rest min(look, left) < warn at,
    V_rest = min(V + kappa max(thrust rate, 0), 0),  V_thrust = V - V_rest

`left` is the time until the foot across has nothing left to give: (L_o - gone) / -V_o, 0 where it
is gone. Feet across from each other share a twist and fall together; once one hangs free the other
bears what statics give it, and its fall ends. So only the first of them is warned of.

A foot that the control is about to lift is warned of by that order alone, before it unloads.

A warning stands for two seconds at least, and until the load is back. The score is 1 while it
stands, else 0.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.formats.arrays import Array
from testbed.formats.records import SET, Record, Records, part, quantity
from testbed.machine.names import LEGS

BACK = 2.0
"""A warning ends once the load is back at this many times the share of what is usual."""
STANDS_LEAST_S = 2.0
"""How long a warning speaks for."""
MEAN_S = 0.02
"""Time constant of a foot's mean."""
MEMORY_S = 15.0
"""Time constant of the memory of the most that a foot bore."""


class Seen(Record):
    """What the warning looks at, means of one step; 0 where nothing is known of thrust and
    orders.
    """

    load = quantity("N", "of the foot", per=LEGS)
    thrust = quantity("N", "ordered thrust")
    rising = quantity("s", "how long it still rises")
    lifted = quantity("1", "1 for a foot that the control lifts or holds up", per=LEGS)


class WarningNumbers(Record):
    """Of the rule."""

    smooth = quantity("s", "time constant of the filter")
    share = quantity("1", "of the usual load, below which a foot is low")
    look = quantity("s", "how far to look ahead")
    look_thrust = quantity("s", "the same under a rising thrust")
    warn_at = quantity("N", "predicted load below which to warn")
    usual = quantity("s", "time over which a load is usual")
    gone = quantity("N", "load at which the foot across counts as gone")
    kappa = quantity("1", "largest share of a thrust that a foot feels")
    step = quantity("s", "between two means")
    least = quantity("N", "what a foot must have borne")


class Line(Record):
    """A level and its slope, by an alpha-beta filter."""

    level = quantity("N", "level")
    slope = quantity("N/s", "its change")


class WarningState(Record):
    """Of one foot."""

    load = part(Line, "its load")
    thrust = part(Line, "the ordered thrust")
    mean = quantity("N", "mean load")
    was = quantity("N", "the most that the foot bore of late")
    usual = quantity("N", "usual load")
    stands = quantity("s", "for how long a warning has stood; 0: none does")
    started = quantity("1", "1 once there was a sample")


STEP_S = 5.0e-3
NUMBERS: Mapping[str, float] = MappingProxyType(
    {
        "smooth": 0.105,
        "share": 0.346,
        "look": 0.2576,
        "look_thrust": 0.392,
        "warn_at": 280.0,
        "usual": 5.77,
        "gone": -93.0,
        "kappa": 0.7,
        "step": STEP_S,
        "least": 1694.0,
    }
)
"""On means of five milliseconds of the own estimate; set on 167 tuning scenes so that of the
warnings as many as can be are right while seven in ten gradual losses are warned of in time."""
NUMBERS_ON_TRUTH: Mapping[str, float] = MappingProxyType(
    {**NUMBERS, "smooth": 0.06, "share": 0.25, "warn_at": 350.0, "gone": 20.0, "least": 1600.0}
)
"""The rule's numbers for one who knows the true load: what perfect sensors would bring it."""


@njit
def alpha_beta(line: Line, value: float, numbers: WarningNumbers) -> None:
    """One sample into the level and its slope."""
    keep = math.exp(-numbers.step / numbers.smooth)
    foreseen = line.level + line.slope * numbers.step
    line.level = foreseen + (1.0 - keep * keep) * (value - foreseen)
    line.slope += (1.0 - keep) ** 2 * (value - foreseen) / numbers.step


@njit
def follow(state: WarningState, load: float, thrust: float, numbers: WarningNumbers) -> None:
    """One sample into the state of one foot."""
    if state.started == 0.0:
        state.load.level = state.mean = state.was = state.usual = load
        state.thrust.level, state.started = thrust, 1.0
    alpha_beta(state.load, load, numbers)
    alpha_beta(state.thrust, thrust, numbers)
    state.mean += (load - state.mean) * min(numbers.step / MEAN_S, 1.0)
    state.was = max(state.mean, state.was * (1.0 - numbers.step / MEMORY_S))
    state.usual += (load - state.usual) * numbers.step / numbers.usual


@njit
def time_left_s(across: WarningState, numbers: WarningNumbers) -> float:
    """Seconds until the foot across is gone, at most the longest look."""
    left = max(numbers.look, numbers.look_thrust)
    if across.mean <= numbers.gone:
        left = 0.0
    elif across.load.slope < 0.0:
        left = min(left, max(across.load.level - numbers.gone, 0.0) / -across.load.slope)
    return left


@njit
def foreseen_n(
    state: WarningState, left_s: float, rising_s: float, numbers: WarningNumbers
) -> float:
    """Load at the end of the look ahead, N."""
    slope = state.load.slope
    rest = min(slope + numbers.kappa * max(state.thrust.slope, 0.0), 0.0)
    by_thrust = min(slope, 0.0) - rest
    thrust_s = min(numbers.look_thrust, min(rising_s, left_s))
    return state.load.level + by_thrust * thrust_s + rest * min(numbers.look, left_s)


@njit
def step(seen: Seen, states: Records[WarningState], numbers: WarningNumbers, score: Array) -> None:
    """One sample: Seen, WarningState (4) -> score (4)."""
    for foot in range(4):
        follow(states[foot], seen.load[foot], seen.thrust, numbers)
    for foot in range(4):
        state = states[foot]
        low = numbers.share * state.usual
        if state.stands > 0.0:
            state.stands += numbers.step
            back = state.load.level > BACK * low and seen.lifted[foot] <= SET
            if state.stands > STANDS_LEAST_S and back:
                state.stands = 0.0
        elif seen.lifted[foot] > SET:
            state.stands = numbers.step
        elif state.was >= numbers.least and state.load.level < low and state.load.slope < 0.0:
            left = time_left_s(states[3 - foot], numbers)
            if left > 0.0 and foreseen_n(state, left, seen.rising, numbers) < numbers.warn_at:
                state.stands = numbers.step
        score[foot] = 1.0 if state.stands > 0.0 else 0.0


@njit
def _run(
    seen: Records[Seen],
    states: Records[WarningState],
    numbers: Records[WarningNumbers],
    score: Array,
) -> None:
    for n in range(seen.shape[0]):
        step(seen[n], states, numbers[0], score[n])


def raised(seen: NDArray[Any], numbers: Mapping[str, float] = NUMBERS) -> Array:
    """1 while a warning of a foot stands, else 0, (n, 4); `seen`: Seen (n,)."""
    score = np.zeros((len(seen), len(LEGS)))
    _run(seen, WarningState.zeros(len(LEGS)), WarningNumbers.one(**numbers), score)
    return score
