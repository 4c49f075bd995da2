"""What fits where a stride does not: the longest stride, and the furthest that the ropes may lead
to a side.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from testbed.control.gait import BelievedStart
from testbed.errors import InputError
from testbed.scenario.tasks import Crawl

HALVINGS = 6
"""The answer is found within this many halvings of what was asked for."""
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
    what = " or ".join(fits) or "no stride fits from here"
    return InputError(
        f"{asked}: {error.problem}",
        field=error.field,
        allowed=f"{what}; legs nearer to the middle of their ranges reach further (robot.radial_m)",
    )


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


def rope_azimuth_deg(start: BelievedStart) -> float:
    """Where the anchors' middle lies, from straight up the slope to the left, deg."""
    middle = start.anchors_in_body_m.mean(axis=0)
    return float(np.degrees(np.arctan2(middle[1], middle[0])))
