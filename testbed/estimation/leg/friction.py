"""Friction (5) of a leg, with what the effects make of it; at rest it is a set."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.compiled import njit
from testbed.effects.friction_presliding import bristle_force_n
from testbed.effects.terms import ForceTerms, Signals
from testbed.recording.leg_model import Friction

Array = npt.NDArray[np.float64]
LEAST_LEVEL_N = 1.0
"""Friction that a bristle slips at, at least."""
FIELDS = tuple(Friction.model_fields)
"""viscous, Coulomb, Stribeck, Stribeck speed of extension, then of retraction."""


def coefficients(friction: Friction, forward: Any) -> tuple[Any, Any, Any, Any]:
    """(sigma, F_c0, F_s0, c_s) of the side of motion, each of shape (n,)."""
    f = friction
    side = np.asarray(forward, dtype=np.intp)
    return (
        np.array([f.viscous_minus_n_s_m, f.viscous_plus_n_s_m])[side],
        np.array([f.coulomb_minus_n, f.coulomb_plus_n])[side],
        np.array([f.stribeck_minus_n, f.stribeck_plus_n])[side],
        np.array([f.stribeck_speed_minus_m_s, f.stribeck_speed_plus_m_s])[side],
    )


def friction_n(friction: Friction, signals: Signals, terms: ForceTerms) -> Array:
    """F_f in N, shape (n,), without the part that needs the load; positive against extension."""
    v = signals.velocity_m_s
    if terms.presliding is None:
        return np.asarray(_static(v, *static_parts(friction, signals, terms)))
    sigma, coulomb, stribeck, speed = coefficients(friction, v >= 0.0)
    level = (
        coulomb * terms.coulomb_scale + terms.coulomb_add_n + stribeck * np.exp(-np.abs(v) / speed)
    )
    viscous = sigma * terms.viscous_scale * v
    level = np.maximum(np.broadcast_to(level, v.shape), LEAST_LEVEL_N)
    bristle = bristle_force_n(signals.position_m, v, level, *terms.presliding)
    return np.asarray(viscous + bristle, dtype=np.float64)


def static_parts(
    friction: Friction, signals: Signals, terms: ForceTerms
) -> tuple[Array, Array, Array, Array]:
    """(`friction` in the order of FIELDS, `scale`, `add`, `thin`: see `ForceTerms`) as `static_one_n` takes them."""
    packed = np.array([getattr(friction, name) for name in FIELDS])
    changes = (terms.coulomb_scale, terms.coulomb_add_n, terms.viscous_scale)
    shape = signals.velocity_m_s.shape
    scale, add, thin = (np.broadcast_to(np.asarray(c, dtype=np.float64), shape) for c in changes)
    return packed, scale, add, thin


@njit
def static_one_n(v: float, friction: Array, scale: float, add: float, thin: float) -> float:
    """Equation (5) at one speed, N."""
    at = 0 if v >= 0.0 else 4
    level = friction[at + 1] * scale + add + friction[at + 2] * np.exp(-abs(v) / friction[at + 3])
    value: float = friction[at] * thin * v + (level if v > 0.0 else -level if v < 0.0 else 0.0)
    return value


@njit
def _static(v: Array, friction: Array, scale: Array, add: Array, thin: Array) -> Array:
    """Equation (5), N; `friction` in the order of FIELDS, `scale`, `add`, `thin`: see `ForceTerms`."""
    out = np.empty_like(v)
    for i in range(len(v)):
        out[i] = static_one_n(v[i], friction, scale[i], add[i], thin[i])
    return out


def breakaway_n(friction: Friction, signals: Signals, terms: ForceTerms) -> tuple[Array, Array]:
    """(low, high) of the friction at rest, N, shape (n,): [-(F_c + F_s) backwards, (F_c + F_s) forwards]."""
    f, n = friction, len(signals.time_s)
    scale, add = (
        np.broadcast_to(terms.coulomb_scale, (n,)),
        np.broadcast_to(terms.coulomb_add_n, (n,)),
    )
    high = np.maximum(f.coulomb_plus_n * scale + add + f.stribeck_plus_n, 0.0)
    low = -np.maximum(f.coulomb_minus_n * scale + add + f.stribeck_minus_n, 0.0)
    return np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
