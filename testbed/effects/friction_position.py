"""friction.position: Coulomb friction that changes along the stroke."""

from __future__ import annotations

from typing import Any

from testbed.effects.base import Effect, ForceTerms, ParameterSpec, Signals, Values


def coulomb_factor(
    position_m: Any,
    stroke_m: float,
    slope: float,
    curvature: float = 0.0,
    cubic: float = 0.0,
    quartic: float = 0.0,
) -> Any:
    """F_c(x) / F_c, with xi = (x - L/2) / L; the further shapes are 0 in the contract's formula."""
    xi = (position_m - 0.5 * stroke_m) / stroke_m
    return 1.0 + xi * (slope + xi * (curvature + xi * (cubic + xi * quartic)))


def _force(signals: Signals, terms: ForceTerms, p: Values) -> None:
    stroke = signals.known.stroke_m or 0.5
    factor = coulomb_factor(
        signals.position_m, stroke, p["slope"], p["curvature"], p["cubic"], p["quartic"]
    )
    terms.coulomb_scale = terms.coulomb_scale * factor.clip(0.0)


EFFECT = Effect(
    name="friction.position",
    equation="F_c(x) = F_c0 (1 + slope (x - L/2) / L)",
    text="the Coulomb term changes along the stroke: a bent rod, a worn guide, an uneven bore",
    parameters=(
        ParameterSpec(
            "slope", "1", -20.0, 20.0, (-1.5, 1.5), "relative change of F_c over the whole stroke"
        ),
        ParameterSpec(
            "curvature", "1", -200.0, 200.0, (-8.0, 8.0), "second-order shape along the stroke", 0.0
        ),
        ParameterSpec(
            "cubic", "1", -2e3, 2e3, (-30.0, 30.0), "third-order shape along the stroke", 0.0
        ),
        ParameterSpec(
            "quartic", "1", -2e4, 2e4, (-100.0, 100.0), "fourth-order shape along the stroke", 0.0
        ),
    ),
    force=_force,
    law=coulomb_factor,
)
