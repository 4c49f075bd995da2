"""What fits where a stride does not: the longest stride, and the furthest that the ropes may lead
to a side; and what no posture could do.

Feet that press on the slope with N hold mu N along it. Of the weight along the slope, N tan(slope),
a pull that leads aside by an angle a leaves them at least sin(a), however strong it is: where
sin(a) tan(slope) > mu no posture and no pull holds the machine.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from testbed.control.gait import BelievedStart
from testbed.errors import InputError
from testbed.machine.names import GRAVITY_M_S2
from testbed.scenario.tasks import Crawl

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
