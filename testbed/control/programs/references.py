"""Set points of the twelve position loops over time: hold, raise in steps, lift a foot.

A program is asked at every control tick (100 Hz); the loops follow its set points at their own rate by the rates it
gives. It sees measurements only.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from testbed.laws.drill import KNOWN
from testbed.machine.names import AXES, LEGS, VERTICAL
from testbed.scenario.tasks import Event, LiftFoot, Raise, SetRope

Array = NDArray[np.float64]


@dataclass
class Command:
    """What control wants now. Joint set points are in rad and m, AXES order; ropes left, right."""

    reference: Array = field(default_factory=lambda: np.zeros(len(AXES)))
    rate: Array = field(default_factory=lambda: np.zeros(len(AXES)))
    rope_rate_m_s: Array = field(default_factory=lambda: np.zeros(2))
    """Rate of the ropes' unstrained lengths: negative hauls in."""
    carrying: NDArray[np.bool_] = field(default_factory=lambda: np.ones(len(LEGS), dtype=bool))
    """Which feet are meant to carry."""
    hold_drill: bool = False
    """The drill is to stop pushing, pulling and turning, and to wait."""
    still: bool = False
    """Nothing differs from the last tick's command."""

    def follow(self, given: Command) -> None:
        """Take another program's command over, to lay something on it; `still` stays as it was."""
        self.reference[:], self.rate[:] = given.reference, given.rate
        self.rope_rate_m_s[:], self.carrying[:] = given.rope_rate_m_s, given.carrying
        self.hold_drill = given.hold_drill


@dataclass(slots=True)
class Measured:
    """What control may look at: this tick's readings and estimates."""

    position: Array
    load_n: Array
    """Estimated load of each foot along its vertical joint, N (4)."""
    contact: Array
    """The detector's word for each foot, 0 or 1 (4)."""
    rope_tension_n: Array
    attitude_rad: Array
    supply_pressure_pa: float = 9.0e6
    """Gauge."""
    drill: Array = field(default_factory=lambda: np.zeros(KNOWN))
    """What the drill's own controls know (KNOWN): see laws/drill.py."""
    pressure_a_pa: Array = field(default_factory=lambda: np.zeros(len(AXES)))
    pressure_b_pa: Array = field(default_factory=lambda: np.zeros(len(AXES)))
    """Gauge (12)."""
    foot_force_in_body_n: Array | None = None
    """Ground on foot (4, 3), where a machine has sensors for it; otherwise control works it out from the pressures."""


class Program(Protocol):
    """A task as set points over time."""

    def update(self, t: float, dt: float, measured: Measured) -> Command:
        """The command for the tick from t to t + dt, s. The object may be the same one every time."""
        ...


class Hold:
    """Hold the start posture; raise it in steps if a task says so; ropes and feet follow ordered events."""

    def __init__(self, start: Array, task: object, events: tuple[Event, ...]) -> None:
        self._start = start.copy()
        self._raise = task if isinstance(task, Raise) else None
        self._events = tuple(e for e in events if isinstance(e, LiftFoot | SetRope))
        self._now = Command(reference=start.copy())
        self._given = False

    def update(self, t: float, dt: float, measured: Measured) -> Command:
        """See Program."""
        del measured
        command = self._now
        if self._raise is None and not self._events:
            command.still, self._given = self._given, True
            return command
        wanted = self._start.copy()
        command.carrying[:] = True
        command.rope_rate_m_s[:] = 0.0
        if self._raise is not None:
            wanted[list(VERTICAL)] = self._raised(t + dt)
        for event in self._events:
            if isinstance(event, LiftFoot):
                leg = LEGS.index(event.leg)
                lift = event.height_m * window(t + dt, event.at_s, event.duration_s, 0.4)
                wanted[VERTICAL[leg]] -= lift
                if event.at_s <= t <= event.at_s + event.duration_s:
                    command.carrying[leg] = False
            elif isinstance(event, SetRope) and event.at_s <= t < event.at_s + event.duration_s:
                side = ("left", "right").index(event.rope)
                command.rope_rate_m_s[side] += event.pay_out_m / event.duration_s
        command.rate[:] = (wanted - command.reference) / dt
        command.rate[np.abs(command.rate) < 1e-9] = 0.0
        return command

    def _raised(self, t: float) -> Array:
        """Extension of the vertical joints at time t, m: ramps of `speed_m_s`, a new one every `every_s`."""
        task = self._raise
        assert task is not None
        start = self._start[list(VERTICAL)]
        if t <= task.start_s:
            return np.asarray(start)
        steps, since = divmod(t - task.start_s, task.every_s)
        height = task.step_m * steps + min(task.step_m, since * task.speed_m_s)
        return np.asarray(np.minimum(start + height, task.to_m))


def window(t: float, start: float, duration: float, edge: float) -> float:
    """0 outside [start, start + duration], 1 inside, with cosine edges of `edge` s (or a third of the duration)."""
    edge = min(edge, duration / 3)
    inside = min(t - start, start + duration - t) / edge
    return float(0.5 - 0.5 * np.cos(np.pi * min(max(inside, 0.0), 1.0)))
