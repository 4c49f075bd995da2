"""The drill's programs: what the drill does to the body over time, as the loads of laws/drill.py;
and a drill that waits when control tells it to: its loads fade out, its programme stands still,
then both go on.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass
from itertools import accumulate
from typing import Any, Protocol

from numpy.typing import NDArray

from testbed.machine.model import Machine
from testbed.scenario.drilling import DrillHole
from testbed.scenario.tasks import Drill, Hammer, PullOut, Push, RodChange

Happened = dict[str, Any]


def ramp_share(begun_s: float, duration_s: float, ramp_s: float) -> float:
    """Share of a phase's forces `begun_s` after it began: they rise and fall at its edges within
    `ramp_s`.
    """
    return min(1.0, begun_s / ramp_s, (duration_s - begun_s) / ramp_s) if ramp_s > 0.0 else 1.0


@dataclass
class Loads:
    """What the drill does to the body and where its string is: the numbers of DrillLoads, by their
    names and units, while the drill works them out.
    """

    feed: float = 0.0
    blow: float = 0.0
    blow_rate: float = 0.0
    torque: float = 0.0
    pull: float = 0.0
    string_mass: float = 0.0
    mast_mass: float = 0.0
    mast_height: float = 0.0
    depth: float = 0.0

    def numbers(self) -> tuple[float, ...]:
        """All of them."""
        return tuple(vars(self).values())

    def scale_order(self, share: float) -> None:
        """Scale what acts; where the string is stays as it is."""
        self.feed *= share
        self.blow *= share
        self.blow_rate *= share
        self.torque *= share
        self.pull *= share


@dataclass
class Ordered:
    """What the drill's controls ask for."""

    thrust: float = 0.0
    """N, away from the slope."""
    torque: float = 0.0
    """N m, on the rod."""


class Drilling(Protocol):
    """A drill at work. `loads` is refreshed by `update`."""

    loads: Loads
    phase: str
    store_change_kg: float
    """Mass to be put on the rod store (negative: taken off it); whoever does so sets it back to
    0.
    """
    ordered: Ordered
    most_n: float
    """Feed that the stance allows."""
    feed_n: float | None
    """Feed that control wants while it drills; None: its task's."""
    hammer: float
    """Share of a blow's energy that control wants."""

    @property
    def stored_kg(self) -> float:
        """What the store has gained since the start (negative: lost), as the drill's controls count
        the rods, kg.
        """
        ...

    def update(self, t: float, dt: float) -> list[Happened]:
        """Set the loads that hold from t to t + dt (s); returns what has happened, without its
        time.
        """
        ...

    def reseed(self, seed: int) -> None:
        """Let what is still random of it come from another seed."""
        ...

    def summary(self) -> dict[str, Any]:
        """What came of it, for summary.json."""
        ...

    def progress(self) -> dict[str, Any]:
        """Whether it is `done`, and how much of what was wanted is made."""
        ...


