"""Small corrections of standing feet's heights and places: keep the body's attitude, share the load
evenly.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from testbed.compiled import njit
from testbed.control.gait import BelievedStart, Measured
from testbed.errors import InputError
from testbed.formats.arrays import Array, Flags
from testbed.machine.names import GRAVITY_M_S2
from testbed.machine.scale import ROBOCLIMBER, Scale
from testbed.robot.loads.foot_loads import internal_force_of
from testbed.robot.model import rotation_from_attitude, small_turn, write_rotation
from testbed.scenario.tasks import Crawl

LEVEL_GAIN_1_S = 0.3
"""Rate at which standing legs take out a tilt or a turn of the body."""
EVEN_GAIN_M_S_N = 2.0e-8
"""Height rate per newton of difference between the diagonals, while standing (E)."""
SEAT_GAIN_M_S_N = 1.2e-7
"""Height rate per newton while a foot is seated (E)."""
SEAT_SPEED_M_S = 0.004
"""Fastest change of heights for that."""


class Levelling:
    """Keeps the attitude (3: roll, pitch, yaw, rad) of the beginning. Feet (4, 3) and body (3):
    path frame.
    """

    def __init__(self, attitude_rad: Array, lightness: float, scale: Scale = ROBOCLIMBER) -> None:
        """lightness: the feet's share of the weight; the less they carry, the less a difference of
        loads says.
        """
        self._attitude = rotation_from_attitude(attitude_rad)
        self._ease = scale.speed / scale.force / float(np.sqrt(lightness))
        self._fastest_m_s = scale.speed * SEAT_SPEED_M_S
        self._diagonal: Array = np.zeros(4)
        self._now, self._turned = np.empty((3, 3)), np.empty((3, 3))

    def stand_on(self, feet: Array) -> None:
        """The footholds from which the diagonals are reckoned."""
        self._diagonal = 2.0 * internal_force_of(feet[:, :2])

    def correct(
        self,
        feet: Array,
        body: Array,
        standing: Flags,
        measured: Measured,
        seating: bool,
        dt: float,
    ) -> None:
        """Move the standing feet by what turns the body back, slowly; with all down, share the
        load out between the diagonals too.

        seating: whether a foot is being seated, which goes faster.
        """
        write_rotation(measured.attitude, self._now)
        np.matmul(self._attitude.T, self._now, out=self._turned)
        lift = self._even_out_m(measured.load, seating, dt) if all(standing.tolist()) else 0.0
        move_feet(feet, body, standing, self._turned, LEVEL_GAIN_1_S * dt, self._diagonal, lift)

    def _even_out_m(self, load_n: Array, seating: bool, dt: float) -> float:
        """How far to move along the internal force that shifts load between the diagonals and
        changes nothing else.
        """
        gain = (SEAT_GAIN_M_S_N if seating else EVEN_GAIN_M_S_N) * self._ease
        most = self._fastest_m_s
        return min(max(gain * float(self._diagonal @ load_n), -most), most) * dt


@njit
def move_feet(
    feet: Array,
    body: Array,
    standing: Flags,
    turned: Array,
    share: float,
    diagonal: Array,
    lift_m: float,
) -> None:
    """Move standing feet (4, 3) by a share of what the body has turned by (3, 3), and along
    `diagonal` (4) by `lift_m`.
    """
    roll, pitch, yaw = small_turn(turned)
    roll, pitch, yaw = share * roll, share * pitch, share * yaw
    for leg in range(feet.shape[0]):
        if standing[leg]:
            x, y = feet[leg, 0] - body[0], feet[leg, 1] - body[1]
            feet[leg, 0] += -yaw * y
            feet[leg, 1] += yaw * x
            feet[leg, 2] += roll * y - pitch * x
            feet[leg, 2] += diagonal[leg] * lift_m


# What fits where a stride does not: the longest stride, and the furthest that the ropes may lead to
# a side; and what no posture could do.
#
# Feet that press on the slope with N hold mu N along it. Of the weight along the slope, N
# tan(slope), a pull that leads aside by an angle a leaves them at least sin(a), however strong it
# is: where sin(a) tan(slope) > mu no posture and no pull holds the machine.

HALVINGS = 6
"""The answer is found within this many halvings of what was asked for."""
ALIKE = 0.01
"""Tensions that differ by a smaller share are meant to be equal."""
Rehearse = Callable[[Crawl, float], None]
"""Plans a task with a share of the ropes' azimuth; InputError where it is out of reach."""


