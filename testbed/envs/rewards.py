"""Rewards: terms computed from the truth after each step, and their weights."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.errors import InputError
from testbed.formats.arrays import Array, Flags
from testbed.machine.scale import ROBOCLIMBER, Scale
from testbed.recording.rows import XYZ

LOST_N = 200.0
"""A foot of ROBOCLIMBER that is meant to carry and has less true normal load is lost (E)."""


@dataclass(frozen=True)
class Truth:
    """What the world knows of one step of an environment; sizes in N, m, rad."""

    lowest_normal_n: float
    """Lowest normal load of any foot in stance within the step."""
    friction_use: float
    """Highest tangential / (friction * normal) of any foot in stance, mean over the step; 1
    slides.
    """
    feet_lost: int
    """Feet in stance that were lost at some moment of the step."""
    moved_m: float
    """How far the body has moved within the step."""
    way_in_world_m: Array
    """(3,) the same with its direction."""
    loads_n: Array
    """(4,) normal loads at the end of the step."""


def truth_of_step(
    truth: NDArray[Any],
    friction: float | Array,
    stance: Flags,
    before: Array,
    lost_n: float = LOST_N,
) -> Truth:
    """Sum up the truth rows (n, TruthRow) of a step for the feet in stance: (n, 4) row by row, or
    (4) for all rows.

    `friction`: coefficient of the ground under each foot (4), or one for all; `before`: the body's
    position (3) at the end of the step before, m; `lost_n`: a foot with less normal load is lost.
    """
    normal = np.ascontiguousarray(truth["contact_normal"])
    force = truth["foot_force_in_world"].reshape(len(truth), -1)
    lowest, use = np.full(normal.shape[1], np.inf), np.zeros(len(truth))
    coefficients = np.full(normal.shape[1], friction)
    meant = np.ascontiguousarray(np.broadcast_to(stance, normal.shape))
    feet_of_rows(force, normal, (coefficients, lost_n), meant, lowest, use)
    way = body_position(truth[-1]) - before
    return Truth(
        lowest_normal_n=float(lowest.min()) if stance.any() else 0.0,
        friction_use=float(use.mean()),
        feet_lost=int((lowest < lost_n).sum()),
        moved_m=float(np.linalg.norm(way)),
        way_in_world_m=way,
        loads_n=normal[-1].copy(),
    )


def body_position(row: Any) -> Array:
    """Where the body's origin is in a truth row, (3) m, world frame."""
    position: Array = row["body_pose_in_world"][: len(XYZ)]
    return position


@njit
def feet_of_rows(
    force: Array, normal: Array, rule: tuple[Array, float], meant: Flags, lowest: Array, use: Array
) -> None:
    """Lowest normal load (4) of each foot that is meant to carry and, of each row, the highest use
    (n,) of friction.

    force (n, 12) and normal (n, 4) of the feet, N; rule: coefficients of friction (4,), and the
    normal load, N, below which a foot is lost; meant (n, 4).
    """
    frictions, lost_n = rule
    for row in range(normal.shape[0]):
        for leg in range(normal.shape[1]):
            if not meant[row, leg]:
                continue
            n, x, y, z = (
                normal[row, leg],
                force[row, 3 * leg],
                force[row, 3 * leg + 1],
                force[row, 3 * leg + 2],
            )
            along = math.sqrt(max(x * x + y * y + z * z - n * n, 0.0))
            use[row] = max(use[row], along / (frictions[leg] * max(n, lost_n)))
            lowest[leg] = min(lowest[leg], n)


@dataclass(frozen=True)
class Term:
    """One term of a reward: so much of `unit` is counted in a step, and each unit of it is paid
    for.
    """

    name: str
    meaning: str
    unit: str
    weight: float
    """Reward for one unit on ROBOCLIMBER; negative: a price."""


SURVIVED = Term("survived", "a step", "1", 1.0)
FRICTION_USE = Term("friction_use", "highest use of a foot's friction, 2 at most", "1", -0.5)
LOST = Term("lost", "feet that are meant to carry and lost their load", "1", -1.0)
MOTION = Term("motion", "way of the body", "m", -20.0)
EFFORT = Term("effort", "mean square of the action", "1", -0.05)
END = Term("end", "the run ended: fallen, slid, a rope torn", "1", -50.0)
HOLDING = (SURVIVED, FRICTION_USE, LOST, MOTION, EFFORT, END)
"""Holding still on loaded feet: at most 1 a step."""


def holding_amounts(truth: Truth, action: Array, ended: bool) -> dict[str, float]:
    """How much of each of the terms HOLDING a step has, in their units."""
    return {
        "survived": 1.0,
        "friction_use": min(truth.friction_use, 2.0),
        "lost": float(truth.feet_lost),
        "motion": truth.moved_m,
        "effort": float(np.mean(action**2)),
        "end": float(ended),
    }


def term_weights(
    terms: Sequence[Term], given: Mapping[str, float], scale: Scale = ROBOCLIMBER
) -> dict[str, float]:
    """Reward for a unit of each of `terms`, those `given` (sizes; a price stays one) in place of
    their own. A machine of another size is paid for as much as is alike for it: a small one is
    paid more for a metre.

    Raises InputError for a name that is no term, or a size that is no finite number.
    """
    if not isinstance(given, Mapping):
        raise InputError(
            "cannot be used", field="weights", value=given, allowed="a mapping: term -> size"
        )
    weights = {term.name: term.weight / scale.times(term.unit) for term in terms}
    for name, size in given.items():
        if name not in weights:
            allowed = ", ".join(weights)
            raise InputError(
                "would have no effect", field=f"weights.{name}", value=size, allowed=allowed
            )
        if not (isinstance(size, int | float) and math.isfinite(size)):
            raise InputError(
                "cannot be used", field=f"weights.{name}", value=size, allowed="a number"
            )
        weights[name] = size if weights[name] > 0.0 else -size
    return weights
