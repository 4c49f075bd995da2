"""What the cylinders' forces are off by, as learnt: how the unknowns of fusion.py make it up."""

from __future__ import annotations

from typing import Any

from testbed.compiled import njit
from testbed.estimation.live import fusion as fu


@njit
def weigh_cylinder(i: int, weight: float, axis: Any, h: Any) -> None:
    """How the unknowns of cylinder i, by `weight`, make up a force that is seen: into the row h (N)
    of an observation.
    """
    h[fu.ZERO + i] = h[fu.DEVIATION + i] = weight
    h[fu.OUT + i] = weight * max(axis.use, 0.0)
    h[fu.BACK + i] = weight * min(axis.use, 0.0)
    h[fu.SIDE + i] = weight * axis.use * axis.across


@njit
def weigh_leg(k: int, weights: Any, state: Any, h: Any) -> None:
    """The same of leg k, whose cylinders' forces weigh (3)."""
    for index in range(3):
        weigh_cylinder(3 * k + index, weights[index], state.axes[3 * k + index], h)


@njit
def learnt(i: int, state: Any) -> float:
    """What cylinder i's force is off by, as learnt, N."""
    x, use = state.fusion.x, state.axes[i].use
    friction = max(use, 0.0) * x[fu.OUT + i] + min(use, 0.0) * x[fu.BACK + i]
    friction += use * state.axes[i].across * x[fu.SIDE + i]
    return float(x[fu.ZERO + i] + friction + x[fu.DEVIATION + i])


@njit
def leg_variance(p: Any, h: Any, k: int) -> float:
    """Variance of what an observation's row h (N) makes of leg k's cylinders, N2."""
    groups = (fu.ZERO, fu.OUT, fu.BACK, fu.SIDE, fu.DEVIATION)
    total = 0.0
    for first in groups:
        for index in range(first + 3 * k, first + 3 * k + 3):
            for second in groups:
                for j in range(second + 3 * k, second + 3 * k + 3):
                    total += h[index] * p[index, j] * h[j]
    return total
