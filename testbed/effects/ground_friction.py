"""ground.friction: another friction under one foot."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import Course, RobotSeen, Signature
from testbed.effects.terms import Values
from testbed.formats.arrays import Flags
from testbed.machine.names import LEGS, VERTICAL

BEARS = 0.25
"""A foot bears from this share of its usual load on (E)."""
MOST_USED, UNSURE, UNSURE_SHARE = 0.9, 0.15, 0.3
"""All the friction that a foot has is what it uses at this quantile of its time on the ground; use
is known to this, or to this share of it (E).
"""
STRETCH_S = 0.5
"""A foot slips in jerks: how far is a number of its own for each stretch of this length. In
stretches of 2 s a shifted encoder of its leg explained what was left of the jerks (E).
"""
SIZES = (1.6, 0.5, 0.16, 0.05)
"""How far a foot goes in a stretch, in usual ways: one slips by some millimetres at once, or creeps
by less than one all along (E).
"""
AT_ANY_USE = 3.0
"""Ln of the odds against a foot that seems to slip without using all the friction that it has. A
walking machine's foot of 0.09 was believed to use 0.03 to 0.12 as it slipped and 0.4 at rest: stuck
seals hide how four feet share what they push (E).
"""
LITTLE_USE = 0.15
"""In the median of its bins such a foot seems to use no more than this. Against one that seems to
use more the odds grow with the square of the ratio: feet that slipped used 0.08 to 0.13, others
that moved with them 0.17 to 0.5 (E).
"""
FAST = 0.5
"""Share of its farthest way in a stretch from which a foot slips fast (E)."""


class GroundFriction(Effect):
    """Another coefficient of friction between one foot and its ground."""

    kind = "ground.friction"
    equation = "|F_t| <= coefficient F_n under this foot"
    text = "one foot stands on wet, icy or polished rock"
    parameters = (
        ParameterSpec("coefficient", "1", 0.02, 2.0, (0.1, 0.5), "in place of the declared one"),
    )
    places = tuple(f"foot_{leg}" for leg in LEGS)
    rigs = ()
    telling_motion = "shift the body sideways until the foot slips"
    hides = {"coefficient": "friction"}
    usual = 5.0e-3

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """How far the foot slips up the slope and to the left within each STRETCH_S: only while
        it uses all the friction that it has.
        """
        leg = self.places.index(place)
        use, bears = seen.friction_use[:, leg], self._bears(seen, place)
        most = float(np.quantile(use[bears], MOST_USED))
        return _slips(seen, leg, bears & (use > most - max(UNSURE, UNSURE_SHARE * most)))

    def courses(self, seen: RobotSeen, place: str) -> tuple[Course, ...]:
        """It may slip far or little; and whenever it bears, if what it uses is known badly."""
        leg, bears = self.places.index(place), self._bears(seen, place)
        usually = float(np.median(seen.friction_use[bears, leg]))
        return (
            Course(self.signature(seen, place), SIZES),
            Course(
                _slips(seen, leg, bears), SIZES, AT_ANY_USE * max(usually / LITTLE_USE, 1.0) ** 2
            ),
        )

    def _bears(self, seen: RobotSeen, place: str) -> Flags:
        """(n,) whether a foot bears in a bin."""
        load_n = np.abs(seen.load_n[:, VERTICAL[self.places.index(place)]])
        return np.asarray(load_n > BEARS * np.median(load_n))

    def from_linear(self, linear: Values, seen: RobotSeen, place: str) -> dict[str, float]:
        """What friction the foot used while it slipped."""
        leg = self.places.index(place)
        stretch = _stretch(seen)
        way = np.zeros((2, int(stretch[-1]) + 1))
        for number, size in linear.items():
            axis, index = map(int, number.split())
            way[axis, index] = size
        far = np.linalg.norm(way, axis=0)
        use = seen.friction_use[:, leg][far[stretch] >= FAST * far.max()]
        return {"coefficient": float(np.median(use))}


def _stretch(seen: RobotSeen) -> npt.NDArray[np.int64]:
    """(n,) which stretch of STRETCH_S a bin is in."""
    return np.asarray(seen.time_s // STRETCH_S, dtype=np.int64)


def _slips(seen: RobotSeen, leg: int, slips: Flags) -> Signature:
    """A number for each way along the slope within each stretch that has bins (n,) of slipping."""
    stretch = _stretch(seen)
    ways = {int(k): np.cumsum(slips & (stretch == k)) for k in np.unique(stretch[slips])}
    return {
        f"{axis} {k}": seen.moves(leg, way / way[-1], axis)
        for axis in (0, 1)
        for k, way in ways.items()
    }


EFFECTS = (GroundFriction(),)
