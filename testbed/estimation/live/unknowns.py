"""The unknowns of the whole-body estimate's Kalman filter (fusion.py), and the equations of the
balance that it observes: what each is, and its place in the filter's vector.
"""

from __future__ import annotations

from testbed.formats.records import Record, quantity
from testbed.machine.names import AXES, SIDES
from testbed.recording.rows import XYZ

WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
"""The six equations of the body's balance: forces along its axes, moments about them."""
VERTICAL_EQUATIONS = tuple(WRENCH.index(name) for name in ("fz", "tx", "ty"))
"""Places in WRENCH of the three equations that the vertical cylinders dominate."""
VERTICAL_WRENCH = tuple(WRENCH[place] for place in VERTICAL_EQUATIONS)


class Constants(Record):
    """What stays as it is while the machine works, each as the difference from what is believed."""

    zero = quantity("N", "what the sensors of a cylinder add to its force", per=AXES)
    out = quantity("N", "dry friction of a piston that slides out", per=AXES)
    back = quantity("N", "dry friction of a piston that slides in", per=AXES)
    side = quantity("1", "friction by the load across the rod", per=AXES)
    mass = quantity("kg", "mass of the machine")
    moment = quantity("kg m", "its first moment about the body's origin, body frame", per=XYZ)
    unit = quantity("rad", "how the inertial unit is turned on the body", per=("roll", "pitch"))
    azimuth = quantity("rad", "direction of a rope, about the body's z", per=SIDES)
    elevation = quantity("rad", "direction of a rope, towards the body's z", per=SIDES)
    pin_gain = quantity("1", "reading of a load pin by true tension", per=SIDES)
    pin_zero = quantity("N", "reading of a slack rope's load pin", per=SIDES)
    rope_height = quantity("m", "height at which a rope pulls", per=SIDES)


class Unknowns(Constants):
    """Everything that is learnt."""

    deviation = quantity("N", "friction less what all of that makes of it", per=AXES)
    balance = quantity("N", "momentary error of the body's balance (moments N m)", per=WRENCH)


NAMES, CONSTANTS = tuple(Unknowns.column_names()), tuple(Constants.column_names())
"""Every unknown in the filter's order, which begins with the constants."""
COUNT = len(NAMES)


def place(name: str) -> int:
    """Where a quantity of `Unknowns` begins in the filter's vector."""
    return next(
        index
        for index, column in enumerate(NAMES)
        if column == name or column.startswith(name + "_")
    )


ZERO, OUT, BACK, SIDE = place("zero"), place("out"), place("back"), place("side")
MASS, MOMENT, UNIT = place("mass"), place("moment"), place("unit")
AZIMUTH, ELEVATION = place("azimuth"), place("elevation")
PIN_GAIN, PIN_ZERO, ROPE_HEIGHT = place("pin_gain"), place("pin_zero"), place("rope_height")
DEVIATION, BALANCE = place("deviation"), place("balance")
