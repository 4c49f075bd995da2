"""A vector of fitted numbers, and the friction, valve edges and effects that it stands for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.effects import by_name
from testbed.effects.active import Active
from testbed.effects.terms import Coordinate
from testbed.estimation.leg.flow import Edges
from testbed.recording.leg_model import Friction, LegModel

Array = npt.NDArray[np.float64]
FRICTION, NUISANCE, ZERO, DECLARED = "friction", "nuisance", "zero", "declared"
HELD = "held"
"""Owners of coordinates that are no effects: equation (5), a valve's edges, the sensors' common
zero, how far a declared number is off, as a share of it (its name is the number's), and how late a
drive's force acts."""
FRICTION_NAMES = tuple(Friction.model_fields)
STRAIGHT = tuple(name for name in FRICTION_NAMES if "speed" not in name)
"""Numbers of equation (5) that enter straight: viscous, Coulomb, Stribeck of extension, then of
retraction.
"""
STRIBECK_M_S, TYPICAL_STRIBECK_M_S = (5e-4, 0.3), 0.01
"""Bounds and middle of the Stribeck speeds."""
MOST_N = 1e6
"""Bound of every other number of (5), and of the sensors' zero, SI."""


def friction_coordinates(friction: Friction, force_scale: float) -> list[Coordinate]:
    """Coordinates of the eight parameters of equation (5)."""
    out = []
    for name in FRICTION_NAMES:
        value = getattr(friction, name)
        if "speed" in name:
            start = float(np.clip(value, 1e-3, 0.1))
            prior = (float(np.log(TYPICAL_STRIBECK_M_S)), 1.0)
            out.append(Coordinate(FRICTION, name, start, *STRIBECK_M_S, 0.5, log=True, prior=prior))
        elif "viscous" in name:
            out.append(Coordinate(FRICTION, name, value, -MOST_N, MOST_N, 10.0 * force_scale))
        else:
            out.append(Coordinate(FRICTION, name, max(value, 0.0), 0.0, MOST_N, force_scale))
    return out


@dataclass(frozen=True)
class Point:
    """A parameter vector made into objects."""

    friction: Friction
    edges: Edges
    effects: tuple[Active, ...]
    zero_n: float = 0.0
    """Of the sensors together, as a force downwards; see base_models.zero_force."""
    off: Mapping[str, float] = field(default_factory=dict)
    """Declared number -> share by which the machine's is larger; see
    base_models.within_tolerance.
    """
    held_s: float = 0.0
    """By which a drive's force acts later than its row says; see LegModel.force_held_s."""

    def model(self, base: LegModel) -> LegModel:
        """The base model with this friction, this zero and these declared numbers, and no effect of
        these.
        """
        changes: dict[str, Any] = {"friction": self.friction}
        if self.zero_n != 0.0:
            changes["force_offset_n"] = base.force_offset_n + self.zero_n
        if base.rig == "drive":
            changes["force_held_s"] = self.held_s
        if self.off:
            declared = {name: getattr(base.known, name) for name in self.off}
            used = {name: value * (1.0 + self.off[name]) for name, value in declared.items()}
            changes["known"] = base.known.model_copy(update=used)
        return base.model_copy(update=changes)


def point(coordinates: Sequence[Coordinate], theta: Array, fixed: Point) -> Point:
    """The objects at a parameter vector (fitted units); what is not fitted comes from `fixed`."""
    friction, zero, off = dict(fixed.friction), fixed.zero_n, dict(fixed.off)
    held_s = fixed.held_s
    edges: dict[str, float] = {}
    values: dict[str, dict[str, float]] = {
        effect.effect.name: dict(effect.values) for effect in fixed.effects
    }
    for coordinate, t in zip(coordinates, theta, strict=True):
        number = float(np.exp(t)) if coordinate.log else float(t)
        number = min(max(number, coordinate.low), coordinate.high)
        if coordinate.owner == FRICTION:
            friction[coordinate.name] = number
        elif coordinate.owner == NUISANCE:
            edges[coordinate.name] = number
        elif coordinate.owner == ZERO:
            zero = number
        elif coordinate.owner == HELD:
            held_s = number
        elif coordinate.owner == DECLARED:
            off[coordinate.name] = number
        else:
            values.setdefault(coordinate.owner, {})[coordinate.name] = number
    effects = tuple(Active(e := by_name(name), e.complete(value)) for name, value in values.items())
    metering = replace(fixed.edges, **edges)
    return Point(Friction.model_construct(**friction), metering, effects, zero, off, held_s)


def start_vector(coordinates: Sequence[Coordinate]) -> Array:
    """The start in fitted units."""
    starts = [
        min(max(coordinate.start, coordinate.low), coordinate.high) for coordinate in coordinates
    ]
    return np.array(
        [
            np.log(start) if coordinate.log else start
            for coordinate, start in zip(coordinates, starts, strict=True)
        ],
        dtype=np.float64,
    )


def restarted(coordinate: Coordinate, at: Point) -> Coordinate:
    """The coordinate with the point's value as its start."""
    if coordinate.owner == FRICTION:
        value = float(getattr(at.friction, coordinate.name))
    elif coordinate.owner == NUISANCE:
        value = float(getattr(at.edges, coordinate.name))
    elif coordinate.owner == ZERO:
        value = at.zero_n
    elif coordinate.owner == HELD:
        value = at.held_s
    elif coordinate.owner == DECLARED:
        value = at.off[coordinate.name]
    else:
        value = next(
            effect.values[coordinate.name]
            for effect in at.effects
            if effect.effect.name == coordinate.owner
        )
    return replace(coordinate, start=float(np.clip(value, coordinate.low, coordinate.high)))
