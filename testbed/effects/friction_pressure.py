"""friction.pressure: seals that press harder under pressure."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import Change, RobotSeen, Signature
from testbed.effects.terms import Coordinate, ForceTerms, Observed, Signals, Values
from testbed.machine.model import Machine

REFERENCE_PRESSURE_PA = 1e7
"""At this pA + pB the exponent changes nothing."""


def coulomb_increase_n(
    pressure_a_pa: Any,
    pressure_b_pa: Any,
    coefficient: float,
    imbalance: float = 0.0,
    exponent: float = 1.0,
) -> Any:
    """Added Coulomb force in N; exponent = 1 and imbalance = 0 are the contract's formula.
    Pressures >= 0.
    """
    total = pressure_a_pa + pressure_b_pa
    bent = (
        total
        if exponent == 1.0
        else REFERENCE_PRESSURE_PA * (total / REFERENCE_PRESSURE_PA) ** exponent
    )
    return coefficient * bent + imbalance * (pressure_a_pa - pressure_b_pa)


class PressureFriction(Effect):
    """Seals that press harder under pressure."""

    kind = "friction.pressure"
    equation = "F_c = F_c0 + coefficient (pA + pB)"
    text = "the Coulomb term grows with the pressures: lip seals"
    parameters = (
        ParameterSpec(
            "coefficient", "m2", -2e-3, 2e-3, (1e-5, 1.2e-4), "added Coulomb force per pressure"
        ),
        ParameterSpec("imbalance", "m2", -2e-3, 2e-3, (-3e-5, 3e-5), "the same for pA - pB", 0.0),
        ParameterSpec(
            "exponent",
            "1",
            0.2,
            4.0,
            (0.5, 2.0),
            "power of the pressure, 1 at 100 bar",
            1.0,
            log=True,
        ),
    )
    needs = ("position", "pressure_a")
    rigs = ("vertical-leg", "cylinder")
    shapes = ("exponent", "imbalance")
    live = {"coefficient": "pressure_coefficient_m2"}
    telling_motion = "the same strokes at two supply pressures"
    alike = {
        "friction.load": "the same load at two supply pressures: only the seals feel the difference",
        "sensor.gain_a": "a gain error has the same sign both ways, friction has not",
    }
    adds = {"coefficient": "seal.pressure_coefficient"}

    def force(self, signals: Signals, terms: ForceTerms, values: Values) -> None:
        """The Coulomb term grows with the pressures."""
        pressure_a, pressure_b = signals.pressure_a_pa, signals.pressure_b_pa
        if pressure_a is None:
            return
        pressure_a = pressure_a.clip(0.0)
        other = pressure_b.clip(0.0) if pressure_b is not None else 0.0 * pressure_a
        added = coulomb_increase_n(
            pressure_a, other, values["coefficient"], values["imbalance"], values["exponent"]
        )
        terms.coulomb_add_n = terms.coulomb_add_n + added

    def starts(self, observed: Observed) -> list[dict[str, float]]:
        """A little of it."""
        return [{"coefficient": 1e-6 * observed.size("m2")}]

    def narrowed(self, coordinate: Coordinate, observed: Observed) -> Coordinate:
        """See `not_less_than_none`."""
        return not_less_than_none(coordinate)

    def declared_by(self, machine: Machine) -> Values | None:
        """The seal's number."""
        return {"coefficient": machine.seal.pressure_coefficient_m2}

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """Dry friction that grows with both pressures."""
        axis = seen.axis(place)
        both = seen.pressure_a_pa[:, axis] + seen.pressure_b_pa[:, axis]
        return {"coefficient": Change(force={axis: seen.direction[:, axis] * both})}


def not_less_than_none(coordinate: Coordinate) -> Coordinate:
    """What is pressed sticks more, never less: friction that falls under load or pressure is
    another law, such as a load cell's that bears some of it. And with the load between the robot's
    diagonals open, one leg that sticks and three with the opposite of it look alike.
    """
    return replace(coordinate, low=0.0) if coordinate.name == "coefficient" else coordinate


EFFECTS = (PressureFriction(),)
