"""Drilling loads on the machine: feed, blows, torque, pull-out, the weight of the string.

All act at the drill axis, along the body's z (the hole is normal to the platform). Reaction on the
body: feed and blows push the machine away from the slope (+z), pulling the string out presses it on
(-z), the string in the hole hangs on the feed (its weight's part along the hole; the rest lies on
the hole's wall), what of it stands in the mast acts with all its weight at its middle, the bit's
torque turns the body about -z.
"""

from __future__ import annotations

import math

from testbed.compiled import njit
from testbed.formats.records import Record, quantity


class DrillOrder(Record):
    """What a phase of the drill's program lets act."""

    feed = quantity("N", "pushes the string into the hole, the machine off the slope")
    blow = quantity("N", "peak of a blow")
    blow_rate = quantity("1/s", "blows a second")
    torque = quantity("N m", "on the string")
    pull = quantity("N", "pulls the string out, the machine onto the slope")


class DrillLoads(DrillOrder):
    """What the drill is ordered to do, and where the string is."""

    string_mass = quantity("kg", "string in the hole")
    mast_mass = quantity("kg", "rods in the mast")
    mast_height = quantity("m", "their middle above the drill point")
    depth = quantity("m", "of the hole")


@njit
def blow_mean(phase0: float, phase1: float, width: float) -> float:
    """Mean of a train of half-sine blows of unit peak over phases [phase0, phase1] (one blow a unit
    of phase).

    A blow takes the share `width` of its period. The mean over a step, not a sample: engines
    stepped at other rates see the same momentum.
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
def axial_force(d: DrillLoads, phase0: float, phase1: float, gravity_along_axis: float) -> float:
    """Force on the body along its +z, N; gravity_along_axis: g . z of the body, m/s2 (negative)."""
    blows = d.blow * blow_mean(phase0, phase1, BLOW_WIDTH) if d.blow != 0.0 else 0.0
    weight: float = d.string_mass * gravity_along_axis
    return d.feed + blows - d.pull + weight
