"""Where feet and body go in a cycle of the crawl: within the joints' ranges, with the largest
margin against a push.

Everything is reckoned in the path frame: parallel to the slope, where the body frame stood at the
start. A foot is put down half a step ahead of its home (its place under the body at the start) and
lifted half a step behind it. Before legs swing, the body moves to the side of the others: as far as
the wrench margin of the three remaining feet, ropes and friction counted, wants it, and as the
ranges of all four legs allow.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.machine.names import AXES, GRAVITY_M_S2, LEGS
from testbed.machine.scale import Scale
from testbed.robot.loads.foot_loads import external_wrench, point_wrench
from testbed.robot.model import RobotModel
from testbed.robot.robot import LegKinematics
from testbed.robot.stability import wrench_margin_n

SWAYS_M = np.arange(0.0, 0.241, 0.015)
"""Sideways shifts of the body that are tried, m."""
WANTED_SHARE = 0.085
"""A push of this share of the load normal to the slope is enough, with the next: larger shifts cost
time (E).
"""
WANTED_SHARE_OF_PULL = 0.03
"""And of this share of the load along the slope: ropes that pull unequally push by as much (E)."""
KEEP_OFF = np.tile([0.03, 0.01, 0.02], 4)
"""Distance kept from the ends of the joints, rad and m (E)."""
TENSION_ERROR = 0.02
"""The traction devices keep a tension within this share of what is wanted (E)."""


@dataclass(frozen=True)
class Swings:
    """The legs that swing next, one after the other, and what holds the machine meanwhile."""

    side: Array
    """(3) unit vector of the body's shift."""
    feet: Array
    """(4, 3) now."""
    footholds: list[tuple[int, Array]]
    """Each leg with its next place (3)."""
    further: Array
    """(3) how far the middle goes until the next swings, with the shift to the other side, which
    all legs must reach as well.
    """
    creep: Array
    """(3) how far the body goes on while these legs swing."""
    tensions: Array
    """(2) N."""
    ropes: Array
    """(2, 3) unit vectors along the ropes."""


class Footholds:
    """Plans body positions and footholds. `home` (4, 3): the feet at the start, path frame."""

    def __init__(
        self, model: RobotModel, legs: LegKinematics, start: Array, friction: float
    ) -> None:
        """Start (12): joints at the start; friction: believed, between foot and ground."""
        self.legs, self._model, self._friction = legs, model, friction
        self.home: Array = legs.feet(start)
        self.nought: Array = start - legs.joints(self.home)
        """(12,) start joints less those of the plain kinematics."""
        self.weight_n = model.total_mass_kg * GRAVITY_M_S2
        scale = Scale.of(model.total_mass_kg - model.carried_kg)
        self._sways_m = scale.length * SWAYS_M
        self._keep_off = KEEP_OFF * np.tile([1.0, scale.length, scale.length], len(LEGS))
        self._gravity = np.array([0.0, 0.0, -GRAVITY_M_S2])
        self.lightness = 1.0
        """Share of the weight that the slope carries."""
        self._wanted_n = WANTED_SHARE * self.weight_n

    def stand_under(self, gravity_in_body: Array) -> None:
        """Gravity (3,) m/s2 in the path frame, as the inertial unit has it at the start."""
        self._gravity = gravity_in_body.copy()
        self.lightness = -float(gravity_in_body[2]) / GRAVITY_M_S2
        along, normal = float(np.hypot(*gravity_in_body[:2])), -float(gravity_in_body[2])
        wanted = WANTED_SHARE * normal + WANTED_SHARE_OF_PULL * along
        self._wanted_n = wanted * self._model.total_mass_kg

    def joints(self, feet: Array, body: Array) -> Array:
        """Joints (12) that put the feet (4, 3) there with the body at `body` (3), path frame."""
        return np.asarray(self.legs.joints(feet - body) + self.nought)

    def reaches(self, feet: Array, body: Array) -> bool:
        """Whether all joints stay KEEP_OFF away from their ends."""
        joints, (low, high) = self.joints(feet, body), self._model.limits.T
        return bool(
            np.all(joints >= low + self._keep_off) and np.all(joints <= high - self._keep_off)
        )

    def lacking(self, feet: Array, body: Array) -> str:
        """The joint that is furthest beyond its range, in words."""
        joints = self.joints(feet, body)
        beyond = np.maximum(self._model.limits[:, 0] - joints, joints - self._model.limits[:, 1])
        beyond += self._keep_off
        return AXES[int(np.argmax(beyond))]

    def margin_n(
        self, feet: Array, body: Array, standing: list[int], tensions: Array, ropes: Array
    ) -> float:
        """Wrench margin, N, of the legs `standing` with the body at `body` (3): tensions (2) N
        along ropes (2, 3).
        """
        joints = self.joints(feet, body)
        load = external_wrench(self._model, joints, self._gravity, None, None, None)
        pulls = np.array(
            [
                point_wrench(rope, at)
                for rope, at in zip(ropes, self._model.rope_attachments_m, strict=True)
            ]
        )
        bounds = [
            (tension * (1.0 - TENSION_ERROR), tension * (1.0 + TENSION_ERROR))
            for tension in tensions
        ]
        up = np.tile([0.0, 0.0, 1.0], (len(standing), 1))
        centre = self._model.centre_of_mass_m(joints)
        return wrench_margin_n(
            feet[standing] - body, up, self._friction, load, centre, pulls, bounds
        )

    def body_goal(self, middle: Array, swings: Swings, enough: float = 1.0) -> tuple[Array, float]:
        """Body position (3) from which the legs can swing one after the other, with the body at
        `middle` (3) unshifted when the first one does.

        Returns the position and its margin, N: the smallest shift whose margin is this share of
        the wanted one, else the largest margin. Raises InputError where no shift keeps all legs
        within their ranges.
        """
        best: tuple[Array, float] | None = None
        for sway in self._sways_m:
            body = middle + sway * swings.side
            margin = self._margin(body, middle + swings.further - sway * swings.side, swings)
            if margin is None:
                continue
            if best is None or margin > best[1]:
                best = body, margin
            if margin >= enough * self._wanted_n:
                break
        if best is None:
            moved = swings.feet.copy()
            for leg, foothold in swings.footholds:
                moved[leg] = foothold
            raise InputError(
                f"takes {self.lacking(moved, middle)} out of its range",
                field="task.step_length_m",
                allowed="a shorter step, or legs nearer to the middle of their ranges (robot.radial_m)",
            )
        return best

    def _margin(self, body: Array, end: Array, swings: Swings) -> float | None:
        """Least margin over the swings, N, with the body at `body` at their start; None where a
        joint would leave its range.
        """
        feet, least = swings.feet.copy(), np.inf
        each = swings.creep / len(swings.footholds)
        for leg, foothold in swings.footholds:
            standing = [index for index in range(len(LEGS)) if index != leg]
            then = body + each
            if not self.reaches(feet, body):
                return None
            for place in (body, then) if each.any() else (body,):
                margin = self.margin_n(feet, place, standing, swings.tensions, swings.ropes)
                least = min(least, margin)
            feet[leg], body = foothold, then
            if not self.reaches(feet, body):
                return None
        return least if self.reaches(feet, end) else None
