"""Seal and guide friction of a cylinder: the paper's (5) as the steady state of a bristle.

    dz/dt = v - k |v| z / g(v),   F = k z + d dz/dt + sigma v,   g(v) = F_c0 + F_s0 exp(-|v| / c_s)

The rate v is held over a step, so z relaxes exponentially and the mean force has a closed form.
"""

from __future__ import annotations

import math
from typing import Any

from testbed.laws import columns as c
from testbed.laws.compiling import njit_law
from testbed.laws.oil import ATMOSPHERE_PA

SMALLEST_N = 1.0e-3
"""The bristle divides by its level: dry friction that is off is this small."""


@njit_law(forceinline=True)
def stribeck_level(speed: float, coulomb_n: float, static_n: float, stribeck_m_s: float) -> float:
    """g(v) = F_c0 + F_s0 exp(-|v| / c_s), N: the paper's (4) and (5), exponent one; `speed` = |v| in m/s."""
    return coulomb_n + static_n * math.exp(-speed / stribeck_m_s)


@njit_law
def relax(start: float, aim: float, exponent: float) -> tuple[float, float]:
    """Value after, and mean during, an exponential approach to `aim` over `exponent` time constants."""
    if exponent < 0.01:  # the closed form would divide zero by zero: its series, right to 1e-10
        mean = 1.0 - exponent * (0.5 - exponent * (1.0 / 6.0 - exponent / 24.0))
        return start + (aim - start) * exponent * mean, aim + (start - aim) * mean
    left = math.exp(-exponent)
    return aim + (start - aim) * left, aim + (start - aim) * (1.0 - left) / exponent


@njit_law(forceinline=True)
def bristle_step(
    z: float, v: float, dt: float, level_n: float, stiffness: float, damping: float
) -> tuple[float, float]:
    """The bristle over dt at constant v: new z (m) and the mean of its force (N), + against + v. Exact.

    Steady sliding gives exactly g sign(v); at rest z stays as it is, so that a stuck piston carries any load up to g
    without creeping; |stiffness z| never passes max(g, its start).
    """
    exponent = dt * stiffness * abs(v) / level_n
    if exponent < 1e-6:
        new = z + dt * v - exponent * z
        return new, stiffness * 0.5 * (z + new) + damping * (new - z) / dt
    new, mean = relax(z, math.copysign(level_n / stiffness, v), exponent)
    return new, stiffness * mean + damping * (new - z) / dt


@njit_law(forceinline=True)
def dwell_step(
    dwell: float, gain: float, rest_1_s: float, slide_1_s: float, dt: float
) -> tuple[float, float]:
    """Ageing of the contact over dt, after and mean: towards `gain` at rest, worn off by sliding. Exact.

    d' = rest (gain - d) - slide d; break-away is raised by d times the Coulomb friction.
    """
    rate = rest_1_s + slide_1_s
    after, mean = relax(dwell, gain * rest_1_s / rate, rate * dt)
    return after, mean


@njit_law(forceinline=True)
def friction_step(
    s: Any,
    p: Any,
    x: float,
    v: float,
    mean_a: float,
    mean_b: float,
    warm: float,
    load: float,
    side: float,
    dt: float,
) -> float:
    """Mean friction of one axis over dt, N, against +v; bristle and dwell advance.

    s, p: columns.py; x the extension in the middle of the step, m; mean_a, mean_b the chambers' mean absolute
    pressures, Pa; `warm` scales the viscous part; load, side: forces on the rod, N.
    """
    speed = abs(v)
    if v >= 0.0:
        fc, fs, cs, sigma = p[c.FC_POS], p[c.FS_POS], p[c.CS_POS], p[c.VISC_POS]
    else:
        fc, fs, cs, sigma = p[c.FC_NEG], p[c.FS_NEG], p[c.CS_NEG], p[c.VISC_NEG]
    fc *= 1.0 + p[c.FR_POSITION] * (x / p[c.STROKE] - 0.5)
    fc += p[c.FR_PRESSURE] * (mean_a + mean_b - 2.0 * ATMOSPHERE_PA)
    fc += p[c.FR_LOAD] * (load if load > 0.0 else 0.0) + p[c.FR_SIDE] * abs(side)
    fc = fc if fc > SMALLEST_N else SMALLEST_N
    if p[c.DWELL_GAIN] > 0.0:
        # One bristle length of sliding renews the contact.
        s[c.DWELL], aged = dwell_step(
            s[c.DWELL], p[c.DWELL_GAIN], 1.0 / p[c.DWELL_TIME], speed * p[c.BRISTLE_K] / fc, dt
        )
        fs += fc * aged
    level = stribeck_level(speed, fc, fs, cs)
    s[c.BRISTLE], force = bristle_step(s[c.BRISTLE], v, dt, level, p[c.BRISTLE_K], p[c.BRISTLE_D])
    return float(force + sigma * warm * v)


@njit_law
def steady_friction(
    v: float, coulomb_n: float, static_n: float, stribeck_m_s: float, viscous_n_s_m: float
) -> float:
    """Equation (4) at constant speed v != 0, N, with the parameters of v's direction; 0 at v = 0."""
    if v == 0.0:
        return 0.0
    return viscous_n_s_m * v + math.copysign(
        stribeck_level(abs(v), coulomb_n, static_n, stribeck_m_s), v
    )
