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

    replaced: dict[str, float] = field(default_factory=dict)
    """Path in AxisParameters (laws/hydraulics.py) -> number in the place of the machine's."""
    added: dict[str, float] = field(default_factory=dict)
    """The same -> number on top of the machine's."""
    mass_kg: float = 0.0
    gain_error_a: float = 0.0
    gain_error_b: float = 0.0
    zero_a_pa: float = 0.0
    zero_b_pa: float = 0.0
    hysteresis_pa: float = 0.0
    bow_pa: float = 0.0
    drift_a_pa_s: float | None = None
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
