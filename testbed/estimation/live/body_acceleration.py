"""Fast changes of the foot loads from the body's acceleration, since pressures hardly show them.
Compiled.

The seal of a piston at rest takes up fast changes of its load: under blows near the resonance of
body and oil the pressures show a few per cent of what the feet feel. Newton's law shows the sum,

    r = m a_z - sum of the loads,   fast = r - its mean over the last MEMORY_S,

with m the mass that moves with the body and a_z its specific force along z. The share TRUST of
`fast` is added to the feet that carry, in equal parts, since all legs are about equally stiff.
Slower changes are left to the balance of the whole body (whole_body.py). The blows themselves are
not measured: beyond the resonance they make `fast` larger than what the feet feel, which is why
TRUST is less than 1.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from testbed.compiled import njit
from testbed.formats.arrays import Array
from testbed.formats.records import Record, quantity
from testbed.machine.names import LEGS

if TYPE_CHECKING:
    from testbed.estimation.live.body_records import BodyBelief


MEMORY_S = 0.04
"""Time constant of the mean (E)."""
TRUST = 0.85
"""Share that is believed, chosen on drawn machines that no result is taken from (E)."""
CARRIES_S = 0.03
"""Time constant of the load by which a foot carries (E)."""


class AccelerationMemory(Record):
    """What is remembered."""

    mean = quantity("N", "of what the acceleration shows beyond the loads")
    load = quantity("N", "mean load of a foot", per=LEGS)
    started = quantity("1", "1 once there was a sample")


@njit
def add_fast_changes(
    specific_force: float, loads: Array, belief: BodyBelief, state: AccelerationMemory
) -> None:
    """One step: add to the loads (4), N, what the body's acceleration shows of their fast changes.

    specific_force: of the body along z, m/s2. A missing sample changes nothing.
    """
    dt, beyond, feet = belief.decisions.dt, belief.body_mass * specific_force, 0.0
    for k in range(4):
        beyond -= loads[k]
    if not math.isfinite(beyond):
        return
    first = state.started == 0.0
    state.started = 1.0
    state.mean += (1.0 if first else dt / (MEMORY_S + dt)) * (beyond - state.mean)
    for k in range(4):
        state.load[k] += (1.0 if first else dt / (CARRIES_S + dt)) * (loads[k] - state.load[k])
        feet += share_carried(state.load[k], belief)
    fast = TRUST * (beyond - state.mean) / max(feet, 1.0)
    for k in range(4):
        shaken = loads[k] + share_carried(state.load[k], belief) * fast
        loads[k] = max(shaken, min(loads[k], 0.0))  # no foot pulls by it


@njit
def share_carried(load: float, belief: BodyBelief) -> float:
    """How much of its part a foot of this mean load (N) takes, 0 to 1."""
    return min(max(load / belief.carries, 0.0), 1.0)
