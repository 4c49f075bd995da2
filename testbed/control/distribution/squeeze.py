"""From errors of the forces to rates: how fast joints squeeze and ropes are hauled, compiled. See distribution.py."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.control.programs.trim import haul
from testbed.machine.names import LEGS

Array = NDArray[np.float64]
TOLERANCE: Array = np.tile([21.0, 49.0, 42.0], len(LEGS))
"""Joint force errors that are left alone, N m, N, N (E): a tenth of the joints' sliding friction."""
GAIN_1_S = 1.8
EDGE_START: Array = np.tile([5.0e-3, 1.0e-3, 5.0e-4], len(LEGS))
EDGE_GROWTH_1_S, EDGE_LIMIT = 1.5, 6.0
"""Speed that the dead band swallows: first guess (rad/s, m/s), growth (in first guesses) while nothing comes, most."""
SPEED_LIMIT: Array = np.tile([2.5e-2, 5.0e-3, 4.0e-3], len(LEGS))
HANGING_SHARE, SEEK_M_S = 0.25, 2.0e-3
"""A foot that has less than this share of its load seeks the ground at this speed: in the air no force tells it (E)."""
PULL_SLEW_N_S = 4000.0
"""Fastest change of a wanted pull (E)."""


@njit
def add_pull(wanted: Any, tension: Any, dt: float, pull: Any, rates: Any) -> None:
    """Let `pull` (2) follow what is wanted (2), N; add to the ropes' rates (2) what brings the tensions (2) there."""
    step = PULL_SLEW_N_S * dt
    for k in range(pull.shape[0]):
        pull[k] += min(max(wanted[k] - pull[k], -step), step)
    haul(tension, pull, rates)


@njit
def add_squeeze(
    force: Any, compliance: Any, felt: Any, wanted: Any, dt: float, edge: Any, side: Any, rates: Any
) -> None:
    """Add to the joints' rates (12) what takes `force` (12) off them, and what lets hanging feet seek the ground.

    compliance (12) of the joints; felt, wanted (14): forces in the order of Statics' unknowns; edge, side (12): in
    first guesses and -1, 0, 1, of the last tick, brought up to date.
    """
    for i in range(rates.shape[0]):
        size = abs(force[i])
        now = 0.0 if size < TOLERANCE[i] else 1.0 if force[i] > 0.0 else -1.0
        if now != 0.0 and now == side[i]:
            edge[i] = min(edge[i] + EDGE_GROWTH_1_S * dt, EDGE_LIMIT)
        else:
            edge[i] = max(1.0, 1.0 if now == 0.0 else 0.7 * edge[i])
        side[i] = now
        rates[i] += now * min(
            GAIN_1_S * compliance[i] * size + edge[i] * EDGE_START[i], SPEED_LIMIT[i]
        )
    for leg in range(len(LEGS)):
        if felt[3 * leg] < HANGING_SHARE * wanted[3 * leg]:
            rates[3 * leg + 2] += SEEK_M_S
