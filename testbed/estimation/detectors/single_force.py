"""Contact of one foot from one force, whatever its size: a hysteresis above a flight level that is
learnt on the way.

Nothing here is in newtons: every bound is a share of the foot's nominal load or a multiple of the
noise that is seen.

    load      the force, smoothed just as much as its noise asks for; a step that the noise cannot
              explain is followed at once
    lost      load below the flight level + a loss's share of the nominal load + how far the level
              may have drifted
    loaded    load above the level of this flight + a loss's share of the nominal load, or the
              break-away force; until it has risen clearly further, falling back is still the same
              flight

The flight level (what the force reads in the air: a zero offset, friction) is learnt from every
flight, by the median of three samples: a lone outlier is none. How far it may have moved by the
next one starts with the break-away force, and is then what it moved from flight to flight, or what
the force swings by within a flight, as where a sensor carries the foot's own mass.

A sample that is no number, or no later than the one before, changes nothing: the state holds. Gaps
are bridged in the same way; the smoothing and the dwell go by the time that has passed, not by the
count of samples.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from testbed.compiled import njit
from testbed.estimation.contact_losses import LOSS_SHARE
from testbed.formats.arrays import Array
from testbed.formats.records import SET, Record, Records, quantity


class FootNumbers(Record):
    """Of one foot."""

    nominal_load = quantity("N", "load of the standing foot")
    breakaway = quantity("N", "error that friction leaves in the force at rest")
    loss_share = quantity("1", "of the nominal load, below which a foot has lost its contact")


class FootState(Record):
    """What is known of one foot."""

    started = quantity("1", "1 once there was a sample")
    contact = quantity("1", "1 loaded, 0 contact lost")
    time = quantity("s", "of the last good sample")
    force = quantity("N", "of the last good sample")
    step = quantity("s", "usual time between two samples")
    noise = quantity("N", "standard deviation of one sample")
    load = quantity("N", "smoothed force")
    before = quantity("N", "the same, one sample ago")
    earlier = quantity("N", "the same, two samples ago")
    middle = quantity("N", "median of the three: a lone outlier is no level of a flight")
    jump = quantity("N", "last sample's deviation, where noise could not explain it; else 0")
    settled = quantity(
        "1", "1 once the load has been clearly above what is lost since the touchdown"
    )
    since = quantity("s", "for how long the load has contradicted the state")
    lowest = quantity("N", "level of the flight that is on")
    flying = quantity("s", "for how long it is on")
    height = quantity("N", "mean of what the force reads above that level in this flight")
    fallen = quantity("s", "for how long the load has been below that of the last touchdown")
    flight = quantity("N", "level of the flights so far")
    spread = quantity("N", "how far that may have moved by the next flight")
    flights = quantity("1", "how many there were")
    watched = quantity("1", "1 where the loss that began the flight that is on was seen")


QUIET = 0.5
"""The smoothed noise may be this share of a loss's force."""
LONGEST_SMOOTHING_S = 0.02
"""Longest time constant of the smoothing (E)."""
JUMP = 5.0
"""Two deviations in a row beyond so many standard deviations are a step of the force, or there and
back a lone outlier (E).
"""
NOISE_S = 0.5
"""Time constant of the noise's estimate (E)."""
MEAN_TO_SD = 0.8862
"""Mean size of the difference of two samples of white noise to its standard deviation: sqrt(pi) /
2.
"""
DWELL_S = 0.004
"""So long a load must contradict the state; one sample is enough where they come more slowly
(E).
"""
MARGIN_SD = 4.0
"""The bounds lie so many standard deviations of the smoothed noise further out (E)."""
BACK = 0.6
"""A foot that touches down slowly is lost again only when it has gone back so far of the way to the
flight level (E).
"""
NEARLY, FALLEN_S = 0.8, 0.05
"""... or when it has been below this share of the way for so long, s (E)."""
FALL_S, RISE_S = 0.02, 1.0
"""The level of a flight follows a falling and a rising load with these time constants (E)."""
FIRST_SPREAD, LEAST_SPREAD, MOST_SPREAD = 0.12, 0.02, 0.30
"""How far a flight level may move, shares of the nominal load: before any flight was seen, at
least, at most (E).
"""
HIGHEST_BOUND, MOST_OFFSET = 0.4, 1.0
"""A load so far above the flight level is never a loss; the level itself is no further from
nothing, shares of the nominal load (E).
"""
MOVED, FORGET = 1.5, 0.5
"""The spread is this multiple of what the level last moved, and shrinks to this share by every
flight (E).
"""
SWING = 2.0
"""... or this multiple of the mean height within the flight: a sine's width (E)."""
FIRST_TRUST, TRUST = 0.8, 0.5
"""So much of a flight's own level goes into that of the flights so far (E)."""
SHORTEST_FLIGHT_S = 0.05
"""A shorter flight teaches nothing of the level (E)."""


