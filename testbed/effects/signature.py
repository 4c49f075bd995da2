"""What an effect does to the measurements of the whole robot, linearised: its signature.

The diagnosis of the robot holds the measured machine against its model in a handful of balances. An
effect answers one question: by how much does each of these balances miss for one unit of each of
its parameters? What it may look at are the measured bins (`RobotSeen`); what it gives back are
plain arrays (`Signature`), which the diagnosis turns into columns of one linear regression.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from testbed.formats.arrays import Array
from testbed.machine.names import AXES, SIDES


@dataclass(frozen=True, eq=False)
class RobotSeen:
    """The robot's measurements in bins of equal length, as the model believes them; n bins, AXES
    order, SI.

    Signs: extension, speed and cylinder force positive outwards, friction positive against
    extension.
    """

    time_s: Array
    """(n,) middle of each bin, from the start of the recording."""
    extension_m: Array
    """(n, 12) of the pistons."""
    joint: Array
    """(n, 12) the encoders' readings, m, of rotation joints rad."""
    speed_m_s: Array
    """(n, 12) of the pistons."""
    acceleration_m_s2: Array
    """(n, 12) of the pistons."""
    direction: Array
    """(n, 12) sense of sliding, from -1 to 1; 0 where the piston stands still."""
    arm_m: Array
    """(n, 12) way of the piston by that of its joint."""
    pressure_a_pa: Array
    """(n, 12) mean of each bin, gauge."""
    pressure_b_pa: Array
    """(n, 12) likewise of chambers B."""
    pressure_a_rate: Array
    """(n, 12) mean change over each bin, Pa/s."""
    pressure_b_rate: Array
    """(n, 12) likewise of chambers B."""
    pressure_range_pa: Array
    """(12,) up to which their sensors read."""
    area_a_m2: Array
    """(12,) of the pistons."""
    area_b_m2: Array
    """(12,) of the pistons' rod sides."""
    stroke_m: Array
    """(12,) from end to end."""
    coulomb_n: Array
    """(n, 12) believed dry friction of the sense in which the piston slides."""
    dry_n: Array
    """(n, 12) the same with what the force across the rod adds to it."""
    sense: Array
    """(n, 12) believed sense of it, from -1 to 1: `direction`, or what a seal at rest keeps."""
    viscous_n: Array
    """(n, 12) believed viscous friction, with its sign."""
    load_n: Array
    """(n, 12) force that the joint takes along its cylinder, as believed."""
    side_load_n: Array
    """(n, 12) force across the rod, as believed."""
    oil_degc: Array
    """(n,) oil temperature."""
    supply_pa: Array
    """(n,) measured supply pressure."""
    command: Array
    """(n, 12) valve command."""
    gravity: Array
    """(n, 3) gravity less the body's acceleration, body frame, m/s2."""
    attitude_rad: Array
    """(n, 3) roll, pitch, yaw."""
    tension_n: Array
    """(n, 2) of the ropes, left and right."""
    rope_way: Array
    """(n, 2, 3) unit vectors from the body towards the anchors, body frame."""
    rope_point_m: Array
    """(2, 3) where they pull, body frame."""
    slope_frame: Array
    """(n, 3, 3) rows: x up the slope, y left, z off it, in the body frame."""
    drill_point_m: Array
    """(3,) where the drill pushes on the body, body frame."""
    thrust_n: Array
    """(n,) ordered thrust."""
    body_mass_kg: float
    """Mass of the link `body`."""
    foot_m: Array
    """(n, 4, 3) undersides of the feet, body frame."""
    foot_by_joint: Array
    """(n, 4, 3, 3) their change by the leg's three joints."""

    asked_by_link: Array
    """(n, 18, 12) generalised forces (body 6, joints 12) that one more kilogram of what each
    cylinder moves asks for.
    """
    asked_by_moment: Array
    """(n, 18, 4) the same of one kilogram at the body's origin and of first moments of 1 kg m along
    x, y, z.
    """
    asked_by_gravity: Array
    """(n, 18, 3) the same of the whole machine by 1 m/s2 of specific force along x, y, z of the
    body.
    """
    missing_by_joint: Array
    """(n, 18, 12) what the balances miss by an encoder that reads 1 m or rad too much."""

    friction_use: Array
    """(n, 4) force along the slope over force off it, of each foot as believed."""
    oil_by_leak: Array
    """(n, 12, 2) what the oil of chambers A and B misses by 1 m3/(s Pa) of leakage across the
    piston.
    """
    oil_by_deadband: Array
    """(n, 12, 2) by a whole travel more of overlap."""
    oil_by_air: Array
    """(n, 12, 2) by a share 1 of free air."""
    oil_by_hose: Array
    """(n, 12, hoses, 2) by 1 m3/Pa of each of the hoses of hydraulics.hose."""
    oil_by_reading: Array
    """(n, 12, 2) by a pressure sensor, of A or of B, that reads 1 Pa too much."""
    oil_by_lateness: Array
    """(n, 12, 2) by a pressure sensor, of A or of B, that reads 1 s late."""
    supply_by_pressure: Array
    """(n,) change of the believed supply pressure by the pump's set pressure, as a factor, Pa."""
    supply_by_flow: Array
    """(n,) the same by the pump's flow, as a factor, Pa."""
    supply_by_droop: Array
    """(n, lags) the same by 1 Pa s/m3 of a droop that follows the drawn flow with each lag of
    supply.droop, Pa.
    """
    shows_ropes: bool
    """Whether ropes were held while the body moved, and how stiff they are declared is known."""
    line_hz: Array
    """(12,) frequency of the strongest line of each piston's force."""
    line_n: Array
    """(12,) its amplitude, 0 where it may be noise."""
    visited_m: Array | None = None
    """(2, 12) least and greatest extension in all recordings that are weighed together; None: this
    one is alone.
    """

    @property
    def bins(self) -> int:
        """How many there are."""
        return len(self.time_s)

    def axis(self, place: str) -> int:
        """Index of the cylinder `place` among the twelve."""
        return AXES.index(place)

    def rope(self, place: str) -> int:
        """Index of the rope `rope_left` or `rope_right`."""
        return SIDES.index(place.removeprefix("rope_"))

    def travel_m(self, axis: int) -> tuple[float, float]:
        """Least and greatest extension of a cylinder in all that is weighed together."""
        here = self.extension_m[:, axis]
        both = (here.min(), here.max()) if self.visited_m is None else self.visited_m[:, axis]
        return float(both[0]), float(both[1])

    def weighs(self, asked: Array) -> Change:
        """The change by a mass that asks for generalised forces (n, 18) which nobody believes
        in.
        """
        joints = {index: asked[:, 6 + index] / self.arm_m[:, index] for index in range(len(AXES))}
        return Change(force=joints, wrench=asked[:, :6])

    def reads(self, axis: int, chamber: int, more_pa: Array) -> Change:
        """The change by sensor A (0) or B (1) of a cylinder that reads (n,) Pa too much: a force,
        and other flows.
        """
        area = (self.area_a_m2, -self.area_b_m2)[chamber][axis]
        flow = np.zeros((self.bins, 2))
        flow[:, chamber] = self.oil_by_reading[:, axis, chamber] * more_pa
        return Change(force={axis: area * more_pa}, oil={axis: flow})

    def both_read(self, axis: int, more_pa: Array) -> Change:
        """The change by both sensors of a cylinder, A and B, that read (n, 2) Pa too much."""
        a, b = (self.reads(axis, chamber, more_pa[:, chamber]) for chamber in range(2))
        return Change(
            force={axis: a.force[axis] + b.force[axis]}, oil={axis: a.oil[axis] + b.oil[axis]}
        )

    def pressures_pa(self, axis: int) -> Array:
        """(n, 2) what both sensors of a cylinder read, A and B."""
        return np.column_stack([self.pressure_a_pa[:, axis], self.pressure_b_pa[:, axis]])

    def later(self, axis: int, chamber: int, by_s: float) -> Array:
        """(n,) Pa, mean pressure of A (0) or B (1) over bins that lie `by_s` later; after the
        recording's end it stays.
        """
        from scipy.interpolate import CubicHermiteSpline

        mean = (self.pressure_a_pa, self.pressure_b_pa)[chamber][:, axis]
        rate = (self.pressure_a_rate, self.pressure_b_rate)[chamber][:, axis]
        step = float(self.time_s[1] - self.time_s[0])
        at = step * np.arange(self.bins + 1)
        edges = step * np.concatenate([[0.0], np.cumsum(rate)])
        edges += float(np.mean(mean) - np.mean(0.5 * (edges[1:] + edges[:-1])))
        summed = CubicHermiteSpline(at, step * np.concatenate([[0.0], np.cumsum(mean)]), edges)
        inside = np.minimum(at + by_s, at[-1])
        whole = summed(inside) + (at + by_s - inside) * edges[-1]
        return np.asarray(np.diff(whole) / step)

    def moves(self, leg: int, way_m: Array, axis: int) -> Change:
        """The change by a foot that seems to be elsewhere by (n,) m along x up the slope, y left or
        z off it (axis).
        """
        feet = np.zeros_like(self.foot_m)
        feet[:, leg] = way_m[:, None] * self.slope_frame[:, axis]
        return Change(feet=feet)

    def tilted(self, k: int) -> Change:
        """The change by an inertial unit turned by 1 rad about body axis k: weight and ropes in
        other directions.
        """
        about = np.eye(3)[k]
        down = np.cross(about, -self.gravity)
        asked = np.einsum("nij,nj->ni", self.asked_by_gravity, down)
        weight = self.weighs(asked)
        assert weight.wrench is not None
        pulls = self.tension_n[:, :, None] * self.rope_way
        ropes = sum(at_point(-np.cross(about, pulls[:, r]), self.rope_point_m[r]) for r in (0, 1))
        return Change(force=weight.force, wrench=weight.wrench + ropes, unit_turned=about)


