"""Seal and guide friction of a cylinder: the paper's (5) as the steady state of a bristle."""

from __future__ import annotations

import math

from numba import njit


@njit(cache=True)
def stribeck_level(speed: float, coulomb_n: float, static_n: float, stribeck_m_s: float) -> float:
    """g(v) = F_c0 + F_s0 exp(-|v| / c_s), N: the paper's (4) and (5), exponent one; `speed` = |v| in m/s."""
    return coulomb_n + static_n * math.exp(-speed / stribeck_m_s)


@njit(cache=True)
def bristle_step(
    z: float, v: float, dt: float, level_n: float, stiffness: float, damping: float
) -> tuple[float, float]:
    """One implicit step of dz/dt = v - stiffness |v| z / g: new z (m) and the bristle's force (N), + against + v.

    Unconditionally stable; |stiffness z| never passes max(g, its start); steady sliding gives exactly g sign(v);
    at rest z stays as it is, so that a stuck piston carries any load up to g without creeping.
    """
    new = (z + dt * v) / (1.0 + dt * stiffness * abs(v) / level_n)
    return new, stiffness * new + damping * (new - z) / dt


@njit(cache=True)
def steady_friction(v: float, coulomb_n: float, static_n: float, stribeck_m_s: float, viscous_n_s_m: float) -> float:
    """Equation (4) at constant speed v != 0, N, with the parameters of v's direction; 0 at v = 0."""
    if v == 0.0:
        return 0.0
    return viscous_n_s_m * v + math.copysign(stribeck_level(abs(v), coulomb_n, static_n, stribeck_m_s), v)
