"""The believed force balance of a leg: everything but friction, and friction that depends on the
load it reveals.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from testbed.effects.active import Active
from testbed.effects.friction_load import REFERENCE_LOAD_N
from testbed.effects.friction_presliding import bristle_force_n
from testbed.effects.terms import ForceTerms, Signals
from testbed.estimation.cylinder import break_away_over, friction_parts
from testbed.estimation.cylinder import piston_force_n as chambers_force_n
from testbed.formats.arrays import Array
from testbed.recording.leg_model import Friction, LegModel

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
    bristle = bristle_force_n(signals.position_m, velocity, level, *terms.presliding)
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
