"""How unsteadily the body goes, and what that leaves unknown of the load of a foot whose piston
slides. Compiled.

Friction that turns with the motion, legs that bend, and encoders and pressures that answer with
different delays make the estimate err while the body sways; where it goes steadily nothing does.
What the feet feel of it together is m a, m what moves with the body: so a foot that carries errs by
a share of its quarter of m times the standard deviation of a over the last MEMORY_S: BEGUN of it
when its piston has just begun to slide, SLIDING later.
"""

from __future__ import annotations

import math
from typing import Any

from testbed.compiled import njit
from testbed.estimation.live.body_acceleration import share_carried
from testbed.formats.records import Record, quantity
from testbed.machine.names import LEGS
from testbed.recording.rows import XYZ

MEMORY_S = 0.1
"""Over which it is looked at (E)."""
BEGUN, SLIDING = 1.0, 0.25
"""Chosen on drawn machines that no result is taken from (E)."""


class Stirred(Record):
    """How the body was stirred."""

    mean = quantity("m/s2", "of the body's specific force", per=XYZ)
    variance = quantity("m2/s4", "of it about that, all three axes together")
    started = quantity("1", "1 once there was a sample")


@njit
def stir(specific_force: Any, dt: float, state: Any) -> None:
    """One step of dt (s) on: specific_force (3) of the body, m/s2. Missing ones teach nothing."""
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
def moving_variance(load: float, begun: float, body: Any, state: Any) -> float:
    """Of a foot's load (N) while its piston slides, beside friction's, N2; begun: how much it has
    only just begun to, 1 to 0; body: BodyBelief.
    """
    share = SLIDING + (BEGUN - SLIDING) * begun
    own = share * body.body_mass / len(LEGS) * share_carried(load, body)
    return float(body.steady_sd**2 + own * own * state.variance)
