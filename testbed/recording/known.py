"""What is declared about a rig: the numbers of the published model of one leg (null = to be
identified).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, get_args

from pydantic import Field, field_validator, model_serializer, model_validator

from testbed.formats.checked import Checked, impossible
from testbed.machine.names import GRAVITY_M_S2

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]


DEFAULT_TOLERANCE = 0.02
"""Share of a declared number by which the machine may differ from it where no tolerance is stated:
what a workshop's drawing and a catalogue leave open (the measured seals' bores differ by up to 3
%)."""


Holding = Literal["none", "check", "counterbalance"]
HOLDINGS: tuple[Holding, ...] = get_args(Holding)
"""Kinds of load-holding valve, numbered as in a machine's valve.holding_a."""


class Circuit(Checked):
    """The circuit of an axis where it is not the published model's: equal tight edges, no holding,
    constant supply.
    """

    edge_pa: Positive = 1.0
    """size of edge P-A against the rated flow, 1"""
    edge_at: Positive = 1.0
    """size of edge A-T, 1"""
    edge_pb: Positive = 1.0
    """size of edge P-B, 1"""
    edge_bt: Positive = 1.0
    """size of edge B-T, 1"""
    leakage_pa_m3_s_pa: NotNegative = 0.0
    """of edge P-A, m3/(s Pa)"""
    leakage_at_m3_s_pa: NotNegative = 0.0
    """of edge A-T, m3/(s Pa)"""
    leakage_pb_m3_s_pa: NotNegative = 0.0
    """of edge P-B, m3/(s Pa)"""
    leakage_bt_m3_s_pa: NotNegative = 0.0
    """of edge B-T, m3/(s Pa)"""
    holding_a: Holding = "none"
    """load-holding valve at A: lets oil out while the spool opens A-T"""
    holding_b: Holding = "none"
    """load-holding valve at B, likewise"""
    counterbalance_setting_pa: NotNegative = 1.2e7
    """load pressure at which a counterbalance valve opens alone, Pa"""
    counterbalance_pilot_ratio: NotNegative = 3.0
    """how much the other chamber's pressure helps it, 1"""
    supply: Literal["constant", "varying"] = "constant"
    """varying (load-sensing, unloading): the measured supply pressure drives the edges"""


