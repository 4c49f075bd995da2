"""What people measured of the place and the load before a robot's run: `surveyed` in its
recording.yaml.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from testbed.formats.checked import Checked, Sequence

UNIT_WITHIN = 0.01
"""A direction is a unit vector to this share: typed by hand to two digits."""


def _unit(vector: tuple[float, float, float]) -> tuple[float, float, float]:
    length = math.hypot(*vector)
    if abs(length - 1.0) > UNIT_WITHIN:
        raise ValueError(f"is no unit vector: its length is {length:.3g}")
    return vector


Direction = Annotated[tuple[float, float, float], Sequence, AfterValidator(_unit)]


class RopeDirections(Checked):
    """Unit vectors from the traction devices towards the anchors, world frame (z up)."""

    left: Direction
    """of the left rope"""
    right: Direction
    """of the right rope"""


class RopeLengths(Checked):
    """From the traction devices to the anchors."""

    left: float = Field(gt=0.0)
    """of the left rope [m]"""
    right: float = Field(gt=0.0)
    """of the right rope [m]"""


class Surveyed(Checked):
    """What was measured before the run."""

    rope_directions_in_world: RopeDirections
    """unit vectors from the traction devices to the anchors"""
    payload_kg: float = Field(ge=0.0)
    """load in the rod store [kg]"""
    rope_attachment_height_m: float | None = None
    """where the ropes are attached, body frame [m]; null: where the URDF has them"""
    rope_directions_sd_rad: float | None = Field(default=None, gt=0.0, le=0.5)
    """how far the directions may be off, standard deviation either way [rad]; null: by the
    tolerances. Estimates and detectors heed it
    """
    rope_stiffness_n_m: float | None = Field(default=None, gt=0.0)
    """EA over length of each rope as it hangs [N/m]; null: nobody knows, and whether the ropes are
    others is not looked for
    """
    rope_lengths_m: RopeLengths | None = None
    """from the traction devices to the anchors [m]; null: nobody knows, and the ropes are taken not
    to turn as the machine climbs
    """
    drills: bool = True
    """false: the drill never pushed. Of a recording without `ordered_thrust` nobody else knows, and
    its feet are not balanced
    """
    urdf: str | None = None
    """URDF of the machine, its path whole or from the recording's folder; null: the shipped one"""
    tolerances: Literal["workshop"] | None = "workshop"
    """how far the machine may be from its drawing; null: it is exactly that"""