def explained(
    error: InputError, task: Crawl, start: BelievedStart, rehearse: Rehearse
) -> InputError:
    """The error with its cause, and with the longest stride and the largest azimuth that fit."""
    azimuth_deg = rope_azimuth_deg(start)
    asked = f"a stride of {task.step_length_m:g} m {task.heading_deg:g} deg from straight up"
    if start.rope_tension_n.any():
        asked += f", ropes {azimuth_deg:.0f} deg aside"

    def stride(share: float) -> None:
        rehearse(task.model_copy(update={"step_length_m": share * task.step_length_m}), 1.0)

    fits = []
    longest = largest(stride)
    if longest > 0.0:
        fits.append(f"a stride up to {longest * task.step_length_m:.2f} m")
    if abs(azimuth_deg) > 1.0:
        widest = largest(lambda share: rehearse(task, share))
        if widest > 0.0:
            fits.append(f"ropes up to about {abs(widest * azimuth_deg):.0f} deg aside")
        fits += _straighter(start)
    if start.rope_tension_n.any():
        never = friction_share(start)
        if never > 1.0:
            return InputError(
                f"{asked}: no posture and no pull holds the machine: the nearer rope leads {nearest_deg(start):.0f} deg aside, "
                f"which asks for {never:.2f} times the friction that is believed",
                field="ropes.azimuth_deg",
                allowed=f"ropes of which one leads no more than {widest_deg(start):.0f} deg aside",
            )
    what = " or ".join(fits) or "no stride fits from here"
    return InputError(
        f"{asked}: {error.problem}",
        field=error.field,
        allowed=f"{what}; legs nearer to the middle of their ranges reach further (robot.radial_m)",
    )


def _straighter(start: BelievedStart) -> list[str]:
    """What would make the ropes pull straight up the slope, in one phrase; none where they do."""
    one, other = start.rope_tension_n
    ways = ["ropes.pull: straight"] if math.isclose(one, other, rel_tol=ALIKE) else []
    if nearest_deg(start) > 0.0:
        apart_m = 2.0 * abs(start.anchors_in_body_m[:, 1].mean())
        ways.append(f"anchors more than {apart_m:.0f} m apart (ropes.anchor_spread_m)")
    return [" with ".join(ways)] if ways else []


def largest(rehearse: Callable[[float], None]) -> float:
    """The largest share, 0 to 1, that can be rehearsed, to within a 64th; 0 where none can."""
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        share = 0.5 * (low + high)
        try:
            rehearse(share)
            low = share
        except InputError:
            high = share
    return low


def nearest_deg(start: BelievedStart) -> float:
    """The least angle from straight up the slope at which the ropes can pull together, deg."""
    aside = np.degrees(np.arctan2(*start.rope_directions_in_body[:, 1::-1].T))
    return 0.0 if aside[0] * aside[1] <= 0.0 else float(np.abs(aside).min())


def friction_share(start: BelievedStart) -> float:
    """Least share of the believed friction that standing takes with the best pull of these ropes,
    whatever the posture; without drill and with ropes along the slope.
    """
    return math.sin(math.radians(nearest_deg(start))) / max(_holds(start), 1e-9)


def widest_deg(start: BelievedStart) -> float:
    """The angle at which `friction_share` is 1, deg."""
    return math.degrees(math.asin(min(_holds(start), 1.0)))


def _holds(start: BelievedStart) -> float:
    """Friction over the slope's tangent: the share of the weight along it that feet hold. The slope
    is what the feet's load says of it.
    """
    upright = min(float(start.load_n.sum()) / (start.model.total_mass_kg * GRAVITY_M_S2), 1.0)
    return start.robot.machine.ground.friction * upright / max(math.sqrt(1.0 - upright**2), 1e-9)


def rope_azimuth_deg(start: BelievedStart) -> float:
    """Where the anchors' middle lies, from straight up the slope to the left, deg."""
    middle = start.anchors_in_body_m.mean(axis=0)
    return float(np.degrees(np.arctan2(middle[1], middle[0])))
