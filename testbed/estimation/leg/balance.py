"""The believed force balance of a leg: everything but friction, and friction that depends on the
load it reveals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from testbed.effects import build
from testbed.effects.active import Active
from testbed.effects.friction_load import REFERENCE_LOAD_N
from testbed.effects.friction_presliding import bristle_force_n
from testbed.effects.terms import ForceTerms, Signals
from testbed.estimation.cylinder import break_away_over, friction_parts
from testbed.estimation.cylinder import piston_force_n as chambers_force_n
from testbed.formats.arrays import Array
from testbed.recording.leg_model import Friction, LegModel

MOVING_M_S = 3e-3
"""Faster than this the direction of friction is certain (the contract's limit for scoring)."""
MARGIN_S = 0.008
"""Time around a reversal in which the smoothed velocity does not tell the direction of friction."""
OUTPUT_WIDTH_S = 0.006
"""Standard deviation of the smoothing of a force."""
FIRST_SLIDE_S = 0.03
"""A slide that begins so early, where nothing may be foreseen, began before the start."""
LEAST_WEIGHT = 0.05
"""Share of good samples near by from which on their mean is taken."""

# Friction (5) of a leg, with what the effects make of it; at rest it is a set.

LEAST_LEVEL_N = 1.0
"""Friction that a bristle slips at, at least."""


def friction_n(friction: Friction, signals: Signals, terms: ForceTerms) -> Array:
    """F_f in N, shape (n,), without the part that needs the load; positive against extension."""
    velocity = signals.velocity_m_s
    level, viscous = friction_parts(velocity, friction, *conditions_over(signals, terms))
    if terms.presliding is None:
        return np.asarray(viscous + np.sign(velocity) * level)
    level = np.maximum(level, LEAST_LEVEL_N)
    early = round(FIRST_SLIDE_S * signals.rate_hz) if signals.causal else -1
    bristle = bristle_force_n(signals.position_m, velocity, level, *terms.presliding, early)
    return np.asarray(viscous + bristle, dtype=np.float64)


def conditions_over(signals: Signals, terms: ForceTerms) -> tuple[Array, Array, Array]:
    """Factor and extra of the dry friction and factor of the viscous one, each of shape (n,)."""
    factor, extra, thinning = (
        np.broadcast_to(np.asarray(change, dtype=np.float64), signals.velocity_m_s.shape)
        for change in (terms.coulomb_scale, terms.coulomb_add_n, terms.viscous_scale)
    )
    return factor, extra, thinning


def breakaway_n(friction: Friction, signals: Signals, terms: ForceTerms) -> tuple[Array, Array]:
    """(low, high) of the friction at rest, N, shape (n,): [-(F_c + F_s) backwards, (F_c + F_s)
    forwards].
    """
    factor, extra, _ = conditions_over(signals, terms)
    return break_away_over(friction, factor, extra)


def corrected(signals: Signals, effects: Sequence[Active]) -> Signals:
    """Signals as the sensors should have read them."""
    for active in effects:
        signals = active.correct(signals)
    return signals


def acting(signals: Signals, held_s: float) -> Signals:
    """Signals whose actuator force is the one that acts: of a command that is held until the next,
    the mean of what was given, `held_s` before.
    """
    if held_s == 0.0 or signals.actuator_force_n is None:
        return signals
    time = signals.time_s
    force = np.interp(time - held_s, time, signals.actuator_force_n)
    return signals.with_(actuator_force_n=np.asarray(force, dtype=np.float64))


def force_terms(model: LegModel, signals: Signals, effects: Sequence[Active]) -> ForceTerms:
    """The force balance with every effect's change."""
    mass = model.known.moving_mass_kg or 0.0
    terms = ForceTerms(mass_kg=mass, weight_mass_kg=mass, force_n=model.force_offset_n)
    for active in effects:
        active.force(signals, terms)
    return terms


def piston_force_n(signals: Signals) -> Array:
    """PA A_A - pB A_B, or a drive's actuator force; N, along extension, shape (n,)."""
    if signals.actuator_force_n is not None and signals.pressure_a_pa is None:
        return signals.actuator_force_n
    assert signals.pressure_a_pa is not None
    pressure_b = 0.0 if signals.pressure_b_pa is None else signals.pressure_b_pa
    known = signals.known
    return np.asarray(
        chambers_force_n(signals.pressure_a_pa, pressure_b, known.area_a_m2, known.area_b_m2)
    )


def without_friction_n(signals: Signals, terms: ForceTerms) -> Array:
    """F_ext + F_f = F_p + m g cos(inclination) - m a + force; N, shape (n,)."""
    weight = terms.weight_mass_kg * signals.known.gravity_along_axis_m_s2
    total = (
        piston_force_n(signals) + weight - terms.mass_kg * signals.acceleration_m_s2 + terms.force_n
    )
    if terms.added_mass_kg:
        slow = signals.slow_acceleration_m_s2
        total = total - terms.added_mass_kg * (signals.acceleration_m_s2 if slow is None else slow)
    return np.asarray(total, dtype=np.float64)


def external_n(rest_n: Any, direction: Any, terms: ForceTerms) -> Array:
    """F_ext from rest_n = F_ext + direction * friction of the load; a fixed point, exact for
    exponent 1.
    """
    coefficient, exponent = terms.load_coefficient, terms.load_exponent
    if coefficient == 0.0:
        return np.asarray(rest_n, dtype=np.float64)
    force = np.where(rest_n > 0.0, rest_n / (1.0 + direction * coefficient), rest_n)
    if exponent == 1.0:
        return np.asarray(force, dtype=np.float64)
    for _ in range(4):
        load = np.maximum(force, 1.0)
        power = coefficient * REFERENCE_LOAD_N * (load / REFERENCE_LOAD_N) ** exponent
        gap = force + direction * np.where(force > 0.0, power, 0.0) - rest_n
        force = force - gap / np.maximum(
            1.0 + direction * np.where(force > 0.0, power * exponent / load, 0.0), 0.2
        )
    return np.asarray(force, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Balance:
    """The force of a leg as a model believes in it, N, (n,): sliding, and at rest anywhere in a
    set.
    """

    signals: Signals
    """As the sensors should have read them."""
    terms: ForceTerms
    sliding_n: Array
    resting_n: tuple[Array, Array]
    """Lowest and highest."""


def balance_of(signals: Signals, model: LegModel) -> Balance:
    """The balance over signals (n,) as they were read."""
    effects = build(model.effects)
    signals = corrected(acting(signals, model.force_held_s), effects)
    terms = force_terms(model, signals, effects)
    total = without_friction_n(signals, terms)
    friction = friction_n(model.friction, signals, terms)
    low, high = breakaway_n(model.friction, signals, terms)
    if terms.presliding is not None:
        # A bristle tells the friction at rest to within one encoder count of bend.
        slack = terms.presliding[0] * 1e-4
        low, high = np.maximum(low, friction - slack), np.minimum(high, friction + slack)
        low, high = np.minimum(low, high), np.maximum(low, high)
    sliding = external_n(total - friction, np.sign(signals.velocity_m_s), terms)
    return Balance(signals, terms, sliding, resting_set_n(total, low, high, terms))


def resting_set_n(
    total_n: Array, rest_low_n: Array, rest_high_n: Array, terms: ForceTerms
) -> tuple[Array, Array]:
    """(lowest, highest) external force of a resting piston, N, (n,): total_n = F_ext + F_f, and F_f
    between the break-away forces, each larger by what F_ext itself adds to friction.
    """
    least, most = total_n - rest_high_n, total_n - rest_low_n
    if terms.load_coefficient == 0.0:
        return least, most
    least, most = external_n(least, 1.0, terms), external_n(most, -1.0, terms)
    # Friction that the load relieves ends at none: then the force is what the balance leaves.
    return np.minimum(least, total_n), np.maximum(most, total_n)


def travel_since_reversal(velocity_m_s: Array, steps_s: Any) -> Array:
    """Distance moved since the velocity last changed its sign, m, shape (n,); the start counts as
    far from one. `steps_s`: the time of each sample, or of all.
    """
    travel = np.cumsum(np.abs(velocity_m_s) * steps_s)
    sign = velocity_m_s > 0.0
    turned = np.concatenate([[False], sign[1:] != sign[:-1]])
    at = np.maximum.accumulate(np.where(turned, np.arange(len(sign)), -1))
    return np.asarray(
        np.where(at >= 0, travel - travel[np.maximum(at, 0)], np.inf), dtype=np.float64
    )