@dataclass(frozen=True)
class ForceSample:
    """What a detector of single feet is handed: arrays of one number a foot, (k,)."""

    t: float
    """Time, s."""
    force: Array
    """Load as measured or estimated, N; nan where it is missing."""
    nominal_load: Array
    """Load of the standing foot, N."""
    breakaway: Array
    """Error that friction leaves in the force at rest, N."""


class SingleForce:
    """The contact state of feet from their forces. A Detector of `ForceSample`: a score of 1 is
    lost, 0 loaded.
    """

    name: ClassVar[str] = "single_force"
    text: ClassVar[str] = "hysteresis above the flight level, learnt from one force"
    threshold: ClassVar[float] = 0.5

    def __init__(self, loss_share: float = LOSS_SHARE) -> None:
        self._loss_share = loss_share
        self._numbers, self._state = FootNumbers.zeros(0), FootState.zeros(0)

    def update(self, sample: ForceSample) -> Array:
        """Scores (k,) of this sample."""
        force = np.atleast_1d(np.asarray(sample.force, dtype=np.float64))
        time_s = np.array([sample.t])
        scores = self.over(time_s, force[None, :], sample.nominal_load, sample.breakaway)
        return np.asarray(scores[0])

    def over(
        self, time_s: Array, force_n: Array, nominal_load_n: Array, breakaway_n: Array
    ) -> Array:
        """`update` over samples: times (n,), forces (n, k), scales (k,); scores (n, k)."""
        feet = force_n.shape[1]
        if len(self._state) != feet:
            self._numbers, self._state = FootNumbers.zeros(feet), FootState.zeros(feet)
            self._numbers["loss_share"] = self._loss_share
        self._numbers["nominal_load"], self._numbers["breakaway"] = nominal_load_n, breakaway_n
        scores = np.empty(force_n.shape)
        _detect(time_s, np.ascontiguousarray(force_n), self._numbers, self._state, scores)
        return scores


@njit
def _detect(
    time_s: Array,
    force_n: Array,
    numbers: Records[FootNumbers],
    states: Records[FootState],
    scores: Array,
) -> None:
    for k in range(force_n.shape[0]):
        for foot in range(force_n.shape[1]):
            contact = step(states[foot], time_s[k], force_n[k, foot], numbers[foot])
            scores[k, foot] = 1.0 - contact


@njit
def step(state: FootState, t: float, force: float, foot: FootNumbers) -> float:
    """The contact state after a sample: 1 loaded, 0 lost; nan before the first good sample.

    t in s, force in N.
    """
    if math.isfinite(force) and math.isfinite(t):
        if state.started == 0.0:
            begin(state, t, force, foot)
        elif t > state.time:
            follow(state, t, force, foot)
            judge(state, t - state.time, foot)
            state.time, state.force = t, force
    return float(state.contact) if state.started != 0.0 else math.nan


@njit
def begin(state: FootState, t: float, force: float, foot: FootNumbers) -> None:
    """The first good sample of a foot."""
    state.started, state.time, state.force, state.load = 1.0, t, force, force
    state.before = state.earlier = state.middle = force
    state.spread = foot.breakaway if foot.breakaway > 0.0 else FIRST_SPREAD * foot.nominal_load
    state.lowest = min(force, state.spread)
    bound = foot.loss_share * foot.nominal_load + spread_of(state, foot)
    state.contact = state.settled = 1.0 if force > bound else 0.0


