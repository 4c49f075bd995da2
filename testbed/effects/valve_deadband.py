"""valve.deadband: a valve that overlaps more than declared."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import Change, RobotSeen, Signature
from testbed.effects.terms import Coordinate, FlowTerms, Observed, Signals, Values


def opening(spool: Any, deadband: float) -> Any:
    """O = sign(s) max(|s| - d, 0) / (1 - d)."""
    return np.sign(spool) * np.maximum(abs(spool) - deadband, 0.0) / (1.0 - deadband)


class Deadband(Effect):
    """A valve that overlaps more than declared."""

    kind = "valve.deadband"
    equation = "o = sign(s) max(|s| - deadband, 0) / (1 - deadband)"
    text = "the valve's edges overlap more than declared"
    parameters = (
        ParameterSpec(
            "deadband", "1", 0.0, 0.6, (0.0, 0.15), "whole overlap, share of full spool travel"
        ),
    )
    needs = ("position", "pressure_a", "pressure_b", "valve_command")
    rigs = ("vertical-leg",)
    seen_in = ("flow",)
    declared_as = "valve_deadband"
    telling_motion = "slow triangles of the valve command through zero"
    alike = {"leakage.internal": "a leak lets a held piston sink with the valve shut"}
    adds = {"deadband": "valve.dead_band"}
    usual = 0.05

    def flow(self, signals: Signals, terms: FlowTerms, values: Values) -> None:
        """The whole overlap is this one's."""
        terms.deadband = values["deadband"]

    def starts(self, observed: Observed) -> list[dict[str, float]]:
        """A little more than declared."""
        return [{"deadband": (observed.known.valve_deadband or 0.0) + 0.005}]

    def narrowed(self, coordinate: Coordinate, observed: Observed) -> Coordinate:
        """What is declared says nothing about how much is expected: no prior."""
        return replace(coordinate, prior=None)

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """Less flow at small openings."""
        axis = seen.axis(place)
        return {"deadband": Change(oil={axis: seen.oil_by_deadband[:, axis]})}


EFFECTS = (Deadband(),)