@dataclass(frozen=True, eq=False)
class Change:
    """What one unit of a parameter makes the balances miss (measured less believed); all with n
    bins first.

    Nothing given: that balance does not change.
    """

    force: Mapping[int, Array] = field(default_factory=dict)
    """Cylinder -> (n,) by which its believed force on the joint is larger than the true one, N."""
    wrench: Array | None = None
    """(n, 6) by which the believed wrench on the body is larger than the true one, body frame."""
    oil: Mapping[int, Array] = field(default_factory=dict)
    """Cylinder -> (n, 2) by which more oil is believed to enter chambers A and B than they took up,
    m3/s.
    """
    balance: Array | None = None
    """(n, 18) what the balances miss, where it is neither a cylinder's force nor a wrench."""
    line: Mapping[int, Array] = field(default_factory=dict)
    """Cylinder -> (2,) cosine and sine amplitude of its force at its line, N."""
    feet: Array | None = None
    """(n, 4, 3) by which the feet seem to stand elsewhere, body frame, m."""
    supply: Array | None = None
    """(n,) by which the believed supply pressure is above the measured one, Pa."""
    unit_turned: Array | None = None
    """(3,) rad, by which roll, pitch and yaw read too much."""
    ropes: float = 0.0
    """By which held ropes seem stiffer, share of what is declared."""

    def times(self, factor: float) -> Change:
        """The change by so many units."""
        given = (self.wrench, self.balance, self.feet, self.supply, self.unit_turned)
        wrench, balance, feet, supply, turned = (
            None if one is None else factor * one for one in given
        )
        return Change(
            force={axis: factor * force for axis, force in self.force.items()},
            wrench=wrench,
            oil={axis: factor * flow for axis, flow in self.oil.items()},
            line={axis: factor * parts for axis, parts in self.line.items()},
            balance=balance,
            feet=feet,
            supply=supply,
            unit_turned=turned,
            ropes=factor * self.ropes,
        )


Signature = Mapping[str, Change]
"""Parameter -> change for one unit of it."""


@dataclass(frozen=True, eq=False)
class Course:
    """One of several signatures that an effect with a course in time may have."""

    signature: Signature
    sizes: tuple[float, ...] = (1.0,)
    """How large its numbers may all be: shares of what is usual."""
    price: float = 0.0
    """Ln of the odds against it, before anything is seen of it."""


def at_point(force: Array, point: Array) -> Array:
    """Wrench (n, 6) about the body's origin of forces (n, 3) at a point (3) or points (n, 3)."""
    return np.hstack([force, np.cross(np.broadcast_to(point, force.shape), force)])


KNOT_S = 2.0
"""Distance of the knots of a drift of unknown course (E)."""


def knots(time_s: Array) -> Array:
    """(n, k) straight lines between times KNOT_S apart: 0 at the start, then a tent for each later
    one.
    """
    at = np.arange(0.0, time_s[-1] + KNOT_S, KNOT_S)
    return np.column_stack([np.interp(time_s, at, row) for row in np.eye(len(at))[1:]])
