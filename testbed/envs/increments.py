"""An agent's increments: what an action of the plain tasks adds to the set points of the trim."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from testbed.control.layers.trim import Trim
from testbed.control.observed import Observed
from testbed.machine.names import LEGS, SIDES

OFFSET_STEP_M = 1.0e-4
"""Increment of a vertical set point for an action of 1: one encoder count a step."""
OFFSET_RANGE_M = 0.02
"""Furthest that an agent may move a vertical set point."""
PULL_STEP_N = 200.0
"""Increment of a wanted rope pull for an action of 1."""
PULL_RANGE_N = 3.14e4
"""Rating of a traction device (D)."""


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
"""The action, index by index."""


def increase(trim: Trim, action: NDArray[np.float64]) -> None:
    """Add an action (6,) in [-1, 1] to a trim whose wanted pulls are known, within the ranges."""
    assert trim.pull_n is not None
    goal = trim.goal_m + OFFSET_STEP_M * action[: len(LEGS)]
    trim.goal_m = np.clip(goal, -OFFSET_RANGE_M, OFFSET_RANGE_M)
    pull = trim.pull_n + PULL_STEP_N * action[len(LEGS) :]
    trim.pull_n = np.clip(pull, 0.0, PULL_RANGE_N)


def increased(trim: Trim) -> dict[str, float]:
    """Where a trim's set points are by now, by the names of the observations' table: m, N."""
    assert trim.pull_n is not None
    return {
        **{f"orders.offset_{leg}": trim.goal_m[index] for index, leg in enumerate(LEGS)},
        **{f"orders.pull_{side}": trim.pull_n[index] for index, side in enumerate(SIDES)},
    }
