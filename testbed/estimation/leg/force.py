"""The external force of one leg from a recording and a believed model: a value, and a set at rest.

Where the piston moves, friction is known and so is the force. Around a reversal and at rest
friction is a set; there the value is the one nearest to the forces before and after that friction
allows, so that no jump of the friction's sign leaks into the force of the moving samples beside it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from testbed.effects import build
from testbed.effects.friction_presliding import SOUND_BEND_M
from testbed.effects.terms import Signals
from testbed.estimation.leg.balance import (
    LEAST_WEIGHT,
    MARGIN_S,
    MOVING_M_S,
    OUTPUT_WIDTH_S,
    balance_of,
    travel_since_reversal,
)
from testbed.estimation.leg.causal import causal_force
from testbed.estimation.leg.gaps import stretches
from testbed.estimation.leg.motion import grid, signals_of, smooth
from testbed.estimation.leg.oil_motion import FUSED_WIDTH_S, can_fuse, fused
from testbed.formats.arrays import Array, Flags
from testbed.recording.axis import Recording
from testbed.recording.leg_model import LegModel

SLIDING_M_S, SLIDING_S = 4e-4, 0.05
"""A piston that goes on faster than this in one direction for longer slides, though slowly:
friction's side is known. (A quick reversal is slow for a moment too, but does not slide.)"""
FUSED_MARGIN_S = 0.002
"""MARGIN_S where the oil tells the quick part of the velocity."""
QUICK_WIDTH_S = 0.0015
QUICK_FUSED_WIDTH_S, QUICK_OUTPUT_WIDTH_S = 0.001, 0.0005
QUICK_TRAVEL_M = 0.0
QUICK_SPAN_N = 500.0
"""A force that changes by more within 30 ms is followed with the quick widths instead of
OUTPUT_WIDTH_S: channels and output each QUICK_WIDTH_S, or the other two where the oil tells the
velocity."""


@dataclass(frozen=True)
class ForceEstimate:
    """External force along the axis, N, positive when the ground pushes the foot up; one row a
    sample, shape (n,).
    """

    time_s: Array
    force_n: Array
    force_low_n: Array
    force_high_n: Array

    def columns(self) -> dict[str, Array]:
        """As the output file carries them."""
        return {
            "t": self.time_s,
            "force_n": self.force_n,
            "force_low_n": self.force_low_n,
            "force_high_n": self.force_high_n,
        }


def estimate(recording: Recording, model: LegModel, causal: bool = False) -> ForceEstimate:
    """External force from a recording, each stretch between gaps by itself; `causal`: each sample
    from what had arrived by then. Raises InputError for a model with an unknown effect or
    parameter.
    """
    build(model.effects)
    if causal:
        return ForceEstimate(recording.time_s, *causal_force(recording, model))
    found = [_of_stretch(part, model).columns() for part in stretches(recording)]
    time, *forces = (np.concatenate([part[name] for part in found]) for name in found[0])
    return ForceEstimate(time, *forces)


def _of_stretch(recording: Recording, model: LegModel) -> ForceEstimate:
    by_oil = fused(recording, model, FUSED_WIDTH_S) if can_fuse(recording, model) else None
    signals = signals_of(recording, model.known) if by_oil is None else by_oil
    margin = MARGIN_S if by_oil is None else FUSED_MARGIN_S
    value, low, high = force_of(
        signals, model, margin_s=margin, travel_m=unseen_travel_m(recording)
    )
    quick = None if by_oil is None else fused(recording, model, QUICK_FUSED_WIDTH_S)
    width = QUICK_WIDTH_S if quick is None else QUICK_OUTPUT_WIDTH_S
    if quick is None:
        quick = signals_of(recording, model.known, QUICK_WIDTH_S)
    sharp, _, _ = force_of(
        quick, model, output_width_s=width, margin_s=margin, travel_m=QUICK_TRAVEL_M
    )
    shift = share_of_quick(value, signals.rate_hz) * (sharp - value)
    value, low, high = value + shift, low + shift, high + shift
    time, _ = grid(recording)
    if time is not recording.time_s:
        value, low, high = (
            np.interp(recording.time_s, time, series) for series in (value, low, high)
        )
    return ForceEstimate(recording.time_s, value, np.minimum(low, value), np.maximum(high, value))


def unseen_travel_m(recording: Recording) -> float:
    """Distance behind a reversal within which this recording's encoder does not show how friction
    builds up, m.
    """
    return min(SOUND_BEND_M, 1.2 * recording.position_resolution_m)


def share_of_quick(force_n: Array, rate_hz: float) -> Array:
    """Share of the less smoothed estimate, 0 to 1, shape (n,): 1 where the force itself changes
    within 20 ms.

    Noise and ringing do not raise it, a landing or lifting foot does.
    """
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    reach = 2 * round(0.015 * rate_hz) + 1
    span = maximum_filter1d(force_n, reach) - minimum_filter1d(force_n, reach)
    return smooth(1.0 / (1.0 + (QUICK_SPAN_N / np.maximum(span, 1e-9)) ** 4), 0.004 * rate_hz)


