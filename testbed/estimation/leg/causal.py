"""The external force of one leg from what had arrived when each sample came.

Every channel is low-passed at the recording's own times, however far apart they are. The usual
distance of two samples is that of the first ones. A stretch behind a gap begins
anew. What the piston did before a stretch nobody saw: it is taken to have moved straight on at the
speed that the first samples say, and the interval holds what this may miss.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from testbed.effects.friction_presliding import SOUND_BEND_M
from testbed.effects.terms import Signals
from testbed.estimation.leg.balance import (
    FIRST_SLIDE_S,
    LEAST_WEIGHT,
    MARGIN_S,
    MOVING_M_S,
    OUTPUT_WIDTH_S,
    Balance,
    balance_of,
    travel_since_reversal,
)
from testbed.estimation.leg.gaps import before_gaps
from testbed.estimation.leg.motion import WIDTH_S
from testbed.formats.arrays import Array, Flags
from testbed.formats.intervals import Z90
from testbed.laws.low_pass import causal_slope, low_passed, steps_of
from testbed.recording.axis import FINEST_COUNT_M, Recording
from testbed.recording.checks import usual_step_s
from testbed.recording.known import Known
from testbed.recording.leg_model import LegModel

FORGOTTEN = 30.0
"""Widths of a low-pass behind which nothing of its start is left."""
FIT_S = 0.04
"""Over so long a start the speed before it is sought, s."""
SURE = 2.0
"""Standard deviations by which a speed must differ from none, or from too little."""
MISSED, CLEAR = 0.75, 3.0
"""Counts by which a line may miss the motion over its length, and how many of that it must rise for
a motion (chosen on twelve swings)."""
FASTEST_M_S = 0.5
"""Of pistons whose speed nobody knows yet (E)."""
LIVELY_M_S2 = 2.0
"""Acceleration of pistons while nobody knows it yet (E)."""
LEAST_COUNT_M = 2e-5
"""What positions without counts are known to (E)."""


def causal_force(recording: Recording, model: LegModel) -> tuple[Array, Array, Array]:
    """(value, low, high) in N, each of shape (n,): each from this sample and those before it."""
    usual_s = usual_step_s(recording.time_s)
    count_m = causal_counts(recording)
    ends = [0, *(before_gaps(recording.time_s, usual_s) + 1), len(recording)]
    told: list[tuple[Array, Array, Array]] = []
    for first, last in itertools.pairwise(ends):
        rows, before_n = slice(first, last), told[-1][0][-1] if told else 0.0
        part = recording.part(rows, recording.name)
        told.append(_of_stretch(part, model, usual_s, count_m[rows], before_n))
    value, low, high = (np.concatenate(series) for series in zip(*told, strict=True))
    return value, low, high


def causal_counts(recording: Recording) -> Array:
    """The encoder's step, m, (n,): as declared, else the smallest seen so far; infinite before the
    first.
    """
    declared = recording.header.channels["position"].resolution
    if declared is not None:
        return np.full(len(recording), declared)
    steps = np.abs(np.diff(recording.position_m, prepend=recording.position_m[:1]))
    least = np.minimum.accumulate(np.where(steps > 0.0, steps, np.inf))
    return np.where(least > FINEST_COUNT_M, least, 0.0)


def _of_stretch(
    recording: Recording, model: LegModel, usual_s: float, count_m: Array, before_n: float
) -> tuple[Array, Array, Array]:
    steps = steps_of(recording.time_s, usual_s)
    signals = causal_signals(recording, model.known, usual_s, count_m)
    balance = balance_of(signals, model)
    moving = sure_of_friction(balance.signals, steps, np.minimum(1.2 * count_m, SOUND_BEND_M))
    least, most = balance.resting_n
    held = np.clip(held_n(balance.sliding_n, moving, steps, usual_s, before_n), least, most)
    # What was taken for friction at rest until then is not carried into a slide.
    early = np.flatnonzero(moving & (recording.time_s < recording.time_s[0] + FIRST_SLIDE_S))
    begins = int(early[0]) if early.size else 0

    def output(values: Array) -> Array:
        apart = (
            low_passed(values[rows], steps[rows], usual_s, OUTPUT_WIDTH_S)
            for rows in (slice(begins), slice(begins, None))
            if values[rows].size
        )
        return np.concatenate([*apart])

    value = output(np.where(moving, balance.sliding_n, held))
    wider = unsure_n(balance, model)
    wider = np.where(wider > 0.0, output(wider), 0.0)
    low = np.where(moving, value, np.minimum(least, value)) - wider
    high = np.where(moving, value, np.maximum(most, value)) + wider
    return value, low, high


def causal_signals(recording: Recording, known: Known, usual_s: float, count_m: Array) -> Signals:
    """All channels of a stretch low-passed alike, at its own times."""
    time = recording.time_s
    steps = steps_of(time, usual_s)
    width_s = max(WIDTH_S, 1.2 * usual_s)

    def channel(values: Array | None) -> Array | None:
        return None if values is None else low_passed(values, steps, usual_s, width_s)

    position = low_passed(recording.position_m, steps, usual_s, width_s)
    # Steps of unlike length: the slope of what is smooth already would be divided by short ones.
    velocity = low_passed(causal_slope(recording.position_m, steps), steps, usual_s, width_s)
    acceleration = causal_slope(velocity, steps)
    start = start_of(recording, steps, usual_s, width_s, count_m)
    return Signals(
        time_s=time,
        rate_hz=1.0 / usual_s,
        known=known,
        position_m=position + start.position_m,
        velocity_m_s=velocity + start.velocity_m_s,
        acceleration_m_s2=acceleration + start.acceleration_m_s2,
        pressure_a_pa=channel(recording.pressure_a_pa),
        pressure_b_pa=channel(recording.pressure_b_pa),
        supply_pressure_pa=channel(recording.supply_pressure_pa),
        oil_temperature_degc=channel(recording.oil_temperature_degc),
        valve_command=recording.valve_command,
        actuator_force_n=channel(recording.actuator_force_n),
        began_s=recording.began_s,
        causal=True,
        speed_sd_m_s=start.speed_sd_m_s,
        acceleration_sd_m_s2=start.acceleration_sd_m_s2,
    )


class Start(NamedTuple):
    """What a start in motion adds to a motion that began at rest, and how well that is known; (n,)
    each.
    """

    position_m: Array
    velocity_m_s: Array
    acceleration_m_s2: Array
    speed_sd_m_s: Array
    acceleration_sd_m_s2: Array


def start_of(
    recording: Recording, steps_s: Array, usual_s: float, width_s: float, count_m: Array
) -> Start:
    """The piston moved straight on before the first sample, at the speed that is known so far.

    What the low-passes make of a motion at 1 m/s until the start is added once for each m/s.
    """
    since = recording.time_s - recording.time_s[0]
    speed, speed_sd = speed_before(since, recording.position_m, count_m)
    place = low_passed(np.zeros_like(since), steps_s, usual_s, width_s, slope=1.0)
    rate = low_passed(np.eye(1, len(since))[0], steps_s, usual_s, width_s)
    bend = causal_slope(rate, steps_s)
    place, rate, bend = (
        np.where(since < FORGOTTEN * width_s, series, 0.0) for series in (place, rate, bend)
    )
    return Start(
        speed * place,
        speed * rate,
        speed * bend,
        speed_sd * rate,
        np.hypot(speed_sd * bend, LIVELY_M_S2 * rate),
    )


def speed_before(since_s: Array, position_m: Array, count_m: Array) -> tuple[Array, Array]:
    """Speed at a start and its standard deviation, m/s, (n,), as known so far: the slope of the
    line through all samples of the first FIT_S, once it spans more counts than an encoder may miss.
    """
    last = np.minimum(np.arange(len(since_s)), np.searchsorted(since_s, FIT_S, side="right") - 1)
    moved = position_m - position_m[0]
    samples = np.arange(1.0, len(since_s) + 1.0)
    sum_t, sum_x = np.cumsum(since_s), np.cumsum(moved)
    spread = samples * np.cumsum(since_s**2) - sum_t**2
    along = samples * np.cumsum(since_s * moved) - sum_t * sum_x
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = np.where(spread > 0.0, along / spread, 0.0)[last]
        sd = MISSED * np.maximum(count_m, LEAST_COUNT_M)[last] / since_s[last]
    sd = np.minimum(np.where(np.isfinite(sd), sd, np.inf), 0.5 * FASTEST_M_S)
    known = np.abs(slope) > CLEAR * sd
    return np.where(known, slope, 0.0), np.where(known, sd, 2.0 * sd)


def sure_of_friction(signals: Signals, steps_s: Array, travel_m: Array) -> Flags:
    """Samples whose friction is certain, (n,): fast enough, for as long as the low-passes are late
    behind a reversal, and far enough behind it for friction to have built up on the new side. One
    whose speed nobody knows yet is neither certain nor a reversal.
    """
    speed, usual_s = np.abs(signals.velocity_m_s), 1.0 / signals.rate_hz
    assert signals.speed_sd_m_s is not None
    unsure = SURE * signals.speed_sd_m_s
    fast = travel_since_reversal(signals.velocity_m_s, steps_s) > travel_m
    slow = ((speed <= MOVING_M_S) | ~fast) & (unsure < MOVING_M_S)
    since = np.cumsum(steps_s)
    last_slow = np.maximum.accumulate(np.where(slow, since, -np.inf))
    reach_s = (round(MARGIN_S / usual_s) + 0.5) * usual_s
    fast &= (speed > MOVING_M_S + unsure) & (since - last_slow > reach_s)
    return np.asarray(fast, dtype=np.bool_)


def held_n(
    sliding_n: Array, moving: Flags, steps_s: Array, usual_s: float, before_n: float
) -> Array:
    """The force of moving samples, averaged over those just before; held while there are none: a
    foot at rest on firm ground feels the load that it had when it stopped. `before_n`: until there
    are some.
    """
    weight = low_passed(moving.astype(np.float64), steps_s, usual_s, OUTPUT_WIDTH_S)
    sums = low_passed(np.where(moving, sliding_n, 0.0), steps_s, usual_s, OUTPUT_WIDTH_S)
    known = weight > LEAST_WEIGHT
    last = np.maximum.accumulate(np.where(known, np.arange(len(known)), -1))
    mean = sums / np.maximum(weight, 1e-6)
    return np.asarray(np.where(last >= 0, mean[np.maximum(last, 0)], before_n), dtype=np.float64)


def unsure_n(balance: Balance, model: LegModel) -> Array:
    """By how much a force may lie beside its set either way, N, (n,), for what is not known of the
    motion: 0 but at a start.
    """
    signals, terms, friction = balance.signals, balance.terms, model.friction
    assert signals.speed_sd_m_s is not None and signals.acceleration_sd_m_s2 is not None
    slope = max(friction.viscous_plus_n_s_m, friction.viscous_minus_n_s_m) * terms.viscous_scale
    mass = terms.mass_kg + terms.added_mass_kg
    sd = np.hypot(mass * signals.acceleration_sd_m_s2, slope * signals.speed_sd_m_s)
    return np.asarray(Z90 * sd, dtype=np.float64)