class DrillProgram:
    """Phases of a scenario one after the other, whatever the rock; None: a drill that rests."""

    def __init__(self, task: Drill | None) -> None:
        self.loads = Loads()
        self.phase = "idle"
        self.store_change_kg = 0.0
        self.stored_kg = 0.0
        self.ordered = Ordered()
        self.most_n = math.inf
        self.feed_n: float | None = None
        self.hammer = 1.0
        self._task = task
        self._starts = [0.0]
        self._changed = -1
        if task is not None:
            self._starts = list(
                accumulate((phase.duration_s for phase in task.phases), initial=task.start_s)
            )

    def update(self, t: float, dt: float) -> list[Happened]:
        """See Drilling."""
        before = self.phase
        self._set(t, dt)
        self.ordered.thrust = self.loads.feed - self.loads.pull
        self.ordered.torque = self.loads.torque
        return [{"kind": f"drill_{self.phase}"}] if self.phase != before else []

    def _set(self, t: float, dt: float) -> None:
        task = self._task
        if task is None or t < self._starts[0]:
            return
        length = self._starts[-1] - self._starts[0]
        lap, since = divmod(t - self._starts[0], length)
        loads = self.loads
        loads.scale_order(0.0)
        if lap > 0 and not task.repeat:
            self.phase = "done"
            return
        # The sum may round up.
        k = min(bisect_right(self._starts, self._starts[0] + since), len(task.phases)) - 1
        phase = task.phases[k]
        begun = since - (self._starts[k] - self._starts[0])
        ramp = ramp_share(begun, phase.duration_s, task.ramp_s)
        if isinstance(phase, Push | Hammer):
            feed = phase.feed_n if self.feed_n is None else self.feed_n
            loads.feed, loads.torque = ramp * feed, ramp * phase.torque_nm
        if isinstance(phase, Hammer):
            loads.blow, loads.blow_rate = ramp * self.hammer * phase.blow_n, phase.blow_hz
            loads.depth += dt * self.hammer * phase.penetration_m_s
        if isinstance(phase, PullOut):
            loads.pull = ramp * phase.pull_n
        index = int(lap) * len(task.phases) + k
        if (
            isinstance(phase, RodChange)
            and index != self._changed
            and begun >= phase.duration_s / 2
        ):
            self._changed = index
            loads.string_mass += phase.rod_kg
            self.store_change_kg -= phase.rod_kg
            self.stored_kg -= phase.rod_kg
        self.phase = phase.kind

    def reseed(self, seed: int) -> None:
        """See Drilling: nothing of it is random."""

    def summary(self) -> dict[str, Any]:
        """See Drilling."""
        return {"hole_depth_m": self.loads.depth}

    def progress(self) -> dict[str, Any]:
        """See Drilling."""
        if self._task is None:
            return {}
        done = {} if self._task.repeat else {"done": self.phase == "done"}
        return done | {"phase": self.phase}


def drill_known(drill: Drilling, known: Any) -> Any:
    """What the drill's controls know of it now, into `known` (a DrillKnown, or a row that has its
    fields).
    """
    ordered, loads = drill.ordered, drill.loads
    known["ordered_thrust"], known["ordered_torque"] = ordered.thrust, -ordered.torque
    known["rods_in_hole"], known["rods_in_mast"] = loads.string_mass, loads.mast_mass
    known["rods_mast_height"], known["rods_stored"] = loads.mast_height, drill.stored_kg
    return known


class DrillReporter:
    """Writes what a drill does to the board, and what its controls know to the row, whenever either
    changes.
    """

    def __init__(self, drill: Drilling) -> None:
        self._drill = drill
        self._last: tuple[float, ...] = ()

    def report(self, boards: NDArray[Any], row: Any) -> None:
        """Write to an array of one Board and to the running row."""
        drill, on_board = self._drill, boards["drill"]
        ordered = drill.ordered.thrust, drill.ordered.torque
        now = (*drill.loads.numbers(), *ordered, drill.stored_kg)
        if now == self._last:
            return
        self._last = now
        for name, value in vars(drill.loads).items():
            on_board[name] = value
        drill_known(drill, row)


def drilling_of(task: object, seed: int, numbers: Machine) -> Drilling:
    """The drill's program of a scenario's task; `numbers`: the true machine's."""
    if isinstance(task, DrillHole):
        from testbed.world.drilling.cycle import DrillCycle

        return DrillCycle(task, seed, numbers)
    return DrillProgram(task if isinstance(task, Drill) else None)


FADE_S, RESUME_S = 0.05, 0.5
"""Times in which feed, pull and torque vanish and come back: a pressure-relieved feed cylinder
(E).
"""


class DrillHold:
    """How much of the drill's loads is there, and for how long its programme has stood still."""

    def __init__(self) -> None:
        self._share = 1.0
        self._waited_s = 0.0

    def update(self, drill: Drilling, t: float, dt: float, hold: bool) -> list[dict[str, Any]]:
        """Let the drill set its loads for the tick from t to t + dt (s), unless it is to wait;
        returns its news.
        """
        change = -dt / FADE_S if hold else dt / RESUME_S
        self._share = min(max(self._share + change, 0.0), 1.0)
        news: list[dict[str, Any]] = []
        if self._share <= 0.0:
            self._waited_s += dt
        else:
            news = drill.update(t - self._waited_s, dt)
        if self._share < 1.0:
            drill.loads.scale_order(self._share)
            drill.ordered.thrust *= self._share
            drill.ordered.torque *= self._share
        return news
