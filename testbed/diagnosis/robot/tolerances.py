"""By how much a sound machine may differ from its drawing: standard deviations of the workshop's
tolerances.
"""

from __future__ import annotations

import math
from functools import cache

from testbed.machine.scale import ROBOCLIMBER, Scale
from testbed.scenario.machines import Tolerance, tolerances

FILE = "workshop"
LATE_S = 7.0e-3
"""By how much pressures of any machine are late: lines, converters, seals that bend (E). Air that a
workshop leaves in a line makes it late by up to 16 ms, and that too is of a sound machine.
"""


def standard_deviation(number: str, drawing: float = 0.0, scale: Scale = ROBOCLIMBER) -> float:
    """How far the number of that name (`*` for each) lies from `middle`, over drawn machines of
    this size; 0 where no tolerance names it.
    """
    found = _table().get(number)
    if found is None:
        return 0.0
    spread = found.standard_deviation(number, drawing, scale)
    if found.chance == 1.0:
        return spread
    return math.hypot(spread, found.times(number, scale) * found.moments()[0])


def middle(number: str, drawing: float) -> float:
    """What the number may be expected to be: the middle of its tolerance, which need not be the
    drawing's.
    """
    found = _table().get(number)
    if found is None or found.chance < 1.0:
        return drawing
    return 0.5 * sum(found.applied(drawing, end) for end in found.range)


def expected(number: str, believed: float, drawing: float) -> float:
    """What a machine's number may be expected to be: what was told of it, by a commissioning or a
    model's file, where that is another one than the drawing's; else the middle of its tolerance.
    """
    return middle(number, drawing) if believed == drawing else believed


def chance(number: str) -> float:
    """How often a machine has the number at all; 1 where no tolerance names it."""
    found = _table().get(number)
    return 1.0 if found is None else found.chance


@cache
def _table() -> dict[str, Tolerance]:
    return {tolerance.number: tolerance for tolerance in tolerances(FILE)}