class Known(Checked):
    """Numbers of the published model, SI; None where the rig does not declare them.

    A number may be written as `{value: .., tolerance: ..}`; `tolerances` keeps those shares by the
    number's name.
    """

    bore_m: float | None = Field(default=None, gt=0.0, le=2.0)
    """bore of the cylinder, m"""
    rod_m: float | None = Field(default=None, ge=0.0, le=2.0)
    """diameter of the rod, m"""
    stroke_m: float | None = Field(default=None, gt=0.0, le=50.0)
    """stroke, m"""
    moving_mass_kg: float | None = Field(default=None, ge=0.0, le=1e6)
    """mass that moves with the piston, kg"""
    inclination_deg: float | None = Field(default=None, ge=-180.0, le=180.0)
    """of the axis against the vertical, deg; 0: extends down"""
    supply_pressure_nominal_pa: float | None = Field(default=None, gt=0.0)
    """supply pressure, gauge, Pa"""
    tank_pressure_pa: float | None = Field(default=None, ge=0.0)
    """tank pressure, gauge, Pa"""
    dead_volume_a_m3: float | None = Field(default=None, ge=0.0)
    """oil of chamber A at extension 0, m3"""
    dead_volume_b_m3: float | None = Field(default=None, ge=0.0)
    """oil of chamber B at full stroke, m3"""
    bulk_modulus_pa: float | None = Field(default=None, gt=0.0)
    """of the oil, Pa"""
    valve_rated_flow_m3_s: float | None = Field(default=None, gt=0.0)
    """flow of the fully open valve at the rated drop, m3/s"""
    valve_rated_drop_per_edge_pa: float | None = Field(default=None, gt=0.0)
    """the rated drop of one edge, Pa"""
    valve_natural_frequency_hz: float | None = Field(default=None, gt=0.0)
    """of the spool following the command, Hz"""
    valve_damping: float | None = Field(default=None, gt=0.0)
    """of the spool, 1"""
    valve_deadband: float | None = Field(default=None, ge=0.0, lt=1.0)
    """share of the spool's way that opens nothing, 1"""
    internal_leakage_m3_s_pa: float | None = Field(default=None, ge=0.0)
    """past the piston, m3/(s Pa)"""
    cushion_length_m: float | None = Field(default=None, ge=0.0)
    """end of the stroke that is damped, m"""
    circuit: Circuit | None = None
    """edges, holding valves and supply where they are not the published model's"""
    tolerances: dict[str, Annotated[float, Field(gt=0.0, le=0.5)]] = Field(
        default_factory=dict,
        description=f"number -> share by which it may be off (default {DEFAULT_TOLERANCE:g}); "
        "the same as `bore_m: {value: .., tolerance: ..}`",
    )

    @model_validator(mode="before")
    @classmethod
    def _split_tolerances(cls, data: Any) -> Any:
        """`bore_m: {value: 0.07, tolerance: 0.01}` -> the number, and its tolerance beside the
        others.
        """
        if not isinstance(data, Mapping):
            return data
        stated = {
            key: value
            for key, value in data.items()
            if isinstance(value, Mapping) and key not in ("tolerances", "circuit")
        }
        for name, entry in stated.items():
            if not {"value"} <= set(entry) <= {"value", "tolerance"}:
                raise impossible(
                    f"{name} has the keys {', '.join(map(str, entry))}", "value, tolerance"
                )
        shares = {key: value["tolerance"] for key, value in stated.items() if "tolerance" in value}
        plain = {key: value["value"] if key in stated else value for key, value in data.items()}
        beside = data.get("tolerances", {})
        if not shares or not isinstance(beside, Mapping):  # the latter is refused by its own field
            return plain
        return plain | {"tolerances": {**beside, **shares}}

    @field_validator("tolerances")
    @classmethod
    def _of_numbers(cls, value: dict[str, float]) -> dict[str, float]:
        unknown = set(value) - (set(cls.model_fields) - {"tolerances", "circuit"})
        if unknown:
            raise ValueError(f"{sorted(unknown)[0]} is no declared number")
        return value

    @model_serializer(mode="wrap")
    def _without_empty(self, handler: Any) -> dict[str, Any]:
        """Files carry `tolerances` and `circuit` only where they are stated."""
        tree: dict[str, Any] = handler(self)
        if not tree.get("tolerances"):
            tree.pop("tolerances", None)
        if tree.get("circuit") is None:
            tree.pop("circuit", None)
        return tree

    def tolerance(self, name: str) -> float:
        """Share by which the machine's number may differ from the declared one (one standard
        deviation).
        """
        return self.tolerances.get(name, DEFAULT_TOLERANCE)

    @model_validator(mode="after")
    def _rod_fits_bore(self) -> Known:
        if self.rod_m is not None and self.bore_m is not None and self.rod_m >= self.bore_m:
            raise ValueError(f"rod_m = {self.rod_m} must be smaller than bore_m = {self.bore_m}")
        return self

    @property
    def area_a_m2(self) -> float:
        """Piston area of chamber A, pi/4 bore^2; 0 where there is no cylinder."""
        return 0.25 * math.pi * self.bore_m**2 if self.bore_m is not None else 0.0

    @property
    def area_b_m2(self) -> float:
        """Annular area of chamber B, A_A - pi/4 rod^2; 0 where there is no cylinder."""
        return (
            self.area_a_m2 - 0.25 * math.pi * (self.rod_m or 0.0) ** 2
            if self.bore_m is not None
            else 0.0
        )

    @property
    def gravity_along_axis_m_s2(self) -> float:
        """G cos(inclination), m/s2: along extension (extension points down at inclination 0)."""
        return GRAVITY_M_S2 * math.cos(math.radians(self.inclination_deg or 0.0))

    @property
    def declares_flow(self) -> bool:
        """True where everything is there that the flow balance of both chambers needs."""
        needed = (
            self.bore_m,
            self.rod_m,
            self.stroke_m,
            self.supply_pressure_nominal_pa,
            self.tank_pressure_pa,
            self.dead_volume_a_m3,
            self.dead_volume_b_m3,
            self.bulk_modulus_pa,
            self.valve_rated_flow_m3_s,
            self.valve_rated_drop_per_edge_pa,
            self.valve_natural_frequency_hz,
            self.valve_damping,
            self.valve_deadband,
            self.internal_leakage_m3_s_pa,
        )
        return all(value is not None for value in needed)
