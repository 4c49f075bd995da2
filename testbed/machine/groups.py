"""The groups of numbers that make up a machine: names end in their unit, types say what a number
may be.

Units, sources and marks of the values stand beside them in `roboclimber.yaml`.
"""

from __future__ import annotations

import math
from typing import Annotated, TypeVar

from pydantic import AfterValidator, Field, ValidationInfo, field_validator

from testbed.formats.checked import Checked, impossible

# What a number of the machine may be, and a group of them.


def _a_kind(kind: float) -> float:
    if kind not in (0.0, 1.0, 2.0):
        raise impossible("is no kind", "0, 1 or 2")
    return kind


Positive = Annotated[float, Field(gt=0.0)]


NotNegative = Annotated[float, Field(ge=0.0)]


Share = Annotated[float, Field(ge=0.0, lt=1.0)]


Length = Annotated[float, Field(gt=0.0, le=10.0)]


Gauge = Annotated[float, Field(ge=-0.9e5, le=1.0e9)]
"""Gauge pressure: the least is a tenth of the atmosphere's."""


Leakage = Annotated[float, Field(ge=0.0, le=1.0e-6)]


Kind = Annotated[float, AfterValidator(_a_kind)]
"""One of three kinds of valve or supply: 0, 1 or 2; what they are stands beside the value."""


Vector = tuple[float, float, float]


Box = tuple[Positive, Positive, Positive]


class Group(Checked):
    """A group of numbers."""


NARROWEST_LOOP = 0.2
"""Half width of the hysteresis of the best transducer, share of the worst one's (E)."""


GroupT = TypeVar("GroupT", bound=Group)


class Cylinder(Group):
    """One cylinder with its friction (5) out and in."""

    bore_m: Annotated[float, Field(gt=0.0, le=1.0)]
    rod_m: Positive
    dead_volume_a_m3: Annotated[float, Field(gt=0.0, le=0.1)]
    dead_volume_b_m3: Annotated[float, Field(gt=0.0, le=0.1)]
    coulomb_out_n: Annotated[float, Field(ge=0.0, le=1.0e6)]
    static_out_n: Annotated[float, Field(ge=0.0, le=1.0e6)]
    stribeck_out_m_s: Annotated[float, Field(gt=0.0, le=1.0)]
    viscous_out_n_s_m: Annotated[float, Field(ge=0.0, le=1.0e7)]
    coulomb_in_n: Annotated[float, Field(ge=0.0, le=1.0e6)]
    static_in_n: Annotated[float, Field(ge=0.0, le=1.0e6)]
    stribeck_in_m_s: Annotated[float, Field(gt=0.0, le=1.0)]
    viscous_in_n_s_m: Annotated[float, Field(ge=0.0, le=1.0e7)]

    @property
    def areas_m2(self) -> tuple[float, float]:
        """The piston's and the ring's."""
        whole = math.pi / 4 * self.bore_m**2
        return whole, math.pi / 4 * (self.bore_m**2 - self.rod_m**2)

    @field_validator("rod_m")
    @classmethod
    def _rod_fits(cls, rod_m: float, others: ValidationInfo) -> float:
        bore_m = others.data.get("bore_m", math.inf)
        if rod_m >= bore_m:
            raise impossible("is impossible", f"0 < rod < bore = {bore_m} m")
        return rod_m


class SlideCylinder(Cylinder):
    """A cylinder that moves a slide. `stroke_m` is the slide's way, and the cylinder's own stroke
    where that stands straight.
    """

    stroke_m: Length


class Seal(Group):
    """Pre-sliding, extra friction and rest of the seals; oil's viscosity."""

    bristle_stiffness_n_m: Annotated[float, Field(gt=0.0, le=1.0e12)]
    bristle_damping_n_s_m: Annotated[float, Field(ge=0.0, le=1.0e9)]
    elastic_share: Annotated[float, Field(ge=0.0, le=0.99)]
    position_slope: Annotated[float, Field(ge=-2.0, lt=2.0)]
    pressure_coefficient_m2: Annotated[float, Field(ge=0.0, le=1.0e-2)]
    load_coefficient: Annotated[float, Field(ge=0.0, le=10.0)]
    side_load_coefficient: Annotated[float, Field(ge=0.0, le=10.0)]
    side_load_growth: Annotated[float, Field(ge=0.0, le=2.0)]
    dwell_gain: Annotated[float, Field(ge=0.0, le=100.0)]
    dwell_time_s: Annotated[float, Field(gt=0.0, le=1.0e6)]
    viscosity_rate_1_k: Annotated[float, Field(ge=0.0, le=0.2)]
    viscosity_reference_degc: Annotated[float, Field(ge=-60.0, le=200.0)]


class EndStop(Group):
    """End cushions and stops."""

    cushion_length_m: Annotated[float, Field(gt=0.0, le=10.0)]
    cushion_damping_n_s_m: Annotated[float, Field(ge=0.0, le=1.0e9)]
    stiffness_n_m: Annotated[float, Field(ge=0.0, le=1.0e12)]
    damping_n_s_m: Annotated[float, Field(ge=0.0, le=1.0e9)]


