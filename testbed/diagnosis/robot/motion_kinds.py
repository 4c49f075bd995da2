"""What a machine does in a recording, as far as it decides what sound machines seem to show."""

from __future__ import annotations

import numpy as np

from testbed.diagnosis.robot.balance import BodyBalance
from testbed.diagnosis.robot.forces import walks
from testbed.diagnosis.robot.groups import Balances
from testbed.machine.names import AXES

SWAY, WALK, DRILL = "sway", "walk", "drill"
"""The kinds of motion that the probabilities were fitted to; others count as all of these."""
SECOND = "second"
"""Beside the kinds of all, of recordings that are weighed together: a far sway seems to show
more of a supply that droops than is hidden (3.3, 3.4 and 10.2 of evidence on three machines).
"""
RAISED = 0.3
"""Share of its stroke by which a leg's vertical cylinder moves at most while the machine sways, up
to 0.26 in the runs that were fitted; a machine that is raised moves it further (B).
"""
VERTICAL = [index for index, axis in enumerate(AXES) if axis.endswith("vertical")]


def motion_kinds(balances: Balances) -> tuple[str, ...]:
    """The kinds of motion of a recording, or of several together, each once."""
    kinds = dict.fromkeys(kind for body in balances.bodies for kind in motion_kind(body))
    return (*kinds, SECOND) if balances.others else tuple(kinds)


def motion_kind(body: BodyBalance) -> tuple[str, ...]:
    """WALK where feet are lifted, else DRILL where the drill pushes, else SWAY where the feet keep
    their places and the legs bend no further than a sway asks for; else all of them.
    """
    if walks(body):
        return (WALK,)
    if np.any(body.seen.thrust_n != 0.0):
        return (DRILL,)
    travel_m = np.ptp(body.seen.extension_m[:, VERTICAL], axis=0)
    raised = np.any(travel_m > RAISED * body.seen.stroke_m[VERTICAL])
    return (SWAY, WALK, DRILL) if raised else (SWAY,)
