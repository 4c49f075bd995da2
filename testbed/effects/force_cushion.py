"""force.cushion: an end cushion that acts long before the declared one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import Change, RobotSeen, Signature
from testbed.effects.terms import Coordinate, ForceTerms, Observed, Signals, Values
from testbed.formats.arrays import Array

LEFT_COST, LEFT_SHARE = 40.0, 0.04
"""Log-likelihood that a cushion costs which the piston never leaves; the share of the time outside
it that is free.
"""

REFERENCE_M = 0.05
"""At this depth the exponent changes nothing."""


def force_n(position_m: Any, stiffness: float, start: float, exponent: float = 1.0) -> Any:
    """Force on the piston along extension, N: pushes out where x < start."""
    depth = 0.5 * ((start - position_m) + abs(start - position_m))
    return stiffness * REFERENCE_M * (depth / REFERENCE_M) ** exponent


def _never_left(extension_m: Array, start_m: float) -> float:
    """Log-likelihood that a cushion costs which its piston hardly ever leaves: that is a spring;
    (n,) extensions that were visited.
    """
    outside = float(np.mean(extension_m > start_m))
    return LEFT_COST * max(1.0 - outside / LEFT_SHARE, 0.0)


class Cushion(Effect):
    """An end cushion that acts long before the declared one."""

    kind = "force.cushion"
    equation = "F = stiffness (start - x) for x < start"
    text = "a cushion that begins long before the declared one: a jammed sleeve, a swollen buffer"
    parameters = (
        ParameterSpec("stiffness", "N/m", 0.0, 1e7, (1e3, 2e4), "force per depth", log=True),
        ParameterSpec("start", "m", -20.0, 20.0, (0.1, 0.3), "where it begins"),
        ParameterSpec(
            "exponent", "1", 0.5, 4.0, (0.8, 2.2), "power of the depth, 1 at 50 mm", 1.0, log=True
        ),
    )
    live = {"stiffness": "cushion_stiffness_n_m", "start": "cushion_start_m"}
    telling_motion = "slow strokes into the lower quarter of the travel, both ways"
    alike = {
        "force.spring": "a spring pushes along the whole travel, a cushion not beyond its start",
        "friction.position": "friction changes its sign with the direction of motion, a cushion does not",
    }
    hides = {"stiffness": "extra.cushion_stiffness", "start": "extra.cushion_start"}
    bends = ("stiffness", "start")
    lowest = 0.0
    usual = 3.0e4
    by_travel = True

    def force(self, signals: Signals, terms: ForceTerms, values: Values) -> None:
        """It pushes the piston out."""
        terms.force_n = terms.force_n + force_n(
            signals.position_m, values["stiffness"], values["start"], values["exponent"]
        )

    def starts(self, observed: Observed) -> list[dict[str, float]]:
        """From a third and from two thirds of the travel."""
        low, high = np.percentile(observed.position_m, [5, 95])
        return [
            {"start": float(low + share * (high - low)), "stiffness": 300.0 * observed.size("N/m")}
            for share in (0.3, 0.65)
        ]

    def narrowed(self, coordinate: Coordinate, observed: Observed) -> Coordinate:
        """It must begin and end inside the travel."""
        if coordinate.name != "start":
            return coordinate
        low, high = np.percentile(observed.position_m, [1, 99])
        return replace(
            coordinate,
            low=float(low),
            high=float(high),
            scale=float(0.3 * (high - low)),
            prior=None,
            start=float(np.clip(coordinate.start, low, high)),
        )

    def price(self, values: Values, observed: Observed) -> float:
        """What it costs that the piston hardly ever leaves it."""
        return _never_left(observed.position_m, values["start"])

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """Cushions that begin at several places of the travel."""
        i = seen.axis(place)
        x = seen.extension_m[:, i]
        return {
            f"stiffness {index}": Change(force={i: -np.maximum(start - x, 0.0)})
            for index, start in enumerate(_tried(seen, i))
        }

    def from_linear(self, linear: Values, seen: RobotSeen, place: str) -> dict[str, float]:
        """All of them together, and where they begin in the mean."""
        starts = _tried(seen, seen.axis(place))
        parts = np.array([linear[f"stiffness {index}"] for index in range(len(starts))])
        whole = float(parts.sum())
        start = float(parts @ starts) / whole if whole else float(starts[-1])
        return {"stiffness": whole, "start": float(np.clip(start, starts[0], starts[-1]))}

    def made(self, seen: RobotSeen, place: str, values: Values) -> Change:
        """One cushion alone."""
        i = seen.axis(place)
        push = force_n(seen.extension_m[:, i], values["stiffness"], values["start"])
        return Change(force={i: -np.asarray(push)})

    def lies_within(self, name: str, seen: RobotSeen, place: str) -> tuple[float, float]:
        """It begins inside its cylinder: what pushes at all extensions is a spring."""
        if name != "start":
            return super().lies_within(name, seen, place)
        return 0.0, float(seen.stroke_m[seen.axis(place)])

    def robot_price(self, seen: RobotSeen, place: str, values: Values) -> float:
        """What it costs that the piston at its place hardly ever leaves it."""
        return _never_left(seen.extension_m[:, seen.axis(place)], values["start"])


TRIED, BEYOND_M = (0.35, 0.65, 1.0), 0.15
"""Shares of the travel at which a cushion of the robot is tried to begin; and how far beyond it,
but inside the cylinder: a piston may be inside its cushion all along.
"""


def _tried(seen: RobotSeen, axis: int) -> Array:
    """Extensions at which the cushion of a cylinder is tried to begin, m."""
    low, high = seen.travel_m(axis)
    last = max(min(high + BEYOND_M, float(seen.stroke_m[axis])), high)
    return np.append(low + np.array(TRIED) * (high - low), last)


EFFECTS = (Cushion(),)
