"""Quick velocity from the oil, slow velocity from the encoder.

The encoder's steps leave 2 mm/s of noise at 3 ms, the chambers' flow balances fifty times less; the
flow balances are wrong by a per cent in the mean, the encoder is not. So each gives what it knows
best:

    v = slow part of v_encoder + quick part of v_oil,
    v_oil = mean of (Q_A - q_AB - V_A/beta dpA/dt) / A_A and -(Q_B + q_AB - V_B/beta dpB/dt) / A_B.

Where the believed flow balance does not agree with the encoder (a valve or an oil that is not what
the model says), the oil's share fades out.
"""

from __future__ import annotations

import numpy as np

from testbed.effects import build
from testbed.effects.terms import Signals
from testbed.estimation.leg.balance import corrected
from testbed.estimation.leg.flow import flow_balance, flow_terms, smoothed_opening, spool
from testbed.estimation.leg.motion import smooth
from testbed.estimation.leg.signals import signals_of
from testbed.recording.axis import Recording
from testbed.recording.leg_model import LegModel

GOING_M_S = 3e-3
"""Faster than this the piston moves, and oil and encoder are compared."""
LEAST_SHARE = 0.05
"""Less of the oil's speed than this is not worth its noise."""

CROSSOVER_S = 0.015
"""Standard deviation of the smoothing that parts slow from quick."""
DISAGREEMENT_M_S = 5e-3
"""Root mean square between both velocities, slow part, at which the oil's share is one half."""


def can_fuse(recording: Recording, model: LegModel) -> bool:
    """True where the flow balances of both chambers can be formed."""
    channels = (recording.valve_command, recording.pressure_a_pa, recording.pressure_b_pa)
    return model.known.declares_flow and all(channel is not None for channel in channels)


def fused(recording: Recording, model: LegModel, width_s: float) -> Signals | None:
    """Signals smoothed by `width_s`, with velocity and acceleration from encoder and oil together.

    None where the believed flow balance is too far from the encoder to be of use.
    """
    signals = signals_of(recording, model.known, width_s)
    known, rate = signals.known, signals.rate_hz
    effects = build(model.effects)
    right = corrected(signals, effects)
    terms = flow_terms(right, effects)
    assert (
        signals.valve_command is not None
        and known.valve_natural_frequency_hz
        and known.valve_damping
    )
    moved = spool(
        signals.valve_command, rate, known.valve_natural_frequency_hz, known.valve_damping
    )
    balance = flow_balance(
        right, terms, smoothed_opening(moved, terms.deadband, max(width_s, 1.2 / rate) * rate)
    )
    difference = 0.5 * (balance.a_m3_s / known.area_a_m2 - balance.b_m3_s / known.area_b_m2)
    gap = smooth(difference, CROSSOVER_S * rate)
    going = np.abs(signals.velocity_m_s) > GOING_M_S
    size = float(np.sqrt(np.mean(gap[going] ** 2))) if going.any() else 0.0
    share = 1.0 / (1.0 + (size / DISAGREEMENT_M_S) ** 4)
    if share < LEAST_SHARE:
        return None
    oil = signals.velocity_m_s + difference
    slow = signals_of(recording, model.known, CROSSOVER_S).velocity_m_s
    velocity = slow + oil - smooth(oil, CROSSOVER_S * rate)
    plain = signals_of(recording, model.known).velocity_m_s
    velocity = share * velocity + (1.0 - share) * plain
    return signals.with_(velocity_m_s=velocity, acceleration_m_s2=np.gradient(velocity) * rate)
