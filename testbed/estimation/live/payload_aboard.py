"""An undeclared weight on board, as the alternative to a sensor that reads wrong
(faulty_sensor.py). Compiled.

A mass m at the place c on the platform leaves the balance the residual

    m d(c),   d(c) = column of the mass + c_x column of m c_x + c_y column of m c_y

T(c), the rise of twice the log likelihood, is computed as for a sensor, and the best of a grid of
places is compared with the best sensor. The two can be told apart: a weight lies between the feet,
a sensor's error acts at one of them. Where the weight explains more, the priors of mass and first
moment are widened by its size and both are learnt like any other unknown; no sensor is blamed.
"""

from __future__ import annotations

import math

import numpy as np

from testbed.compiled import njit
from testbed.estimation.live import unknowns
from testbed.estimation.live.fusion import Fusion, start
from testbed.estimation.live.unknowns import VERTICAL_EQUATIONS
from testbed.formats.arrays import Array

STEPS = 5
"""Places along each side of the platform."""
WITHIN = 0.6
"""Share of the platform, from its middle, in which a weight is looked for: nearer to the edge it
looks like a sensor's error at that corner (E).
"""
ALONG, ACROSS = 0, 1
HEIGHT_SHARE = 0.5
"""How far a weight lies above the platform, in halves of the platform's length (E)."""


@njit
def likeliest_payload(rows: Array, weights: Array, missing: Array, reach: Array) -> Array:
    """T, mass kg, x m, y m of the weight that explains most of what is missing.

    rows (6, unknowns); weights (3, 3): inverse covariance of what is `missing` (3) on a
    sound machine; reach (2): half of the platform's length and width, m.
    """
    best, way = np.zeros(4), np.empty(len(VERTICAL_EQUATIONS))
    for step in range(STEPS):
        for other_step in range(STEPS):
            x = WITHIN * reach[ALONG] * (2.0 * step / (STEPS - 1) - 1.0)
            y = WITHIN * reach[ACROSS] * (2.0 * other_step / (STEPS - 1) - 1.0)
            for place in range(len(VERTICAL_EQUATIONS)):
                row = rows[VERTICAL_EQUATIONS[place]]
                way[place] = (
                    row[unknowns.MASS] + x * row[unknowns.MOMENT] + y * row[unknowns.MOMENT + 1]
                )
            push = pushed = 0.0
            for place in range(len(VERTICAL_EQUATIONS)):
                for other in range(len(VERTICAL_EQUATIONS)):
                    push += way[place] * weights[place, other] * missing[other]
                    pushed += way[place] * weights[place, other] * way[other]
            if pushed > 0.0 and push * push / pushed > best[0]:
                best[0], best[1], best[2], best[3] = push * push / pushed, push / pushed, x, y
    return best


@njit
def free_payload(payload: Array, reach: Array, fusion: Fusion) -> None:
    """Widen the priors of mass and first moment by this weight (likeliest_payload), and start the
    filter anew: what it had learnt explained the weight by something else.
    """
    mass, known = abs(payload[1]), fusion.suspicion.known
    known[unknowns.MASS] = math.hypot(known[unknowns.MASS], mass)
    for k, lever in enumerate((reach[ALONG], reach[ACROSS], HEIGHT_SHARE * reach[ALONG])):
        known[unknowns.MOMENT + k] = math.hypot(known[unknowns.MOMENT + k], mass * lever)
    start(fusion, known[: len(unknowns.CONSTANTS)])
