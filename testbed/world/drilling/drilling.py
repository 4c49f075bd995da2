"""The drill's programs: what the drill does to the body over time, as the loads of laws/drill.py."""

from __future__ import annotations

import math
from bisect import bisect_right
from itertools import accumulate
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from testbed.control.drilling.thrust_plan import ramp_share
from testbed.laws import drill as d
from testbed.machine.model import Machine
from testbed.scenario.drilling import DrillHole
from testbed.scenario.tasks import Drill, Hammer, PullOut, Push, RodChange

Array = NDArray[np.float64]
Happened = dict[str, Any]


class Drilling(Protocol):
    """A drill at work. `loads` (DRILL_COLUMNS) is refreshed by `update`."""

    loads: Array
    phase: str
    store_change_kg: float
    """Mass to be put on the rod store (negative: taken off it); whoever does so sets it back to 0."""
    ordered: Array
    """(2,) thrust (N, + away from the slope) and torque on the rod (N m) that the drill's controls ask for."""
    most_n: float
    """Feed that the stance allows."""

    @property
    def stored_kg(self) -> float:
        """What the store has gained since the start (negative: lost), as the drill's controls count the rods, kg."""
        ...

    def update(self, t: float, dt: float) -> list[Happened]:
        """Set the loads that hold from t to t + dt (s); returns what has happened, without its time."""
        ...

    def summary(self) -> dict[str, Any]:
        """What came of it, for summary.json."""
        ...


class DrillProgram:
    """Phases of a scenario one after the other, whatever the rock; None: a drill that rests."""

    def __init__(self, task: Drill | None, loads: Array) -> None:
        self.loads = loads
        self.phase = "idle"
        self.store_change_kg = 0.0
        self.stored_kg = 0.0
        self.ordered = np.zeros(2)
        self.most_n = math.inf
        self._task = task
        self._starts = [0.0]
        self._changed = -1
        if task is not None:
            self._starts = list(
                accumulate((p.duration_s for p in task.phases), initial=task.start_s)
            )

    def update(self, t: float, dt: float) -> list[Happened]:
        """See Drilling."""
        before = self.phase
        self._set(t, dt)
        self.ordered[0] = self.loads[d.FEED] - self.loads[d.PULL]
        self.ordered[1] = self.loads[d.TORQUE]
        return [{"kind": f"drill_{self.phase}"}] if self.phase != before else []

    def _set(self, t: float, dt: float) -> None:
        task = self._task
        if task is None or t < self._starts[0]:
            return
        length = self._starts[-1] - self._starts[0]
        lap, since = divmod(t - self._starts[0], length)
        self.loads[d.FORCES] = 0.0
        if lap > 0 and not task.repeat:
            self.phase = "done"
            return
        k = (
            min(bisect_right(self._starts, self._starts[0] + since), len(task.phases)) - 1
        )  # the sum may round up
        phase = task.phases[k]
        begun = since - (self._starts[k] - self._starts[0])
        ramp = ramp_share(begun, phase.duration_s, task.ramp_s)
        if isinstance(phase, Push | Hammer):
            self.loads[d.FEED], self.loads[d.TORQUE] = ramp * phase.feed_n, ramp * phase.torque_nm
        if isinstance(phase, Hammer):
            self.loads[d.BLOW_N], self.loads[d.BLOW_HZ] = ramp * phase.blow_n, phase.blow_hz
            self.loads[d.DEPTH] += dt * phase.penetration_m_s
        if isinstance(phase, PullOut):
            self.loads[d.PULL] = ramp * phase.pull_n
        index = int(lap) * len(task.phases) + k
        if (
            isinstance(phase, RodChange)
            and index != self._changed
            and begun >= phase.duration_s / 2
        ):
            self._changed = index
            self.loads[d.STRING_KG] += phase.rod_kg
            self.store_change_kg -= phase.rod_kg
            self.stored_kg -= phase.rod_kg
        self.phase = phase.kind

    def summary(self) -> dict[str, Any]:
        """See Drilling."""
        return {"hole_depth_m": float(self.loads[d.DEPTH])}


def drill_known(drill: Drilling, out: Array) -> Array:
    """What the drill's controls know of it now, into `out` (KNOWN,) of laws/drill.py."""
    out[d.THRUST], out[d.REACTION] = drill.ordered[0], -drill.ordered[1]
    out[d.IN_HOLE_KG], out[d.IN_MAST_KG] = drill.loads[d.STRING_KG], drill.loads[d.MAST_KG]
    out[d.MAST_MIDDLE], out[d.STORED_KG] = drill.loads[d.MAST_HEIGHT], drill.stored_kg
    return out


def drilling_of(task: object, loads: Array, seed: int, numbers: Machine) -> Drilling:
    """The drill's program of a scenario's task; `numbers`: the true machine's."""
    if isinstance(task, DrillHole):
        from testbed.world.drilling.cycle import DrillCycle

        return DrillCycle(task, loads, seed, numbers)
    return DrillProgram(task if isinstance(task, Drill) else None, loads)
