"""An agent's increments: what an action of the plain tasks adds to the set points of the trim."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from testbed.control.layers.trim import Trim
from testbed.control.measured import Observed
from testbed.formats.arrays import Array
from testbed.machine.model import Machine
from testbed.machine.names import LEGS, SIDES

OFFSET_STEP_M = 1.0e-4
"""Increment of a vertical set point of ROBOCLIMBER for an action of 1: one encoder count a step."""
OFFSET_RANGE_M = 0.02
"""Furthest that an agent may move a vertical set point of ROBOCLIMBER."""
PULL_STEP_N = 200.0
"""Increment of a wanted pull of ROBOCLIMBER's ropes for an action of 1."""


def action_rows(
    meaning: str, names: Sequence[str], unit: str, frame: str, size: float
) -> list[Observed]:
    """Rows of an action's table: what -1 to 1 means for each of `names`, from -size to size."""
    return [
        Observed(f"action_{name}", meaning.format(name), unit, frame, -size, size) for name in names
    ]


INCREMENTS = (
    *action_rows("vertical set point of {}, increment", LEGS, "m", "joint", OFFSET_STEP_M),
    *action_rows("wanted pull of the {} rope, increment", SIDES, "N", "along it", PULL_STEP_N),
)
"""The action of ROBOCLIMBER, index by index."""


def increase(trim: Trim, by: Array, machine: Machine) -> None:
    """Add increments (6,), m and N, to a trim whose wanted pulls are known: set points within their
    range, pulls within the rating of the traction devices.
    """
    assert trim.pull_n is not None
    furthest_m = machine.scale.length * OFFSET_RANGE_M
    trim.goal_m = np.clip(trim.goal_m + by[: len(LEGS)], -furthest_m, furthest_m)
    trim.pull_n = np.clip(trim.pull_n + by[len(LEGS) :], 0.0, machine.traction.rating_n)


def increased(trim: Trim) -> dict[str, float]:
    """Where a trim's set points are by now, by the names of the observations' table: m, N."""
    assert trim.pull_n is not None
    return {
        **{f"orders.offset_{leg}": trim.goal_m[index] for index, leg in enumerate(LEGS)},
        **{f"orders.pull_{side}": trim.pull_n[index] for index, side in enumerate(SIDES)},
    }
