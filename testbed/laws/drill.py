"""Drilling loads on the machine: feed, blows, torque, pull-out, the weight of the string.

All act at the drill axis, along the body's z (the hole is normal to the platform). Reaction on the body:
feed and blows push the machine away from the slope (+z), pulling the string out presses it on (-z), the string in the
hole hangs on the feed (its weight's part along the hole; the rest lies on the hole's wall), what of it stands in the
mast acts with all its weight at its middle, the bit's torque turns the body about -z.
"""

from __future__ import annotations

import math
from typing import Any

from testbed.compiled import njit

(FEED, BLOW_N, BLOW_HZ, TORQUE, PULL, STRING_KG, MAST_KG, MAST_HEIGHT, DEPTH, DRILL_COLUMNS) = (
    range(10)
)
"""Forces in N, torque in N m, blows a second; masses of the string in the hole and in the mast, kg; height of the
latter's middle above the drill point and depth of the hole, m."""
FORCES = slice(FEED, STRING_KG)
"""What a phase orders; the rest is where the string is."""
(THRUST, REACTION, IN_HOLE_KG, IN_MAST_KG, MAST_MIDDLE, STORED_KG, KNOWN) = range(7)
"""What the drill's own controls know: thrust ordered, N, + away from the slope; torque that the rock answers with, N m,
+ about body z; rods in the hole and in the mast, kg; height of the latter's middle above the drill point, m; what the
store has gained since the start, kg."""
KNOWN_COLUMNS = (
    "ordered_thrust",
    "ordered_torque",
    "rods_in_hole",
    "rods_in_mast",
    "rods_mast_height",
    "rods_stored",
)
"""Their names in a recording."""


@njit
def blow_mean(phase0: float, phase1: float, width: float) -> float:
    """Mean of a train of half-sine blows of unit peak over phases [phase0, phase1] (one blow a unit of phase).

    A blow takes the share `width` of its period. The mean over a step, not a sample: engines stepped at other rates
    see the same momentum.
    """

    def integral(phase: float) -> float:
        whole = math.floor(phase)
        part = phase - whole
        one = 2.0 * width / math.pi
        inside = (
            one if part >= width else width / math.pi * (1.0 - math.cos(math.pi * part / width))
        )
        return whole * one + inside

    if phase1 <= phase0:
        return 0.0
    return (integral(phase1) - integral(phase0)) / (phase1 - phase0)


BLOW_WIDTH = 0.25
"""Share of the period that a blow's reaction on the sledge lasts (assumed)."""


@njit
def axial_force(d: Any, phase0: float, phase1: float, gravity_along_axis: float) -> float:
    """Force on the body along its +z, N. d: DRILL_COLUMNS; gravity_along_axis: g . z of the body, m/s2 (negative)."""
    blows = d[BLOW_N] * blow_mean(phase0, phase1, BLOW_WIDTH) if d[BLOW_N] != 0.0 else 0.0
    weight: float = d[STRING_KG] * gravity_along_axis
    return float(d[FEED] + blows - d[PULL] + weight)
