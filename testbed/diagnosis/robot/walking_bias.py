"""What the balances of a body on its ropes miss while it walks, alike on all sound machines.

Stuck seals of the legs that carry take up what a swinging leg leaves to them, and ropes are hauled
meanwhile: together as if the body were lighter than it is, and its ropes somewhat off. A body that
lifts its feet on level ground without ropes misses nothing of the kind.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from testbed.effects.rope_direction import RopeDirection
from testbed.effects.rope_tension_gain import TensionGain
from testbed.effects.signature import Change, RobotSeen
from testbed.machine.scale import Scale

LEAST_PULL = 0.05
"""Share of what its feet bear: a machine of whose ropes both pull less, in the mean, does not hang
on them (E).
"""
Array = npt.NDArray[np.float64]
WALKS_OFF = 0.04
"""Share of the ropes' pull, and rad of their way, that a walk's balance misses (E)."""
SEEMS_KG, SEEMS_KG_M = -75.0, (-50.0, 0.0, -95.0)
"""A walking body's mass and first moments (body frame) beside its own, as its balance has them: the
common ones of 59 walks of sound drawn machines on 25 to 82 degrees, uphill, across and aslant, in
stances of all widths (B).
"""
SEEMS_KG_SD, SEEMS_KG_M_SD = 20.0, (20.0, 0.0, 20.0)
"""Standard deviations of single walks from that, beyond those of what machines differ by: these
walks are likeliest by less (B).
"""


def hangs(seen: RobotSeen, foot_force: Array) -> bool:
    """Whether ropes pull on a machine whose feet bear `foot_force` (n, 4, 3), N; load pins read
    something where they do not.
    """
    on_feet_n = np.linalg.norm(foot_force.sum(axis=1), axis=1).mean()
    return bool(seen.tension_n.sum(axis=1).mean() > LEAST_PULL * on_feet_n)


def lighter(seen: RobotSeen, scale: Scale) -> Change:
    """What a sound machine of this size that walks on its ropes is known to miss."""
    numbers = np.array([SEEMS_KG, *(scale.length * moment for moment in SEEMS_KG_M)])
    return seen.weighs(scale.times("kg") * (seen.asked_by_moment @ numbers))


def spread_of_walks(seen: RobotSeen, foot_force: Array, scale: Scale) -> Iterator[Change]:
    """All by which what sound machines miss differs from walk to walk, one standard deviation each;
    `foot_force`: see `hangs`.
    """
    yield from ropes_off(seen)
    if hangs(seen, foot_force):
        yield from lighter_yet(seen, scale)


def lighter_yet(seen: RobotSeen, scale: Scale) -> Iterator[Change]:
    """By one standard deviation each, how much more or less than `lighter` a walk may miss."""
    by_number = np.diag([SEEMS_KG_SD, *(scale.length * moment for moment in SEEMS_KG_M_SD)])
    for numbers in by_number[np.any(by_number > 0.0, axis=1)]:
        yield seen.weighs(scale.times("kg") * (seen.asked_by_moment @ numbers))


def ropes_off(seen: RobotSeen) -> Iterator[Change]:
    """What it misses besides, by one standard deviation each: as if both pins read too much, or
    both ropes came from higher up.
    """
    for effect, number in ((TensionGain(), "gain_error"), (RopeDirection(), "elevation")):
        ropes = [effect.signature(seen, place)[number] for place in effect.places_on_robot]
        wrenches = [rope.wrench for rope in ropes if rope.wrench is not None]
        if wrenches:
            yield Change(wrench=np.sum(wrenches, axis=0)).times(WALKS_OFF)
