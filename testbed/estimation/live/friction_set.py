"""Friction as an estimator may know it: the paper's (5) where the piston slides, a set where it may be at rest."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit

FRICTION_SIZE = 8
(
    SIGMA_PLUS,
    COULOMB_PLUS,
    STATIC_PLUS,
    STRIBECK_PLUS,
    SIGMA_MINUS,
    COULOMB_MINUS,
    STATIC_MINUS,
    STRIBECK_MINUS,
) = range(FRICTION_SIZE)
"""(5): sigma N s/m, F_c0 N, F_s0 N, c_s m/s for extension (+), then the same for retraction (-)."""


@njit
def magnitude(
    speed_m_s: float, positive: bool, f: NDArray[np.float64], extra_n: float, factor: float
) -> float:
    """Friction's size in N at `speed` = |v| in one sense: sigma |v| + F_c0 factor + extra + F_s0 exp(-|v| / c_s).

    f[8] as above; `factor` and `extra_n` carry what a model adds to the Coulomb term (position, pressure, load).
    """
    o = 0 if positive else 4
    return float(
        f[o] * speed_m_s + f[o + 1] * factor + extra_n + f[o + 2] * math.exp(-speed_m_s / f[o + 3])
    )


@njit
def published(v_m_s: float, f: NDArray[np.float64], extra_n: float, factor: float) -> float:
    """F_f(v) of (5) in N, positive against extension; 0 at v = 0 as sign(0) = 0."""
    if v_m_s > 0.0:
        return float(magnitude(v_m_s, True, f, extra_n, factor))
    if v_m_s < 0.0:
        return float(-magnitude(-v_m_s, False, f, extra_n, factor))
    return 0.0


@njit
def friction_set(
    v_m_s: float, sense: float, slides: float, f: NDArray[np.float64], extra_n: float, factor: float
) -> tuple[float, float]:
    """(lowest, highest) friction force in N that the encoder leaves open.

    `slides` = 1: the single value (5) at |v| in `sense`; 0: all between the two break-away values; in between, the
    edge on the far side moves back linearly.
    """
    high = magnitude(0.0, True, f, extra_n, factor)
    low = -magnitude(0.0, False, f, extra_n, factor)
    if slides <= 0.0:
        return low, high
    if sense > 0.0:
        value = magnitude(max(v_m_s, 0.0), True, f, extra_n, factor)
        return slides * value + (1.0 - slides) * low, slides * value + (1.0 - slides) * high
    value = -magnitude(max(-v_m_s, 0.0), False, f, extra_n, factor)
    return slides * value + (1.0 - slides) * low, slides * value + (1.0 - slides) * high
