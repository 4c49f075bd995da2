"""Exact steps of the linear parts: a second-order system and a first-order lag with inputs known
over the step.
"""

from __future__ import annotations

import math

from testbed.compiled import njit_law


@njit_law
def second_order(wn: float, zeta: float, t: float) -> tuple[float, float, float, float]:
    """exp(M t) of y'' = -wn^2 y - 2 zeta wn y' for (y, y'): (yy, yr, ry, rr), dimensions 1, s, 1/s,
    1.

    Any damping ratio >= 0; near the critical one cos and sin become cosh and sinh through zero.
    """
    a = zeta * wn
    square = wn * wn - a * a
    decay = math.exp(-a * t)
    if square > 1e-12 * wn * wn:
        w = math.sqrt(square)
        cosine, sine = math.cos(w * t), math.sin(w * t) / w
    elif square < -1e-12 * wn * wn:
        w = math.sqrt(-square)
        fast, slow = math.exp((-w - a) * t), math.exp((w - a) * t)  # together, lest cosh overflow
        cosine, sine, decay = 0.5 * (slow + fast), 0.5 * (slow - fast) / w, 1.0
    else:
        cosine, sine = 1.0, t
    return (
        decay * (cosine + a * sine),
        decay * sine,
        -decay * wn * wn * sine,
        decay * (cosine - a * sine),
    )


@njit_law
def lag_weights(tau: float, t: float) -> tuple[float, float]:
    """Weights (of the old state, of the input's rise) of a first-order lag after t whose input
    ramps linearly.

    new = old e + start (1 - e) + rise w with e = exp(-t / tau), w = 1 - (1 - e) tau / t.
    """
    e = math.exp(-t / tau)
    return e, 1.0 - (1.0 - e) * tau / t