class Oil(Group):
    """Oil, leakage, hoses and the tank's warmth."""

    bulk_modulus_pa: Annotated[float, Field(ge=1.0e7, lt=1.0e11)]
    entrained_air: Annotated[float, Field(ge=0.0, lt=0.5)]
    internal_leakage_m3_s_pa: Leakage
    outer_leakage_m3_s_pa: Leakage
    bulk_modulus_rate_1_k: Annotated[float, Field(ge=0.0, le=0.05)]
    hose_elasticity_m3_pa: Leakage
    hose_elasticity_b_m3_pa: Leakage
    hose_capacity_m3_pa: Leakage
    hose_capacity_b_m3_pa: Leakage
    hose_time_s: Annotated[float, Field(gt=0.0, le=1.0e4)]
    start_temperature_degc: Annotated[float, Field(ge=-60.0, le=150.0)]
    declared_at_degc: Annotated[float, Field(ge=-60.0, le=150.0)]
    ambient_degc: Annotated[float, Field(ge=-90.0, le=100.0)]
    heat_capacity_j_k: Annotated[float, Field(gt=0.0, le=1.0e12)]
    cooling_w_k: Annotated[float, Field(ge=0.0, le=1.0e9)]


class Valve(Group):
    """The proportional valves; one rated flow for each joint."""

    rated_flow_vertical_m3_s: Annotated[float, Field(gt=0.0, lt=1.0)]
    rated_flow_radial_m3_s: Annotated[float, Field(gt=0.0, lt=1.0)]
    rated_flow_rotation_m3_s: Annotated[float, Field(gt=0.0, lt=1.0)]
    rated_drop_per_edge_pa: Annotated[float, Field(gt=0.0, le=1.0e9)]
    edge_pa: Annotated[float, Field(ge=0.0, le=100.0)]
    edge_at: Annotated[float, Field(ge=0.0, le=100.0)]
    edge_pb: Annotated[float, Field(ge=0.0, le=100.0)]
    edge_bt: Annotated[float, Field(ge=0.0, le=100.0)]
    natural_frequency_hz: Annotated[float, Field(gt=0.0, le=1.0e4)]
    damping: Annotated[float, Field(ge=0.0, le=100.0)]
    deadband: Share
    hysteresis: Share
    amplifier_lag_s: Annotated[float, Field(gt=0.0, le=10.0)]
    edge_pa_leakage_m3_s_pa: Leakage
    edge_at_leakage_m3_s_pa: Leakage
    edge_pb_leakage_m3_s_pa: Leakage
    edge_bt_leakage_m3_s_pa: Leakage
    holding_a: Kind
    holding_b: Kind
    counterbalance_setting_pa: Annotated[float, Field(ge=0.0, le=1.0e9)]
    counterbalance_pilot_ratio: Annotated[float, Field(ge=0.0, le=100.0)]

    def rated_flow_m3_s(self, joint: str) -> float:
        """Rated flow of a joint's valves."""
        flow: float = getattr(self, f"rated_flow_{joint}_m3_s")
        return flow


class PowerUnit(Group):
    """Pump with its kind of supply, relief valve, accumulator and tank; pressures are gauge."""

    tank_pressure_pa: Gauge
    power_w: Annotated[float, Field(gt=0.0, le=1.0e8)]
    full_flow_m3_s: Annotated[float, Field(ge=0.0, le=10.0)]
    supply_pressure_pa: Annotated[float, Field(ge=-0.9e5, le=1.0e9)]
    supply_kind: Kind
    load_sensing_margin_pa: Annotated[float, Field(ge=0.0, le=1.0e8)]
    standby_pressure_pa: Annotated[float, Field(ge=0.0, le=1.0e9)]
    load_sensing_lag_s: Annotated[float, Field(gt=0.0, le=100.0)]
    unloading_band_pa: Annotated[float, Field(gt=0.0, le=1.0e9)]
    compensator_band_pa: Annotated[float, Field(gt=0.0, le=1.0e9)]
    compensator_lag_s: Annotated[float, Field(gt=0.0, le=100.0)]
    case_leakage_m3_s_pa: Annotated[float, Field(ge=0.0, le=1.0e-3)]
    relief_pressure_pa: Annotated[float, Field(ge=-0.9e5, le=1.0e9)]
    relief_slope_m3_s_pa: Annotated[float, Field(ge=0.0, le=1.0e-3)]
    accumulator_volume_m3: Annotated[float, Field(ge=0.0, le=10.0)]
    accumulator_precharge_pa: Gauge
    line_volume_m3: Annotated[float, Field(gt=0.0, le=10.0)]
    tank_oil_m3: Annotated[float, Field(gt=0.0, le=100.0)]

    @property
    def load_sensing(self) -> bool:
        """Whether the pump gives what the highest load asks for, instead of one pressure."""
        return self.supply_kind == 1.0

    @property
    def ready_pressure_pa(self) -> float:
        """What the supply stands at while no port is open, gauge."""
        return self.standby_pressure_pa if self.load_sensing else self.supply_pressure_pa

    @field_validator("supply_pressure_pa")
    @classmethod
    def _supply_above_tank(cls, supply_pa: float, others: ValidationInfo) -> float:
        tank_pa = others.data.get("tank_pressure_pa", -math.inf)
        if supply_pa <= tank_pa:
            raise impossible("is impossible", f"above the tank's pressure, {tank_pa:g} Pa")
        return supply_pa


