"""valve.deadband: a valve that overlaps more than declared."""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.effects.base import Effect, FlowTerms, ParameterSpec, Signals, Values


def opening(spool: Any, deadband: float) -> Any:
    """o = sign(s) max(|s| - d, 0) / (1 - d)."""
    return np.sign(spool) * np.maximum(abs(spool) - deadband, 0.0) / (1.0 - deadband)


def _flow(signals: Signals, terms: FlowTerms, p: Values) -> None:
    terms.deadband = p["deadband"]


EFFECT = Effect(
    name="valve.deadband",
    equation="o = sign(s) max(|s| - deadband, 0) / (1 - deadband)",
    text="the valve's edges overlap more than declared",
    parameters=(
        ParameterSpec(
            "deadband", "1", 0.0, 0.6, (0.0, 0.15), "whole overlap, share of full spool travel"
        ),
    ),
    needs=("position", "pressure_a", "pressure_b", "valve_command"),
    kinds=("vertical-leg",),
    flow=_flow,
    law=opening,
    seen_in=("flow",),
)
