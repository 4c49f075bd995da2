"""force.cushion: an end cushion that acts long before the declared one."""

from __future__ import annotations

from typing import Any

from testbed.effects.base import Effect, ForceTerms, ParameterSpec, Signals, Values

REFERENCE_M = 0.05
"""At this depth the exponent changes nothing."""


def force_n(position_m: Any, stiffness: float, start: float, exponent: float = 1.0) -> Any:
    """Force on the piston along extension, N: pushes out where x < start."""
    depth = 0.5 * ((start - position_m) + abs(start - position_m))
    return stiffness * REFERENCE_M * (depth / REFERENCE_M) ** exponent


def _force(signals: Signals, terms: ForceTerms, p: Values) -> None:
    terms.force_n = terms.force_n + force_n(
        signals.position_m, p["stiffness"], p["start"], p["exponent"]
    )


EFFECT = Effect(
    name="force.cushion",
    equation="F = stiffness (start - x) for x < start",
    text="a cushion that begins long before the declared one: a jammed sleeve, a swollen buffer",
    parameters=(
        ParameterSpec("stiffness", "N/m", 0.0, 1e7, (1e3, 2e4), "force per depth"),
        ParameterSpec("start", "m", -20.0, 20.0, (0.1, 0.3), "where it begins"),
        ParameterSpec("exponent", "1", 0.5, 4.0, (0.8, 2.2), "power of the depth, 1 at 50 mm", 1.0),
    ),
    force=_force,
    law=force_n,
)
