"""What makes the crawl's gaits differ: how the body goes on while legs swing, what is hurried."""

from __future__ import annotations

from dataclasses import dataclass

from testbed.control.gaits.crawl.pace import RAMP, SWING_RAMP
from testbed.control.gaits.crawl.rope_hold import THREE_FEET
from testbed.control.gaits.crawl.swing import AS_USUAL, CLEAR, Haste

SEAT_S = 0.5
"""How long a foot is seated after it has met the ground (E)."""
UNLOAD_M_S = 0.005
"""How fast a foot is taken off the ground: one that is torn off makes the one across from it jump
(E).
"""
GENTLE, STEEP = 0.6, 0.3
"""On a slope on which feet carry more than the first share of the weight the body usually flows in
full; where they carry less than the second one, it rests while legs swing (E).
"""
HEAVY, LIGHT = 0.5, 0.25
"""Feet that carry more than the first share of the weight are heavy, those that carry less than the
second one light: a little that ropes pull otherwise than they should draws their load far aside
(E).
"""
CREEP_EASE = 1.2
"""The body usually takes so many times its least time for that: the rest of valves, pump and ropes
is the swings' (E).
"""


@dataclass(frozen=True)
class GaitStyle:
    """What makes a gait one of its own. All numbers (E)."""

    creep: float
    """Share of its way that the body makes while legs swing."""
    flows: bool = False
    """Whether it does so only as far as the slope is gentle."""
    gentle: float = GENTLE
    """A slope is gentle altogether where feet carry this share of the weight."""
    steep: float = STEEP
    """A slope is steep altogether, and nobody in a hurry, where feet carry this share of it."""
    seat_s: float = SEAT_S
    """How long a foot is seated before anything else begins."""
    lead_s: float = 0.0
    """So long before the body is over the others, a leg is unloaded."""
    margin: float = 1.0
    """Share of the usual margin that is enough where feet are heavy."""
    light_margin: float = 1.0
    """Share of the usual margin that is enough where feet are light."""
    haste: float = 1.0
    """See Pace."""
    unload_m_s: float = UNLOAD_M_S
    """Before it swings, a foot is raised at this speed."""
    clear: float = CLEAR
    """See Swing."""
    swing_ramp: float = SWING_RAMP
    """See Swing."""
    ramp: float = RAMP
    """Share of the time of the body's ways in which its speed rises, and falls."""
    creep_ease: float = CREEP_EASE
    """The body takes so many times its least time for its way while legs swing."""
    three_feet: float = THREE_FEET
    """On three feet tensions may differ from what is wanted by so much of what they usually may."""
    lifts_over_steps: bool = True
    """Whether a foot is lifted by its swing height over all that the ground may rise by, or over
    what is expected.
    """
    search_from: float = 1.0
    """The search begins above this share of what the ground may lie higher. Ground that is met
    before, while the foot still goes over, is felt as well.
    """
    search: Haste = AS_USUAL
    """How fast the ground is sought, on gentle slopes."""
    prints: bool = False
    """Whether a foot expects the ground where other feet have found it."""
    trims: bool = False
    """Whether the ropes pull so much more or less that light feet carry alike."""
    strokes: bool = False
    """Whether the body rests while a traction device goes back, and what a device owes is not asked
    of it again.
    """

    def enough(self, lightness: float) -> float:
        """Share of the usual margin that is enough with feet that carry this share of the
        weight.
        """
        return self.margin + lightened(lightness) * (self.light_margin - self.margin)

    def trimmed(self, lightness: float) -> float:
        """Share of what the load lies off the middle of the feet that the ropes make up for."""
        return lightened(lightness) if self.trims else 0.0


def lightened(lightness: float) -> float:
    """How light feet are that carry this share of the weight: 0 (HEAVY) to 1 (LIGHT)."""
    return min(max((HEAVY - lightness) / (HEAVY - LIGHT), 0.0), 1.0)


UNHURRIED = GaitStyle(0.0)
STYLES = {
    "two_phase": UNHURRIED,
    "wave": GaitStyle(0.5),
    "flowing": GaitStyle(0.6, flows=True),
    "brisk": GaitStyle(
        creep=0.75,
        flows=True,
        gentle=0.08,
        steep=0.03,
        seat_s=0.15,
        lead_s=0.8,
        margin=0.6,
        light_margin=0.3,
        haste=1.2,
        unload_m_s=0.008,
        clear=0.1,
        swing_ramp=0.14,
        creep_ease=1.1,
        strokes=True,
        trims=True,
        prints=True,
        lifts_over_steps=False,
        search_from=0.3,
        ramp=0.06,
        three_feet=0.7,
        search=Haste(near=3.0, far=1.5, most_s=0.25),
    ),
}
