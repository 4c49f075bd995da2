"""From errors of the forces to rates: how fast joints squeeze and ropes are hauled, compiled. See
distribution.py.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from testbed.compiled import njit
from testbed.control.layers.trim import Hauling, haul, hauling
from testbed.formats.arrays import Array
from testbed.machine.names import LEGS
from testbed.machine.scale import Scale

TOLERANCE: Array = np.tile([21.0, 49.0, 42.0], len(LEGS))
"""Joint force errors that are left alone, N m, N, N (E): a tenth of the joints' sliding
friction.
"""
GAIN_1_S = 1.8
"""Share of an error of the joint forces that is taken off in a second (E)."""
EDGE_START: Array = np.tile([5.0e-3, 1.0e-3, 5.0e-4], len(LEGS))
"""First guess of the speed that the valves' dead bands swallow, rad/s, m/s, m/s (E)."""
EDGE_GROWTH_1_S = 1.5
"""Growth of that speed, in first guesses a second, while nothing comes (E)."""
EDGE_LIMIT = 6.0
"""Most of it, in first guesses (E)."""
SPEED_LIMIT: Array = np.tile([2.5e-2, 5.0e-3, 4.0e-3], len(LEGS))
"""Fastest squeezing, rad/s, m/s, m/s (E)."""
HANGING_SHARE = 0.25
"""A foot that has less than this share of its load hangs, and seeks the ground: in the air no force
tells it (E).
"""
SEEK_M_S = 2.0e-3
"""Speed at which a hanging foot seeks the ground (E)."""
PULL_SLEW_N_S = 4000.0
"""Fastest change of a wanted pull (E)."""


class Squeezing(NamedTuple):
    """These numbers for one machine."""

    tolerance: Any
    edge_start: Any
    speed_limit: Any
    seek_m_s: float
    pull_slew_n_s: float
    hauling: Hauling


def squeezing(scale: Scale) -> Squeezing:
    """Those of a machine of this size."""
    speeds = np.tile([1.0 / scale.speed, scale.speed, scale.speed], len(LEGS))
    return Squeezing(
        np.tile([scale.moment, scale.force, scale.force], len(LEGS)) * TOLERANCE,
        speeds * EDGE_START,
        speeds * SPEED_LIMIT,
        scale.speed * SEEK_M_S,
        scale.force / scale.speed * PULL_SLEW_N_S,
        hauling(scale),
    )


@njit
def add_pull(wanted: Any, tension: Any, dt: float, by: Squeezing, pull: Any, rates: Any) -> None:
    """Let `pull` (2) follow what is wanted (2), N; add to the ropes' rates (2) what brings the
    tensions (2) there.
    """
    step = by.pull_slew_n_s * dt
    for index in range(pull.shape[0]):
        pull[index] += min(max(wanted[index] - pull[index], -step), step)
    haul(tension, pull, by.hauling, rates)


@njit
def add_squeeze(
    force: Any,
    compliance: Any,
    felt: Any,
    wanted: Any,
    dt: float,
    by: Squeezing,
    edges: Any,
    rates: Any,
) -> None:
    """Add to the joints' rates (12) what takes `force` (12) off them, and what lets hanging feet
    seek the ground.

    compliance (12) of the joints; felt, wanted (14): forces in the order of Statics' unknowns;
    edges (2, 12): in first guesses, and -1, 0, 1 as the side, of the last tick, brought up to date.
    """
    edge, side = edges[0], edges[1]
    for index in range(rates.shape[0]):
        size = abs(force[index])
        now = 0.0 if size < by.tolerance[index] else 1.0 if force[index] > 0.0 else -1.0
        if now != 0.0 and now == side[index]:
            edge[index] = min(edge[index] + EDGE_GROWTH_1_S * dt, EDGE_LIMIT)
        else:
            edge[index] = max(1.0, 1.0 if now == 0.0 else 0.7 * edge[index])
        side[index] = now
        rates[index] += now * min(
            GAIN_1_S * compliance[index] * size + edge[index] * by.edge_start[index],
            by.speed_limit[index],
        )
    for leg in range(len(LEGS)):
        if felt[3 * leg] < HANGING_SHARE * wanted[3 * leg]:
            rates[3 * leg + 2] += by.seek_m_s
