"""How unsteadily the body moves, and how uncertain that makes the load of a foot whose piston
slides. Compiled.

While the body sways, the estimate errs: friction changes its sign, legs bend, and encoders and
pressures respond with different delays. While it moves steadily, none of these matters. All feet
together feel the force m a, with m the moving mass and a the body's specific force. A foot that
carries is therefore taken to err by a share of its quarter of m times the standard deviation of a
over the last MEMORY_S: the share is BEGUN when its piston has just begun to slide, SLIDING later.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from testbed.compiled import njit
from testbed.estimation.live.body_acceleration import share_carried
from testbed.formats.arrays import Array
from testbed.formats.records import Record, quantity
from testbed.machine.names import LEGS
from testbed.recording.rows import XYZ

if TYPE_CHECKING:
    from testbed.estimation.live.body_records import BodyBelief


MEMORY_S = 0.1
"""Time over which the standard deviation is taken (E)."""
BEGUN, SLIDING = 1.0, 0.25
"""Shares of m a; chosen on drawn machines that no result is taken from (E)."""


class Stirred(Record):
    """Running mean and variance of the body's specific force."""

    mean = quantity("m/s2", "of the body's specific force", per=XYZ)
    variance = quantity("m2/s4", "of it about that, all three axes together")
    started = quantity("1", "1 once there was a sample")


@njit
def stir(specific_force: Array, dt: float, state: Stirred) -> None:
    """Update mean and variance by specific_force (3) of the body, m/s2, after dt (s); a missing
    sample changes nothing.
    """
    square = 0.0
    for k in range(3):
        square += (specific_force[k] - state.mean[k]) ** 2
    if not math.isfinite(square):
        return
    first = state.started == 0.0
    state.started = 1.0
    share = dt / (MEMORY_S + dt)
    state.variance += 0.0 if first else share * (square - state.variance)
    for k in range(3):
        state.mean[k] += (1.0 if first else share) * (specific_force[k] - state.mean[k])


@njit
def moving_variance(load: float, begun: float, belief: BodyBelief, state: Stirred) -> float:
    """Variance of a foot's load (N) while its piston slides, beside friction's, N2; begun:
    just_begun of reported_shares.py.
    """
    share = SLIDING + (BEGUN - SLIDING) * begun
    own = share * belief.body_mass / len(LEGS) * share_carried(load, belief)
    return belief.steady_sd**2 + own * own * state.variance
