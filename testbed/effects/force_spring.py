"""force.spring: something elastic that holds the piston."""

from __future__ import annotations

from typing import Any

from testbed.effects.base import Effect, ForceTerms, ParameterSpec, Signals, Values


def force_n(position_m: Any, stiffness: float, rest: float, cubic: float = 0.0) -> Any:
    """Force on the piston along extension, N; cubic (N/m3) is 0 in the contract's formula."""
    stretch = position_m - rest
    return -stretch * (stiffness + cubic * stretch * stretch)


def _force(signals: Signals, terms: ForceTerms, p: Values) -> None:
    terms.force_n = terms.force_n + force_n(
        signals.position_m, p["stiffness"], p["rest"], p["cubic"]
    )


EFFECT = Effect(
    name="force.spring",
    equation="F = -stiffness (x - rest) on the piston",
    text="an undeclared spring on the piston: a hose, a bellows, a balancing spring",
    parameters=(
        ParameterSpec("stiffness", "N/m", -1e6, 1e7, (300.0, 6000.0), "force per travel"),
        ParameterSpec("rest", "m", -20.0, 20.0, (0.05, 0.45), "where it pulls nothing"),
        ParameterSpec("cubic", "N/m3", -1e8, 1e8, (-2e4, 2e4), "hardening", 0.0),
    ),
    force=_force,
    law=force_n,
)