@njit
def follow(state: FootState, t: float, force: float, foot: FootNumbers) -> None:
    """Noise and smoothed load after another sample."""
    dt = t - state.time
    state.earlier, state.before = state.before, state.load
    state.step = dt if state.step == 0.0 else min(max(dt, 0.5 * state.step), 2.0 * state.step)
    size = MEAN_TO_SD * abs(force - state.force)
    if state.noise == 0.0:
        state.noise = min(size, 0.1 * foot.nominal_load)
    seen = min(size, 3.0 * state.noise + 1e-6 * foot.nominal_load)  # a step is no noise
    state.noise += min(state.step / NOISE_S, 0.2) * (seen - state.noise)
    smoothing = smoothing_s(state, foot)
    off = force - state.load
    if abs(off) > JUMP * state.noise and state.jump != 0.0:
        state.load = 0.5 * (force + state.force) if off * state.jump > 0.0 else force
        state.jump = 0.0
    else:
        state.jump = off if abs(off) > JUMP * state.noise else 0.0
        state.load += off * dt / (smoothing + dt)
    low, high = min(state.before, state.earlier), max(state.before, state.earlier)
    state.middle = min(max(state.load, low), high)


@njit
def smoothing_s(state: FootState, foot: FootNumbers) -> float:
    """Time constant that leaves just as much noise as a loss can bear, s."""
    quiet = QUIET * foot.loss_share * foot.nominal_load
    return min(0.5 * state.step * (state.noise / quiet) ** 2, LONGEST_SMOOTHING_S)


@njit
def smoothed_noise(state: FootState, foot: FootNumbers) -> float:
    """Standard deviation of the smoothed load, N."""
    smoothing = smoothing_s(state, foot)
    return state.noise * math.sqrt(state.step / (2.0 * smoothing + state.step))


@njit
def spread_of(state: FootState, foot: FootNumbers) -> float:
    """How far the flight level may have moved, N, within its bounds."""
    nominal = foot.nominal_load
    return min(max(state.spread, LEAST_SPREAD * nominal), MOST_SPREAD * nominal)


@njit
def judge(state: FootState, dt: float, foot: FootNumbers) -> None:
    """The contact state from the load; a flight that ends teaches its level."""
    nominal, noise = foot.nominal_load, MARGIN_SD * smoothed_noise(state, foot)
    share = foot.loss_share * nominal
    margin = max(spread_of(state, foot), noise)
    lost = state.flight + min(share + margin, HIGHEST_BOUND * nominal)
    rise = max(share, min(foot.breakaway, MOST_SPREAD * nominal)) + noise
    if state.contact > SET:
        if state.load > lost + rise:
            state.settled = 1.0
        fell_back = state.settled == 0.0 and state.load < state.lowest + NEARLY * rise
        state.fallen = state.fallen + dt if fell_back else 0.0
        again = state.lowest + (NEARLY if state.fallen >= FALLEN_S else BACK) * rise
        contradicts = state.load < (lost if state.settled != 0.0 else again)
        pulls = state.before + state.jump < state.flight - MOST_SPREAD * nominal
        if state.jump != 0.0 and pulls:  # no foot does: wait whether the next sample says so too
            contradicts = False
    else:
        state.flying += dt
        above = state.middle - state.lowest
        state.height += min(dt / state.flying, 1.0) * (max(above, 0.0) - state.height)
        state.lowest += above * dt / ((FALL_S if above < 0.0 else RISE_S) + dt)
        state.lowest = min(state.lowest, lost)
        contradicts = state.load > state.lowest + rise
    state.since = state.since + dt if contradicts else 0.0
    if not contradicts or (state.since < DWELL_S and dt < DWELL_S):
        return
    if state.contact > SET:
        if state.settled != 0.0:  # else it is the flight before that goes on
            state.lowest = state.middle
        state.flying = state.height = 0.0
        state.watched = 1.0
    elif state.flying >= SHORTEST_FLIGHT_S:
        learn(state, foot)
    state.contact, state.since, state.settled = 1.0 - state.contact, 0.0, 0.0


@njit
def learn(state: FootState, foot: FootNumbers) -> None:
    """The flight level after a flight, and how far it moves from one to the next.

    A flight that was on already at the first sample says where its level is, and not how far an
    unloading foot leaves it from there: seals may have relaxed before.
    """
    most = MOST_OFFSET * foot.nominal_load
    level = min(max(state.lowest, -most), most)
    moved = max(MOVED * abs(level - state.flight), SWING * state.height)
    kept = FORGET if state.watched != 0.0 else 1.0
    state.spread = max(moved, kept * state.spread)
    state.flight += (FIRST_TRUST if state.flights == 0.0 else TRUST) * (level - state.flight)
    state.flights += 1.0
