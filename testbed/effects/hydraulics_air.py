"""hydraulics.air: oil softened by entrained air."""

from __future__ import annotations

from typing import Any

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import Change, RobotSeen, Signature
from testbed.effects.terms import FlowTerms, Observed, Signals, Values
from testbed.machine.model import Machine

ATMOSPHERE_PA = 1e5
"""As in laws/oil.py."""


def compliance_1_pa(pressure_pa: Any, fraction: float, exponent: float = 1.0 / 1.4) -> Any:
    """What free air adds to 1/beta at a gauge pressure >= 0."""
    absolute = pressure_pa + ATMOSPHERE_PA
    return fraction * exponent / absolute * (ATMOSPHERE_PA / absolute) ** exponent


def free_share(pressure_pa: Any, exponent: float = 1.0 / 1.4) -> Any:
    """Volume of free air at a gauge pressure >= 0, by its volume at none: compliance_1_pa is its
    fall with pressure.
    """
    return (ATMOSPHERE_PA / (pressure_pa + ATMOSPHERE_PA)) ** exponent


class Air(Effect):
    """Oil softened by entrained air."""

    kind = "hydraulics.air"
    equation = (
        "1/beta = 1/beta_declared + fraction / (1.4 (p + p0)) (p0 / (p + p0))^(1/1.4), p0 = 1 bar"
    )
    text = "entrained air softens the oil at low pressure"
    parameters = (
        ParameterSpec(
            "fraction",
            "1",
            0.0,
            1.0,
            (0.002, 0.04),
            "volume of free air per volume at 1 bar",
            log=True,
        ),
        ParameterSpec(
            "exponent",
            "1",
            0.2,
            1.2,
            (0.3, 1.0),
            "1/1.4 adiabatic, 1 isothermal",
            1.0 / 1.4,
            log=True,
        ),
    )
    needs = ("position", "pressure_a", "pressure_b", "valve_command")
    rigs = ("vertical-leg",)
    seen_in = ("flow",)
    shapes = ("exponent",)
    telling_motion = "the same steps at low and at high pressure in both chambers"
    alike = {"hydraulics.hose": "a hose softens chamber A alone, and at every pressure"}
    adds = {"fraction": "oil.air"}
    usual = 0.05

    def flow(self, signals: Signals, terms: FlowTerms, values: Values) -> None:
        """Both chambers are softer."""
        terms.gas_fraction += values["fraction"]
        terms.gas_exponent = values["exponent"]

    def starts(self, observed: Observed) -> list[dict[str, float]]:
        """A little of it."""
        return [{"fraction": 1e-3}]

    def declared_by(self, machine: Machine) -> Values | None:
        """The oil's number."""
        return {"fraction": machine.oil.entrained_air}

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """Oil that gives way."""
        axis = seen.axis(place)
        return {"fraction": Change(oil={axis: seen.oil_by_air[:, axis]})}


EFFECTS = (Air(),)
