"""A drilled hole as a task: the rock in layers, the string of rods, and how the drill is worked."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from testbed.formats.checked import Checked, Sequence, impossible

MOST_RODS_KG = 1400.0
"""About a third of the robot."""

RockKind = Literal["hard", "medium", "soft", "fractured", "void"]


class Layer(Checked):
    """One layer of rock along the hole; `void` is a gap into which the string falls."""

    kind: RockKind
    """hard, medium, soft, fractured or void"""
    thickness_m: float = Field(gt=0, le=100)
    """thickness along the hole [m]"""


class Stuck(Checked):
    """A place where the string sticks while it is pulled out."""

    depth_m: float = Field(ge=0, le=30)
    """depth of the bit at which it happens [m]"""
    hold_n: float = Field(default=16000.0, gt=0, le=60000)
    """pull that frees it at once; blows wear it down [N]"""


class Rock(Checked):
    """What the hole goes through: layers as given, below them layers drawn by seed."""

    seed: int | None = Field(default=None, ge=0)
    """seed of the layers; null: the run's"""
    layers: Annotated[tuple[Layer, ...], Sequence] = ()
    """layers from the surface down; drawn by seed below the last"""
    mean_thickness_m: float = Field(default=0.8, ge=0.05, le=20)
    """mean thickness of a drawn layer [m]"""
    strength_spread: float = Field(default=0.0, ge=0, le=1.5)
    """standard deviation of the logarithm of each layer's specific energy about its kind's"""
    void_share: float = Field(default=0.05, ge=0, le=0.9)
    """share of drawn layers that are voids"""
    void_m: float = Field(default=0.12, gt=0, le=2)
    """mean height of a drawn void [m]"""
    stuck: Annotated[tuple[Stuck, ...], Sequence] = ()
    """places where the string sticks while it is pulled"""
    stick_probability: float = Field(default=0.1, ge=0, le=1)
    """probability that a rod sticks somewhere on its way out"""


class DrillHole(Checked):
    """Drill one hole: position, collar, drill, add rods, and extract them one by one."""

    kind: Literal["drill_hole"]
    start_s: float = Field(default=3.0, ge=0)
    """time at which the bit is lowered [s]"""
    depth_m: float = Field(default=1.0, gt=0, le=30)
    """depth of the hole [m]"""
    drilled_m: float = Field(default=0.0, ge=0, le=30)
    """depth at the start; the string stands in it [m]"""
    rods: int = Field(default=14, ge=1, le=40)
    """rods on board, one of them in the mast"""
    rod_kg: float = Field(default=10.2, gt=0, le=100)
    """mass of a rod: a tube 10.2, a solid bar 53 [kg]"""
    rod_length_m: float = Field(default=1.5, ge=0.1, le=3)
    """length of a rod [m]"""
    feed_n: float = Field(default=5000.0, ge=500, le=20000)
    """feed force while drilling [N]"""
    torque_nm: float = Field(default=300.0, ge=0, le=5000)
    """torque on the rod in hard rock [N m]"""
    blow_hz: float = Field(default=35.0, ge=23, le=50)
    """blows of the hammer a second [Hz]"""
    blow_n: float = Field(default=1500.0, ge=0, le=20000)
    """peak of a blow's reaction on the body in hard rock [N]"""
    collar_m: float = Field(default=0.05, ge=0, le=1)
    """first part of the hole, drilled gently [m]"""
    collar_share: float = Field(default=0.5, gt=0, le=1)
    """feed and blows while collaring, of the full ones"""
    position_s: float = Field(default=2.0, gt=0, le=60)
    """time to lower the mast and set the bit [s]"""
    rod_change_s: float = Field(default=6.0, ge=1, le=600)
    """time to add or take off a rod [s]"""
    feed_speed_m_s: float = Field(default=0.2, gt=0, le=1)
    """speed of the sledge in voids and out [m/s]"""
    ramp_s: float = Field(default=0.3, gt=0, le=10)
    """time in which feed, torque and pull build up [s]"""
    pull_n: float = Field(default=2500.0, ge=0, le=20000)
    """pull on a string that comes freely [N]"""
    pull_max_n: float = Field(default=25000.0, gt=0, le=60000)
    """pull at which the feed's cylinder stalls on a stuck rod [N]"""
    jam_free_s: float = Field(default=8.0, gt=0, le=600)
    """time to draw a jammed bit back and turn it free, while drilling [s]"""
    give_up_s: float = Field(default=60.0, gt=0, le=3600)
    """a rod stuck for this long is left behind [s]"""
    extract: bool = True
    """take the rods out when the depth is reached"""
    keep_mast: bool = True
    """the vertical joints keep the mast at right angles to the slope"""
    rock: Rock = Rock()

    @property
    def rods_at_start(self) -> int:
        """Rods in the string at the start."""
        return self._rods_to(self.drilled_m)

    @property
    def rods_at_end(self) -> int:
        """Rods in the string at the bottom of the hole."""
        return self._rods_to(self.depth_m)

    def _rods_to(self, depth_m: float) -> int:
        return max(1, math.ceil(depth_m / self.rod_length_m - 1e-9))

    @property
    def stored_kg(self) -> float:
        """Rods in the store at the start, kg."""
        return (self.rods - self.rods_at_start) * self.rod_kg

    @model_validator(mode="after")
    def _rods_reach(self) -> DrillHole:
        if self.drilled_m >= self.depth_m:
            raise impossible(
                f"drilled_m = {self.drilled_m:g} leaves nothing to drill",
                f"less than depth_m = {self.depth_m:g}",
            )
        if self.rods * self.rod_length_m < self.depth_m - 1e-9:
            raise impossible(
                f"{self.rods} rods of {self.rod_length_m:g} m do not reach {self.depth_m:g} m",
                "more rods or less depth_m",
            )
        if self.rods * self.rod_kg > MOST_RODS_KG:
            raise impossible(
                f"{self.rods} rods of {self.rod_kg:g} kg are more than a third of the robot",
                f"at most {MOST_RODS_KG:g} kg of rods",
            )
        return self
