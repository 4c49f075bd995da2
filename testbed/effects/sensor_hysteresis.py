"""sensor.hysteresis: pressure sensors that show less than they have come from."""

from __future__ import annotations

import numpy as np

from testbed.compiled import njit
from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import RobotSeen, Signature
from testbed.formats.arrays import Array

TURNED_PA = 2.0e4
"""A reading that has gone back by twice as much has turned round: less may be noise (E)."""


@njit
def sense_of_reading(reading_pa: Array, turned_pa: float) -> Array:
    """(n,) which way readings (n,) have come, -1 to 1, as a backlash of half width `turned_pa` that
    follows them tells; 0 until one has moved.
    """
    out = np.empty_like(reading_pa)
    follows = reading_pa[0]
    for index in range(len(reading_pa)):
        follows = min(max(follows, reading_pa[index] - turned_pa), reading_pa[index] + turned_pa)
        out[index] = (reading_pa[index] - follows) / turned_pa
    return out


class Hysteresis(Effect):
    """A backlash between the pressure and what both sensors of a cylinder show."""

    kind = "sensor.hysteresis"
    equation = "measured p stays where it is until p is further away than width"
    text = "the diaphragms of both pressure sensors of a cylinder stick or creep"
    parameters = (
        ParameterSpec("width", "Pa", 0.0, 1e6, (2e3, 2.5e4), "half the width of the loop"),
    )
    is_tolerance = True
    rigs = ()
    telling_motion = "raise the load in steps and lower it by the same ones"
    alike = {
        "friction.pressure": "friction changes with motion, hysteresis with the pressure's way"
    }
    hides = {"width": "hysteresis_pa"}
    usual = 4.0e5
    """A loop beyond a data sheet's is far beyond, as for zeros."""

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """Both sensors read too little of a pressure that rose, and too much of one that fell."""
        axis = seen.axis(place)
        senses = [sense_of_reading(one, TURNED_PA) for one in seen.pressures_pa(axis).T]
        return {"width": seen.both_read(axis, -np.column_stack(senses))}


EFFECTS = (Hysteresis(),)
