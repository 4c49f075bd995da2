"""Friction (5) of a leg, with what the effects make of it; at rest it is a set."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from testbed.compiled import njit
from testbed.effects.terms import ForceTerms, Signals
from testbed.estimation.cylinder import break_away_over, friction_parts
from testbed.recording.leg_model import Friction

Array = npt.NDArray[np.float64]


def friction_n(friction: Friction, signals: Signals, terms: ForceTerms) -> Array:
    """F_f in N, shape (n,), without the part that needs the load; positive against extension."""
    v = signals.velocity_m_s
    level, viscous = friction_parts(v, friction, *conditions_over(signals, terms))
    if terms.presliding is None:
        return np.asarray(viscous + np.sign(v) * level)
    stiffness, damping, shape = terms.presliding
    bent = _bristle(
        signals.position_m,
        v,
        np.maximum(level, 1.0),
        stiffness,
        damping,
        shape,
        1.0 / signals.rate_hz,
    )
    return np.asarray(viscous + bent, dtype=np.float64)


def conditions_over(signals: Signals, terms: ForceTerms) -> tuple[Array, Array, Array]:
    """Factor and extra of the dry friction and factor of the viscous one, each of shape (n,)."""
    factor, extra, thinning = (
        np.broadcast_to(np.asarray(change, dtype=np.float64), signals.velocity_m_s.shape)
        for change in (terms.coulomb_scale, terms.coulomb_add_n, terms.viscous_scale)
    )
    return factor, extra, thinning


@njit
def _bristle(
    x: Array,
    v: Array,
    level: Array,
    stiffness: float,
    damping: float,
    shape: float,
    period_s: float,
) -> Array:
    """Force of the bristle, N: dz = dx - |dx| (stiffness z / level)^shape, exact for a constant level and shape 1."""
    out = np.empty_like(v)
    bend = 0.0  # stiffness z / level
    # The state at the start is what the first metres of motion end in: run the first second of motion backwards first.
    for i in range(len(v)):
        if abs(v[i]) > 1e-3:
            bend = 1.0 if v[i] > 0 else -1.0
            break
    last = x[0]
    for i in range(len(v)):
        dx = x[i] - last
        last = x[i]
        rate = stiffness / level[i]
        if shape == 1.0:
            aim = 1.0 if dx > 0.0 else -1.0
            bend = aim + (bend - aim) * np.exp(-rate * abs(dx))
        else:
            count = int(min(200.0, np.ceil(rate * abs(dx) / 0.1))) + 1
            for _ in range(count):
                size = abs(bend) ** shape
                bend += rate * (dx - abs(dx) * (size if bend >= 0.0 else -size)) / count
                bend = min(1.0, max(-1.0, bend))
        size = abs(bend) ** shape
        out[i] = level[i] * bend + damping * (v[i] - abs(v[i]) * (size if bend >= 0.0 else -size))
    return out


def breakaway_n(friction: Friction, signals: Signals, terms: ForceTerms) -> tuple[Array, Array]:
    """(low, high) of the friction at rest, N, shape (n,): [-(F_c + F_s) backwards, (F_c + F_s) forwards]."""
    factor, extra, _ = conditions_over(signals, terms)
    return break_away_over(friction, factor, extra)
