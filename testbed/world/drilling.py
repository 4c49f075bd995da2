"""The drill's program: phases of a scenario turned into the loads of drill.py at a time."""

from __future__ import annotations

from bisect import bisect_right
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from testbed.laws import drill as d
from testbed.parameters.scenario_tasks import Drill, Hammer, PullOut, Push, RodChange

Array = NDArray[np.float64]


class DrillProgram:
    """Loads over time. `loads` (DRILL_COLUMNS) is refreshed by `update`; `store_change_kg` is taken off the store."""

    def __init__(self, task: Drill | None, loads: Array) -> None:
        self.loads = loads
        self.depth_m = 0.0
        self.phase = "idle"
        self.store_change_kg = 0.0
        self._task = task
        self._starts = [0.0]
        self._changed = -1
        if task is not None:
            self._starts = list(accumulate((p.duration_s for p in task.phases), initial=task.start_s))

    def update(self, t: float, dt: float) -> bool:
        """Set the loads that hold at time t (s); returns whether another phase has begun."""
        task, before = self._task, self.phase
        if task is None or t < self._starts[0]:
            return False
        length = self._starts[-1] - self._starts[0]
        lap, since = divmod(t - self._starts[0], length)
        if lap > 0 and not task.repeat:
            self.loads[: d.STRING_KG] = 0.0
            self.phase = "done"
            return before != "done"
        k = bisect_right(self._starts, self._starts[0] + since) - 1
        phase = task.phases[k]
        begun = since - (self._starts[k] - self._starts[0])
        ramp = min(1.0, begun / task.ramp_s, (phase.duration_s - begun) / task.ramp_s) if task.ramp_s > 0 else 1.0
        self.loads[: d.STRING_KG] = 0.0
        if isinstance(phase, Push | Hammer):
            self.loads[d.FEED], self.loads[d.TORQUE] = ramp * phase.feed_n, ramp * phase.torque_nm
        if isinstance(phase, Hammer):
            self.loads[d.BLOW_N], self.loads[d.BLOW_HZ] = ramp * phase.blow_n, phase.blow_hz
            self.depth_m += dt * phase.penetration_m_s
        if isinstance(phase, PullOut):
            self.loads[d.PULL] = ramp * phase.pull_n
        index = int(lap) * len(task.phases) + k
        if isinstance(phase, RodChange) and index != self._changed and begun >= phase.duration_s / 2:
            self._changed = index
            self.loads[d.STRING_KG] += phase.rod_kg
            self.store_change_kg -= phase.rod_kg
        self.phase = phase.kind
        return self.phase != before
