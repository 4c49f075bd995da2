"""What the oil tells of a leg's motion: flow that goes into a chamber and presses nothing moves the
piston.

Between two counts of the encoder the oil sees what the encoder does not; over longer times its
flows drift. So the quick part of the motion is the oil's and the slow part the encoder's.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from testbed.effects import build
from testbed.effects.terms import Signals
from testbed.estimation.leg.balance import corrected
from testbed.estimation.leg.flow import Edges, flow_balance, flow_terms, smoothed_opening
from testbed.estimation.leg.motion import signals_of, smooth
from testbed.estimation.leg.spool import spool
from testbed.formats.arrays import Array, Flags
from testbed.recording.axis import Recording
from testbed.recording.leg_model import LegModel

FUSED_WIDTH_S = 0.002
"""Standard deviation of the smoothing of every channel where the oil tells the quick part."""
GOING_M_S = 3e-3
"""Faster than this the piston moves, and oil and encoder are compared."""
LEAST_SHARE = 0.05
"""Less of the oil's speed than this is not worth its noise."""
CROSSOVER_S = 0.015
"""Standard deviation of the smoothing that parts slow from quick."""
DISAGREEMENT_M_S = 5e-3
"""Root mean square between both velocities, slow part, at which the oil's share is one half."""
MOST_LATE, LEAST_EXPLAINED = 2.0, 0.1
"""Samples by which a recorder's order of command and sensors may differ from the usual one, and the
share that this has to explain of what oil and encoder differ by."""


def can_fuse(recording: Recording, model: LegModel) -> bool:
    """True where the flow balances of both chambers can be formed."""
    channels = (recording.valve_command, recording.pressure_a_pa, recording.pressure_b_pa)
    return model.known.declares_flow and all(channel is not None for channel in channels)


class _Compared(NamedTuple):
    """A recording's smoothed channels, and by how much the oil's velocity is above the encoder's,
    m/s, (n,); which samples are going, (n,).
    """

    signals: Signals
    difference_m_s: Array
    going: Flags


def fused(recording: Recording, model: LegModel, width_s: float) -> Signals | None:
    """Signals smoothed by `width_s`, with velocity and acceleration from encoder and oil together.

    None where the believed flow balance is too far from the encoder to be of use.
    """
    signals, difference, going = _compared(recording, model, width_s)
    width = CROSSOVER_S * signals.rate_hz
    gap = smooth(difference, width)
    size = float(np.sqrt(np.mean(gap[going] ** 2))) if going.any() else 0.0
    share = 1.0 / (1.0 + (size / DISAGREEMENT_M_S) ** 4)
    if share < LEAST_SHARE:
        return None
    oil = signals.velocity_m_s + difference
    slow = signals_of(recording, model.known, CROSSOVER_S).velocity_m_s
    velocity = slow + oil - smooth(oil, width)
    plain = signals_of(recording, model.known).velocity_m_s
    velocity = share * velocity + (1.0 - share) * plain
    acceleration = np.gradient(velocity) * signals.rate_hz
    return signals.with_(velocity_m_s=velocity, acceleration_m_s2=acceleration)


def position_by_oil(recording: Recording, model: LegModel) -> Array:
    """Position, m, (n,) on the recording's even grid, with the quick part that the oil tells: at
    most a count beside the encoder's, which hides no more.
    """
    signals, difference, _ = _compared(recording, model, FUSED_WIDTH_S)
    moved = np.cumsum(difference) / signals.rate_hz
    quick = moved - smooth(moved, CROSSOVER_S * signals.rate_hz)
    count = recording.position_resolution_m
    return np.asarray(signals.position_m + np.clip(quick, -count, count), dtype=np.float64)


def _compared(recording: Recording, model: LegModel, width_s: float) -> _Compared:
    """Oil and encoder side by side, every channel smoothed by `width_s`: the oil's velocity is the
    mean of what both chambers' balances ask for.
    """
    signals = signals_of(recording, model.known, width_s)
    known, rate = signals.known, signals.rate_hz
    right = corrected(signals, build(model.effects))
    terms = flow_terms(right, build(model.effects))
    assert (
        signals.valve_command is not None
        and known.valve_natural_frequency_hz
        and known.valve_damping
    )
    moved = spool(
        signals.valve_command, rate, known.valve_natural_frequency_hz, known.valve_damping
    )
    open_ = smoothed_opening(moved, terms.deadband, max(width_s, 1.2 / rate) * rate)

    def oil_less_encoder(late_samples: float) -> Array:
        balance = flow_balance(right, terms, open_, Edges(late_s=late_samples / rate))
        return 0.5 * (balance.a_m3_s / known.area_a_m2 - balance.b_m3_s / known.area_b_m2)

    going = np.abs(signals.velocity_m_s) > GOING_M_S
    width = CROSSOVER_S * rate
    late = _late_samples(*(smooth(oil_less_encoder(n), width)[going] for n in (0.0, 1.0)))
    return _Compared(signals, oil_less_encoder(late), going)


def _late_samples(as_usual: Array, one_late: Array) -> float:
    """By how many samples the valve follows its command later than usual: least squares between
    oil and encoder, from what they differ by with none and with one.
    """
    slope = one_late - as_usual
    power, along = float(slope @ slope), float(as_usual @ slope)
    if along**2 <= LEAST_EXPLAINED * power * float(as_usual @ as_usual):
        return 0.0
    return float(np.clip(-along / power, -MOST_LATE, MOST_LATE))
