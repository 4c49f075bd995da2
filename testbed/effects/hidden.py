"""What a world has and its model lacks: plain numbers that effects write and the world puts where
they belong.

One object a run. Whatever nobody writes to stays as the machine has it. SI; cylinders by their axis
(`fl_radial`), feet by their leg, ropes by their side.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from testbed.machine.names import AXES, LEGS, SIDES


@dataclass
class HiddenCylinder:
    """One cylinder with its valve and its sensors. None: as the machine has it; 0 where a number is
    added to its own.
    """

    position_slope: float | None = None
    """F_c changes by this share over the whole stroke."""
    pressure_coefficient_m2: float = 0.0
    load_coefficient: float = 0.0
    bristle_stiffness_n_m: float | None = None
    bristle_damping_n_s_m: float | None = None
    elastic_share: float | None = None
    thinning_1_k: float | None = None
    """Viscous friction falls at this rate with the oil's temperature, above 20 degC."""
    mass_kg: float = 0.0
    spring_n_m: float | None = None
    spring_rest_m: float | None = None
    vibration_n: float | None = None
    vibration_hz: float | None = None
    cushion_n_m: float | None = None
    cushion_start_m: float | None = None
    leakage_m3_s_pa: float = 0.0
    air_share: float = 0.0
    hose_m3_pa: float | None = None
    hose_s: float | None = None
    deadband: float = 0.0
    gain_error_a: float = 0.0
    gain_error_b: float = 0.0
    zero_a_pa: float = 0.0
    zero_b_pa: float = 0.0
    hysteresis_pa: float = 0.0
    bow_pa: float = 0.0
    drift_a_pa_s: float | None = None
    line_b_hz: float | None = None
    line_b_damping: float | None = None
    pressure_delay_s: float = 0.0
    encoder_offset: float = 0.0
    """m, of a rotation joint rad; added to the reading."""
    play_rad: float = 0.0
    """Half of what a rotation joint moves before its encoder follows."""


@dataclass
class HiddenRope:
    """One rope: what its load pin adds, and where its anchor is."""

    tension_gain_error: float = 0.0
    tension_zero_n: float = 0.0
    azimuth_rad: float = 0.0
    """The anchor, seen from the robot, is turned to the left in the slope's plane."""
    elevation_rad: float = 0.0
    """... and raised off the slope."""
    attachment_height_m: float = 0.0
    """Added to the height at which it pulls, body frame."""


@dataclass
class HiddenFoot:
    """The ground under one foot."""

    settling_m_s: float = 0.0
    settling_depth_m: float = 0.0
    friction: float | None = None


@dataclass
class HiddenMass:
    """A mass fixed to the body at a point (3) of its frame, m."""

    mass_kg: float
    position_m: tuple[float, float, float]


@dataclass
class Hidden:
    """Everything that effects may change in a world."""

    cylinders: dict[str, HiddenCylinder] = field(
        default_factory=lambda: {axis: HiddenCylinder() for axis in AXES}
    )
    ropes: dict[str, HiddenRope] = field(
        default_factory=lambda: {f"rope_{side}": HiddenRope() for side in SIDES}
    )
    feet: dict[str, HiddenFoot] = field(
        default_factory=lambda: {f"foot_{leg}": HiddenFoot() for leg in LEGS}
    )
    body_masses: list[HiddenMass] = field(default_factory=list)
    centre_of_mass_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Shift of the body's centre of mass, body frame."""
    hinges_m: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    """Leg -> shift of its rotation joint, body frame."""
    unit_roll_rad: float = 0.0
    unit_pitch_rad: float = 0.0
    """How the inertial unit is mounted: added to what it reads."""
    rope_stiffness_factor: float = 1.0
    thrust_factor: float = 1.0
    pump_flow_factor: float = 1.0
    pump_pressure_factor: float = 1.0
    droop_pa_s_m3: float | None = None
    droop_s: float = 1.0

    def at(self, place: str) -> Any:
        """What is hidden at a place: of a cylinder, a rope or a foot; elsewhere, all else."""
        return {**self.cylinders, **self.ropes, **self.feet}.get(place, self)
