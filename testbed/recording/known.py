"""What is declared about a rig: the numbers of the published model of one leg (null = to be identified)."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field, model_validator

from testbed.formats.checked import Checked
from testbed.machine.names import GRAVITY_M_S2

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]


class Known(Checked):
    """Numbers of the published model, SI; None where the rig does not declare them."""

    bore_m: Annotated[float, Field(gt=0.0, le=2.0)] | None = None
    rod_m: Annotated[float, Field(ge=0.0, le=2.0)] | None = None
    stroke_m: Annotated[float, Field(gt=0.0, le=50.0)] | None = None
    moving_mass_kg: Annotated[float, Field(ge=0.0, le=1e6)] | None = None
    inclination_deg: Annotated[float, Field(ge=-180.0, le=180.0)] | None = None
    supply_pressure_nominal_pa: Positive | None = None
    tank_pressure_pa: NotNegative | None = None
    dead_volume_a_m3: NotNegative | None = None
    dead_volume_b_m3: NotNegative | None = None
    bulk_modulus_pa: Positive | None = None
    valve_rated_flow_m3_s: Positive | None = None
    valve_rated_drop_per_edge_pa: Positive | None = None
    valve_natural_frequency_hz: Positive | None = None
    valve_damping: Positive | None = None
    valve_deadband: Annotated[float, Field(ge=0.0, lt=1.0)] | None = None
    internal_leakage_m3_s_pa: NotNegative | None = None
    cushion_length_m: NotNegative | None = None

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
        """g cos(inclination), m/s2: along extension (extension points down at inclination 0)."""
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
        return all(v is not None for v in needed)
