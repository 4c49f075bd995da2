"""The ground of a scenario: its shape, and what it gives a foot to stand on."""

from __future__ import annotations

import itertools
from typing import Annotated, Literal

from pydantic import Field, model_validator

from testbed.formats.checked import Checked, Pair, Sequence, impossible

Kind = Literal["plane", "box", "heightfield", "profile", "elevation"]


class Patch(Checked):
    """A round place where the ground is another one; what is left out is as everywhere. The last
    patch wins.
    """

    foot: Literal["fl", "fr", "rl", "rr"] | None = None
    """under this foot's place at the start, instead of x_m and y_m"""
    x_m: float = Field(default=0.0, ge=-200, le=200)
    """centre, up the slope from the world's origin [m]"""
    y_m: float = Field(default=0.0, ge=-200, le=200)
    """centre, to the left [m]"""
    radius_m: float = Field(default=0.3, gt=0, le=200)
    """radius [m]"""
    friction: float | None = Field(default=None, ge=0, le=2)
    """friction coefficient"""
    stiffness_n_m: float | None = Field(default=None, ge=1e5, le=1e10)
    """stiffness under one foot; a foot takes it on as it comes down [N/m]"""
    damping_n_s_m: float | None = Field(default=None, ge=0, le=1e8)
    """damping under one foot [N s/m]"""
    plastic_n_m: float | None = Field(default=None, ge=2e4, le=1e9)
    """load for each metre that the ground settles for good [N/m]"""

    @model_validator(mode="after")
    def _is_one_other_place(self) -> Patch:
        if self.foot is not None and (self.x_m != 0.0 or self.y_m != 0.0):
            raise impossible("a foot's place beside x_m or y_m", "one of both")
        ground = ("friction", "stiffness_n_m", "damping_n_s_m", "plastic_n_m")
        if all(getattr(self, name) is None for name in ground):
            raise impossible("a patch of the same ground", f"one of {', '.join(ground)}")
        return self


class Elevation(Checked):
    """Heights from a file: .npy, Esri ASCII (.asc), or GeoTIFF (.tif; needs the extra `geo`)."""

    file: str
    """the file; relative to the scenario's"""
    frame: Literal["world", "slope"] = "world"
    """world: heights above level ground, the slope is found from them; slope: heights above
    slope_deg
    """
    cell_m: float | None = Field(default=None, gt=0.005, le=50)
    """distance of the points of a .npy, rows along x, columns along y [m]"""
    centre_m: Pair | None = None
    """where the robot stands, in the file's coordinates; null: its middle [m]"""


class Terrain(Checked):
    """The ground; its mean surface passes through the world's origin and rises towards +x."""

    kind: Kind = "plane"
    """how the ground is made in the engine"""
    slope_deg: float = Field(default=0.0, ge=0, le=85)
    """angle of the slope [deg]"""
    friction: float = Field(default=0.7, ge=0, le=2)
    """friction coefficient between foot and ground"""
    stiffness_n_m: float = Field(default=1.0e8, ge=1e5, le=1e10)
    """stiffness of the ground under one foot [N/m]"""
    damping_n_s_m: float = Field(default=2.0e5, ge=0, le=1e8)
    """damping of the ground under one foot [N s/m]"""
    plastic_n_m: float | None = Field(default=None, ge=2e4, le=1e9)
    """loose ground: load for each metre that it settles for good; null: firm [N/m]"""
    settle_s: float = Field(default=0.6, gt=0.02, le=1000)
    """time in which loose ground settles under a new load [s]"""
    loading_order: Literal["ground_first", "robot_first"] = "robot_first"
    """what the engine loads first"""
    roughness_m: float = Field(default=0.0, ge=0, le=0.5)
    """standard deviation of the height (heightfield) [m]"""
    roughness_seed: int = Field(default=0, ge=0)
    """seed of the rough surface"""
    hurst: float = Field(default=0.8, ge=0, le=1)
    """spectrum of the roughness: power falls as wave number ^ -(2 hurst + 2)"""
    cell_m: float = Field(default=0.1, gt=0.01, le=1)
    """distance of the grid's points (heightfield, elevation) [m]"""
    profile_m: Annotated[tuple[Pair, ...], Sequence] = ()
    """benches and steps (profile): points [x up the slope, height off it], x never falling [m]"""
    elevation: Elevation | None = None
    """the file of kind elevation"""
    patches: Annotated[tuple[Patch, ...], Sequence] = ()
    """places with other friction, stiffness or looseness"""

    @property
    def loose(self) -> bool:
        """Whether the ground settles anywhere."""
        return self.plastic_n_m is not None or any(
            patch.plastic_n_m is not None for patch in self.patches
        )

    @model_validator(mode="after")
    def _kind_has_its_shape(self) -> Terrain:
        if self.roughness_m > 0 and self.kind != "heightfield":
            raise impossible(
                f"roughness_m = {self.roughness_m} needs kind heightfield, not {self.kind}",
                "roughness_m: 0 or kind: heightfield",
            )
        if (self.kind == "profile") != bool(self.profile_m):
            raise impossible("kind profile and profile_m go together", "both or neither")
        if (self.kind == "elevation") != (self.elevation is not None):
            raise impossible(
                "kind elevation and the section elevation go together", "both or neither"
            )
        return self

    @model_validator(mode="after")
    def _profile_goes_up_the_slope(self) -> Terrain:
        points = self.profile_m
        if points and (len(points) < 2 or any(max(map(abs, point)) > 200 for point in points)):
            raise impossible(
                "profile_m needs two points at least, none beyond 200 m", "[[0.5, 0], [0.5, 0.1]]"
            )
        for (x0, z0), (x1, z1) in itertools.pairwise(points):
            if x1 < x0 or (x1 == x0 and z1 == z0):
                raise impossible(
                    f"profile_m goes from x = {x0:g} to {x1:g}",
                    "points whose x does not fall, none twice in a row",
                )
        return self