class Sensor(Group):
    """Transducers, encoders, load pins and the inertial unit."""

    pressure_range_pa: Positive
    pressure_linearity_pa: Annotated[float, Field(ge=0.0, le=1.0e7)]
    pressure_hysteresis_pa: Annotated[float, Field(ge=0.0, le=1.0e7)]
    pressure_noise_pa: NotNegative
    pressure_ripple_pa: Annotated[float, Field(ge=0.0, le=1.0e7)]
    pressure_ripple_hz: Annotated[float, Field(gt=0.0, le=1.0e5)]
    pressure_resolution_pa: NotNegative
    thermal_zero_share: NotNegative
    thermal_span_share: Annotated[float, Field(ge=0.0, le=0.5)]
    thermal_range_k: Positive
    calibration_temperature_degc: float
    volts_factor_pa_per_v: Positive
    transducer_bandwidth_hz: Positive
    line_b_length_m: Positive
    line_b_frequency_hz: Positive
    line_b_damping: NotNegative
    encoder_linear_m: Positive
    encoder_counts_per_turn: Positive
    rope_tension_noise_n: NotNegative
    attitude_noise_rad: NotNegative
    rate_noise_rad_s: NotNegative
    rate_bias_rad_s: Annotated[float, Field(ge=0.0, le=10.0)]
    specific_force_bias_m_s2: Annotated[float, Field(ge=0.0, le=100.0)]
    specific_force_noise_m_s2: NotNegative
    supply_noise_pa: NotNegative
    temperature_resolution_k: NotNegative

    @property
    def bow_sd_pa(self) -> float:
        """Standard deviation of a transducer's bow, evenly drawn."""
        return self.pressure_linearity_pa / math.sqrt(3.0)

    @property
    def pressure_accuracy_pa(self) -> float:
        """Standard deviation of what a transducer errs by and no averaging removes: its bow, evenly
        drawn, and its loop, on whose one side or the other it reads.
        """
        return math.hypot(self.bow_sd_pa, self.loop_mean_pa)

    @property
    def loop_mean_pa(self) -> float:
        """Mean half width of a transducer's loop, evenly drawn from the narrowest to the widest."""
        return 0.5 * (1.0 + NARROWEST_LOOP) * self.pressure_hysteresis_pa

    @property
    def loop_sd_pa(self) -> float:
        """Standard deviation of that half width."""
        return (1.0 - NARROWEST_LOOP) * self.pressure_hysteresis_pa / math.sqrt(12.0)


class Rope(Group):
    """The two ropes."""

    stiffness_ea_n: Positive
    mass_per_length_kg_m: NotNegative
    breaking_load_n: Positive
    damping_n_s: NotNegative
    clearance_m: NotNegative


class Traction(Group):
    """The traction devices that haul the ropes."""

    piston_area_m2: Positive
    stroke_m: Positive
    annulus_area_m2: Positive
    return_speed_m_s: Positive
    clamp_s: Positive
    seat_m: NotNegative
    speed_max_m_s: Positive
    rating_n: Positive
    clamp_hold_n: Positive


class Ground(Group):
    """Contact of a foot with rock."""

    friction: NotNegative
    stiffness_n_m: Positive
    damping_n_s_m: NotNegative


class Drill(Group):
    """Hammer, rods and feed."""

    hammer_mass_kg: Positive
    feed_n: NotNegative
    blow_hz: Positive
    blow_n: NotNegative
    torque_nm: NotNegative
    rod_length_m: Positive
    rod_mass_kg: Positive
    pull_out_n: NotNegative
    blow_energy_j: Positive
    energy_share: Positive
    best_feed_n: Positive
    feed_exponent: NotNegative
    jam_feed_share: Positive
    jam_s: Positive
    unsteadiness: NotNegative
    unsteadiness_time_s: Positive


class Rock(Group):
    """What one kind of rock takes of the drill and gives back to it."""

    specific_energy_j_m3: Positive
    torque_share: NotNegative
    blow_share: NotNegative


class Rocks(Group):
    """The kinds of rock."""

    hard: Rock
    medium: Rock
    soft: Rock
    fractured: Rock


class Control(Group):
    """Gains of the position loops."""

    loop_gain_1_s: Positive
    integral_gain_1_s2: NotNegative
    integral_limit: NotNegative
    deadband_compensation: Share
    tolerance_m: NotNegative
