"""Tasks one after the other: each begins where the last one ended, and stops and turns of a walk in
between.

The time of a part is counted from its beginning. A walk stops between two of its motions, with all
feet on the ground; to turn it is brought to its end, and a walk in the new direction makes the
steps that are left.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from testbed.control.gait import BelievedStart, Command, Gait, Layered, Measured
from testbed.control.gaits.crawl.gait import CrawlGait
from testbed.machine.names import SIDES
from testbed.scenario.drilling import DrillHole
from testbed.scenario.events import Event, Stop, Turn
from testbed.scenario.tasks import Crawl, Drill, Stand, Sway

Make = Callable[[Any, BelievedStart], Gait]


class Chain:
    """A Gait of several tasks. `make(task, start)` gives the gait of one of them.

    `drill_done`: whether the drill has done its task; who steps the drill says so. `drill_began_s`:
    when it may begin.
    """

    def __init__(
        self, tasks: Sequence[Any], events: Sequence[Event], start: BelievedStart, make: Make
    ) -> None:
        """Raises InputError where the first part cannot be done, before anything moves."""
        self._parts = [part for task in tasks for part in legs_of_walk(task)]
        self._start, self._make = start, make
        self._stops = [event for event in events if isinstance(event, Stop)]
        turns = (event for event in events if isinstance(event, Turn))
        self._turns = sorted(turns, key=lambda turn: turn.at_s)
        self._moved_m = np.zeros(3)
        self._index, self._began_s = 0, 0.0
        self._gait = make(self._parts[0], start)
        self._last = Command(start.joints)
        self._rest: Command | None = None
        self.drill_done = False
        self.drill_began_s = 0.0 if isinstance(self._parts[0], Drill | DrillHole) else np.inf
        if not any(isinstance(part, Drill | DrillHole) for part in self._parts):
            self.drill_began_s = 0.0

    def command(self, t: float, dt: float, measured: Measured) -> Command:
        """See Gait."""
        self._turn(t)
        if self._index + 1 < len(self._parts) and self._is_over(t - self._began_s):
            self._next(t, measured)
        walk = walk_in(self._gait)
        if walk is not None and walk.between and self._stopped(t):
            if self._rest is None:
                self._rest = replace(self._last, rope_rates_m_s=np.zeros(len(SIDES)))
            return self._rest
        self._rest = None
        self._last = self._gait.command(t - self._began_s, dt, measured)
        return self._last

    def progress(self, t: float) -> dict[str, Any]:
        """Which part is at work, and how far it is."""
        own_progress = getattr(walk_in(self._gait) or self._gait, "progress", None)
        part = {} if own_progress is None else dict(own_progress(t - self._began_s))
        last = self._index + 1 == len(self._parts)
        done = last and self._is_over(t - self._began_s, bool(part.get("done", True)))
        count = {"part": self._parts[self._index].kind, "parts_done": self._index + int(done)}
        return part | count | {"parts_wanted": len(self._parts), "done": done}

    def _is_over(self, since_s: float, default: bool = False) -> bool:
        """Whether the part at work has done what it is there for."""
        part = self._parts[self._index]
        if isinstance(part, Stand | Sway):
            return since_s >= (part.for_s or 0.0)
        if isinstance(part, Drill | DrillHole):
            return self.drill_done
        own_progress = getattr(self._gait, "progress", None)
        return default if own_progress is None else bool(own_progress(since_s).get("done", False))

    def _next(self, t: float, measured: Measured) -> None:
        """Begin the next part where the machine stands now."""
        walk = walk_in(self._gait)
        if walk is not None:
            self._moved_m = self._moved_m + walk.moved_m
        anchors = self._start.anchors_in_body_m - self._moved_m
        ways = anchors - self._start.model.rope_attachments_m
        lengths = np.linalg.norm(ways, axis=1, keepdims=True)
        here = replace(
            self._start,
            joints=self._last.joints,
            load_n=np.maximum(measured.load, 0.0),
            rope_tension_n=measured.rope_tension * bool(self._start.rope_tension_n.any()),
            rope_directions_in_body=ways / np.where(lengths > 0.0, lengths, 1.0),
            anchors_in_body_m=anchors,
        )
        self._index, self._began_s = self._index + 1, t
        part = self._parts[self._index]
        self._gait = self._make(part, here)
        if isinstance(part, Drill | DrillHole):
            self.drill_began_s = t

    def _stopped(self, t: float) -> bool:
        return any(stop.at_s <= t < stop.at_s + stop.duration_s for stop in self._stops)

    def _turn(self, t: float) -> None:
        """Bring the walk at work to its end where a turn is due, and put one in the new direction
        behind it.
        """
        walk = walk_in(self._gait)
        if walk is None or not self._turns or t < self._turns[0].at_s:
            return
        turn = self._turns.pop(0)
        left = walk.end_walk()
        if left > 0:
            changes = {"heading_deg": turn.heading_deg, "steps": left, "start_s": 0.0}
            self._parts.insert(self._index + 1, walk.task.model_copy(update=changes))


def legs_of_walk(task: Any) -> list[Any]:
    """A walk over waypoints as walks straight from one to the next; any other task as it is.

    The body of a walk of n swings goes n / 4 strides less a quarter (wave: an eighth): the last
    swings of a cycle have their feet half a stride ahead. Strides are as long as the way needs, at
    most as long as asked for.
    """
    if not isinstance(task, Crawl) or not task.waypoints_m:
        return [task]
    short = 0.125 if task.gait == "wave" else 0.25
    legs, place, start_s = [], np.zeros(2), task.start_s
    for waypoint in np.array(task.waypoints_m):
        ahead = waypoint - place
        way = float(np.hypot(*ahead))
        cycles = max(int(np.ceil(way / task.step_length_m + short - 1e-9)), 1)
        changes = {
            "waypoints_m": (),
            "heading_deg": float(np.degrees(np.arctan2(ahead[1], ahead[0]))),
            "steps": 4 * cycles,
            "step_length_m": way / (cycles - short),
            "start_s": start_s,
        }
        legs.append(task.model_copy(update=changes))
        place, start_s = waypoint, 0.0
    return legs


def walk_in(gait: Gait) -> CrawlGait | None:
    """The walk that a gait is, under the layers over it; None for any other."""
    while isinstance(gait, Layered):
        gait = gait.gait
    return gait if isinstance(gait, CrawlGait) else None


def chain_in(gait: Gait) -> Chain | None:
    """The chain that a gait is, under the layers over it; None for any other."""
    while isinstance(gait, Layered):
        gait = gait.gait
    return gait if isinstance(gait, Chain) else None
