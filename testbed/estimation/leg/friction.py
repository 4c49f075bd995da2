"""Friction (5) of a leg, with what the effects make of it; at rest it is a set."""

from __future__ import annotations

import numpy as np

from testbed.effects.friction_presliding import bristle_force_n
from testbed.effects.terms import ForceTerms, Signals
from testbed.estimation.cylinder import break_away_over, friction_parts
from testbed.formats.arrays import Array
from testbed.recording.leg_model import Friction

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
