"""The thrust that a drill's program orders, and for how long it still rises: its controls know that
beforehand.
"""

from __future__ import annotations

from bisect import bisect_right
from itertools import accumulate

import numpy as np

from testbed.formats.arrays import Array
from testbed.scenario.tasks import Drill
from testbed.world.drilling.drilling import ramp_share


def planned_thrust(task: object, steps: int, step_s: float) -> Array:
    """(steps, 2): thrust ordered at the end of each step (N, + away from the slope), seconds that
    it still rises.

    Zeros for whatever is no list of phases: what a hole drilled through layers asks for, the rock
    decides.
    """
    plan = np.zeros((steps, 2))
    if not isinstance(task, Drill):
        return plan
    starts = list(accumulate((phase.duration_s for phase in task.phases), initial=0.0))
    for index in range(steps):
        plan[index, 0] = _ordered_n(task, starts, (index + 1) * step_s - task.start_s)
    for index in range(steps - 2, -1, -1):
        plan[index, 1] = plan[index + 1, 1] + step_s if plan[index + 1, 0] > plan[index, 0] else 0.0
    return plan


def _ordered_n(task: Drill, starts: list[float], since_s: float) -> float:
    if since_s < 0.0 or (since_s >= starts[-1] and not task.repeat):
        return 0.0
    within = since_s % starts[-1]
    order = bisect_right(starts, within) - 1
    phase = task.phases[order]
    most = getattr(phase, "feed_n", 0.0) - getattr(phase, "pull_n", 0.0)
    return ramp_share(within - starts[order], phase.duration_s, task.ramp_s) * float(most)
