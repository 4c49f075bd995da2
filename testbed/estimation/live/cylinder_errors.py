"""The errors of the cylinders' forces as the filter of fusion.py estimates them: how its unknowns
add up to the error of one force, and what a foot's contact tells of them. Compiled.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.compiled import njit
from testbed.estimation.live import fusion as fu
from testbed.formats.records import SET


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
def force_error(i: int, state: Any) -> float:
    """Estimated error of cylinder i's force, N: measured less true."""
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


@njit
def told_variance(k: int, h: Any, body: Any, state: Any) -> float:
    """Of leg k's force that the row h (N) observes, N2: as much of the filter's variance as is
    told, and the noise of a filtered load.
    """
    share = body.told_share
    if state.axes[3 * k + 2].has_slid == 0.0:
        share *= body.stuck_told
    variance = max(leg_variance(state.fusion.p, h, k), 0.0)
    return float(share * share * variance + body.noise_sd * body.noise_sd)


# What contact tells of a foot's force: in the air it is nothing, on the ground it pushes and does
# not pull.


@njit
def is_in_air(k: int, row: Any, body: Any, state: Any) -> bool:
    """Whether foot k is in the air by now; counts for how long."""
    up = state.means.foot_force[k, 2] - force_error(3 * k + 2, state)
    off = bool(row.carrying[k] < SET and abs(up) < body.air_load)
    dt = body.every * body.decisions.dt
    state.in_air[k] = state.in_air[k] + dt if off else 0.0
    return off


@njit
def learn_in_air(k: int, map_: Any, body: Any, state: Any) -> None:
    """Three observations: foot k carries nothing. map_ (3, 3): leg_map."""
    h = np.zeros(fu.N)
    for index in range(3):
        weigh_leg(k, map_[index], state, h)
        force, slides = state.means.foot_force[k, index], state.axes[3 * k + 2].slides >= 1.0
        fu.observe(state.fusion, h, force, body.air_sd**2, body.gate, index == 2 and slides)


@njit
def learn_no_pull(maps: Any, body: Any, state: Any) -> None:
    """One observation of every foot that seems to pull: it carries nothing; maps (4, 3, 3):
    leg_map. Constants learn nothing from it: it is known of them only that they were too small.
    """
    h = np.zeros(fu.N)
    for k in range(4):
        force = state.means.foot_force[k, 2]
        up = force
        for j in range(3):
            up -= maps[k, 2, j] * force_error(3 * k + j, state)
        if up < 0.0:
            h[:] = 0.0
            weigh_leg(k, maps[k, 2], state, h)
            fu.observe(state.fusion, h, force, body.air_sd**2, body.gate, False)
