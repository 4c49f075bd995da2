"""friction.position: Coulomb friction that changes along the stroke."""

from __future__ import annotations

from typing import Any

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import Change, RobotSeen, Signature
from testbed.effects.terms import ForceTerms, Signals, Values
from testbed.machine.model import Machine


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


class PositionFriction(Effect):
    """Coulomb friction that changes along the stroke."""

    kind = "friction.position"
    equation = "F_c(x) = F_c0 (1 + slope (x - L/2) / L)"
    text = "the Coulomb term changes along the stroke: a bent rod, a worn guide, an uneven bore"
    parameters = (
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
    )
    shapes = ("curvature", "cubic", "quartic")
    relative_to = ("coulomb_plus_n", "coulomb_minus_n")
    needs_known = ("stroke_m",)
    live = {"slope": "position_slope"}
    telling_motion = "slow strokes over the whole travel at two speeds, both ways"
    alike = {
        "force.cushion": "a cushion pushes one way, friction against the motion",
        "force.spring": "a spring pushes one way, friction against the motion",
    }
    hides = {"slope": "seal.position_slope"}

    def force(self, signals: Signals, terms: ForceTerms, values: Values) -> None:
        """The Coulomb term is scaled along the stroke."""
        stroke = signals.known.stroke_m
        assert stroke is not None  # `needs_known`
        factor = coulomb_factor(
            signals.position_m,
            stroke,
            values["slope"],
            values["curvature"],
            values["cubic"],
            values["quartic"],
        )
        terms.coulomb_scale = terms.coulomb_scale * factor.clip(0.0)

    def declared_by(self, machine: Machine) -> Values | None:
        """The seal's number."""
        return {"slope": machine.seal.position_slope}

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """Dry friction that changes along the stroke."""
        axis = seen.axis(place)
        along = seen.extension_m[:, axis] / seen.stroke_m[axis] - 0.5
        return {
            "slope": Change(force={axis: seen.direction[:, axis] * seen.coulomb_n[:, axis] * along})
        }


EFFECTS = (PositionFriction(),)
