"""What the balances of a body on its ropes miss while it walks, alike on all sound machines.

Stuck seals of the legs that carry take up what a swinging leg leaves to them, and ropes are hauled
meanwhile: together as if the body were lighter than it is, and its ropes somewhat off.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from testbed.effects.rope_direction import RopeDirection
from testbed.effects.rope_tension_gain import TensionGain
from testbed.effects.signature import Change, RobotSeen
from testbed.machine.scale import Scale

WALKS_OFF = 0.04
"""Share of the ropes' pull, and rad of their way, that a walk's balance misses (E)."""
SEEMS_KG, SEEMS_KG_M = -280.0, (-490.0, 0.0, -650.0)
"""A walking body's mass and first moments (body frame) beside its own, as its balance has them: the
common ones of 14 walks of sound drawn machines on 30 to 60 degrees, +- 27 kg and 49, 10, 48 kg m
(B). One machine lies no further from them than its tolerances and its noise say.
"""


def lighter(seen: RobotSeen, scale: Scale) -> Change:
    """What a sound walking machine of this size is known to miss."""
    numbers = np.array([SEEMS_KG, *(scale.length * moment for moment in SEEMS_KG_M)])
    return seen.weighs(scale.times("kg") * (seen.asked_by_moment @ numbers))


def ropes_off(seen: RobotSeen) -> Iterator[Change]:
    """What it misses besides, by one standard deviation each: as if both pins read too much, or
    both ropes came from higher up.
    """
    for effect, number in ((TensionGain(), "gain_error"), (RopeDirection(), "elevation")):
        ropes = [effect.signature(seen, place)[number] for place in effect.places_on_robot]
        wrenches = [rope.wrench for rope in ropes if rope.wrench is not None]
        if wrenches:
            yield Change(wrench=np.sum(wrenches, axis=0)).times(WALKS_OFF)