def force_of(
    signals: Signals,
    model: LegModel,
    output_width_s: float | None = None,
    margin_s: float = MARGIN_S,
    travel_m: float = SOUND_BEND_M,
) -> tuple[Array, Array, Array]:
    """(value, low, high) in N, each of shape (n,), for signals on a uniform grid."""
    balance = balance_of(signals, model)
    signals, terms = balance.signals, balance.terms
    moving = trusted(signals.velocity_m_s, signals.rate_hz, margin_s, travel_m)
    sliding = moving | slow_slides(signals.velocity_m_s, signals.rate_hz, travel_m)
    width = (OUTPUT_WIDTH_S if output_width_s is None else output_width_s) * signals.rate_hz
    raw = balance.sliding_n
    for frequency, amplitude, harmonics in terms.narrow_bands:
        raw = raw - narrow_band(raw, moving, signals, frequency, harmonics, amplitude)
    first = _fill(raw, sliding, width)
    least, most = balance.resting_n
    value = smooth(np.where(sliding, raw, np.clip(first, least, most)), width)
    low = np.where(moving, value, np.minimum(least, value))
    high = np.where(moving, value, np.maximum(most, value))
    return value, low, high


def trusted(
    velocity_m_s: Array,
    rate_hz: float,
    margin_s: float = MARGIN_S,
    travel_m: float = SOUND_BEND_M,
    speed_m_s: float = MOVING_M_S,
) -> Flags:
    """Samples whose friction is certain, shape (n,): fast enough, not within a margin of a
    reversal, and far enough behind it for friction to have built up on the new side.
    """
    from scipy.ndimage import binary_erosion

    fast = np.abs(velocity_m_s) > speed_m_s
    fast &= travel_since_reversal(velocity_m_s, 1.0 / rate_hz) > travel_m
    reach = round(margin_s * rate_hz)
    if reach == 0:
        return np.asarray(fast, dtype=np.bool_)
    return np.asarray(binary_erosion(fast, np.ones(2 * reach + 1), border_value=1), dtype=np.bool_)


def slow_slides(velocity_m_s: Array, rate_hz: float, travel_m: float) -> Flags:
    """Samples of slow slides that last, shape (n,)."""
    from scipy.ndimage import binary_opening

    slow = trusted(velocity_m_s, rate_hz, MARGIN_S, travel_m, speed_m_s=SLIDING_M_S)
    slow &= np.cumsum(np.abs(velocity_m_s)) / rate_hz > travel_m
    return np.asarray(
        binary_opening(slow, np.ones(max(round(SLIDING_S * rate_hz), 1))), dtype=np.bool_
    )


def _fill(raw: Array, good: Flags, width: float) -> Array:
    """`raw` averaged over good samples near by. Over gaps it is held: a foot at rest on firm ground
    feels the load that it had when it stopped, and the first samples behind a gap may already
    belong to a foot that lifts.
    """
    if not good.any():
        return np.zeros_like(raw)
    weight = smooth(good.astype(np.float64), width)
    known = weight > LEAST_WEIGHT
    mean = smooth(np.where(good, raw, 0.0), width) / np.maximum(weight, 1e-6)
    last = np.maximum.accumulate(np.where(known, np.arange(len(raw)), -1))
    before = mean[int(np.argmax(known))]
    return np.asarray(np.where(last >= 0, mean[np.maximum(last, 0)], before), dtype=np.float64)


BAND_LIMIT = 2.5
NARROW_WIDTH_S = 2.0
"""The amplitude and phase of a narrow-band force may change within this time."""


def narrow_band(
    raw: Array,
    good: Flags,
    signals: Signals,
    frequency: float,
    harmonics: int = 1,
    amplitude: float = np.inf,
) -> Array:
    """The narrow-band part of a force around a frequency and its multiples, N, shape (n,): local
    amplitude, phase.
    """
    rate = signals.rate_hz
    seconds = signals.time_s - signals.time_s[0]
    chunk = max(1, round(0.1 * rate))
    width = NARROW_WIDTH_S * rate / chunk
    weight = np.maximum(smooth(_chunks(good.astype(np.float64), chunk), width), 1e-3)
    clean = raw - _moving_mean(raw, good, round(rate / max(frequency, 0.1)))
    # A landing foot is no vibration: what is far beyond the band's amplitude must not ring in it.
    clean = np.clip(clean, -BAND_LIMIT * amplitude, BAND_LIMIT * amplitude)
    middle = (np.arange(len(weight)) + 0.5) * chunk - 0.5
    index = np.arange(len(raw), dtype=np.float64)
    out = np.zeros_like(raw)
    for multiple in range(1, harmonics + 1):
        phase = 2.0 * np.pi * frequency * multiple * seconds
        for wave in (np.cos(phase), np.sin(phase)):
            share = smooth(_chunks(np.where(good, clean * wave, 0.0), chunk), width) / weight
            out += 2.0 * np.interp(index, middle, share) * wave
    return out


def _moving_mean(raw: Array, good: Flags, width: int) -> Array:
    """Mean over the good samples of one period around each sample, shape (n,)."""
    reach = max(1, width // 2)
    total = np.concatenate([[0.0], np.cumsum(np.where(good, raw, 0.0))])
    count = np.concatenate([[0.0], np.cumsum(good)])
    index = np.arange(len(raw))
    low, high = np.maximum(index - reach, 0), np.minimum(index + reach + 1, len(raw))
    return np.asarray(
        (total[high] - total[low]) / np.maximum(count[high] - count[low], 1.0), dtype=np.float64
    )


def _chunks(values: Array, chunk: int) -> Array:
    """Means of `chunk` samples (the last one may be shorter)."""
    starts = np.arange(0, len(values), chunk)
    sizes = np.diff(np.append(starts, len(values)))
    return np.asarray(np.add.reduceat(values, starts) / sizes, dtype=np.float64)


def write(path: Path, result: ForceEstimate) -> None:
    """Write an estimate as Parquet or CSV by the file's ending."""
    from testbed.formats.table import write_columns

    write_columns(path, result.columns())
