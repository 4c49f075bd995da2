"""Standing: hold the start posture, raise it in steps, lift a foot or haul a rope when the scenario
says so.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from testbed.control.command import Command
from testbed.control.measured import Measured
from testbed.formats.arrays import Array
from testbed.machine.names import LEGS, SIDES, VERTICAL
from testbed.machine.scale import ROBOCLIMBER, Scale
from testbed.scenario.events import Event, LiftFoot, SetRope
from testbed.scenario.tasks import Raise

REACHED_M = 0.002
"""So near to where they are told to be the pistons of a machine of four tonnes are there (E)."""
LIFT_EDGE_S = 0.4
"""Time in which an ordered lift of a foot rises and falls (E)."""


class Hold:
    """Holds `start` (12); see the module's docstring. A Gait."""

    def __init__(
        self, start: Array, task: object, events: tuple[Event, ...], scale: Scale = ROBOCLIMBER
    ) -> None:
        self._held = Command(start)
        self._near_m = REACHED_M * scale.length
        self._lowest_m = float(start[list(VERTICAL)].min())
        """Shortest extension that was measured last."""
        self._raise = task if isinstance(task, Raise) else None
        self._events = tuple(event for event in events if isinstance(event, LiftFoot | SetRope))

    def command(self, t: float, dt: float, measured: Measured) -> Command:
        """See Gait."""
        self._lowest_m = float(measured.position[list(VERTICAL)].min())
        if self._raise is None and not self._events:
            return self._held
        joints = self._held.joints.copy()
        stance = np.ones(len(LEGS), dtype=bool)
        rope_rates = np.zeros(len(SIDES))
        if self._raise is not None:
            joints[list(VERTICAL)] = self._raised(self._raise, t + dt)
        for event in self._events:
            if isinstance(event, LiftFoot):
                leg = LEGS.index(event.leg)
                joints[VERTICAL[leg]] -= event.height_m * window(
                    t + dt, event.at_s, event.duration_s, LIFT_EDGE_S
                )
                if event.at_s <= t <= event.at_s + event.duration_s:
                    stance[leg] = False
            elif event.at_s <= t < event.at_s + event.duration_s:
                rope_rates[SIDES.index(event.rope)] += event.pay_out_m / event.duration_s
        return replace(self._held, joints=joints, rope_rates_m_s=rope_rates, stance=stance)

    def progress(self, t: float) -> dict[str, Any]:
        """How far the body is raised, as the encoders have it."""
        if self._raise is None:
            return {}
        wanted_m, told_m = self._raise.to_m, float(self._raised(self._raise, t).min())
        done = told_m >= wanted_m and self._lowest_m >= wanted_m - self._near_m
        return {"done": done, "raised_to_m": self._lowest_m, "raised_wanted_m": wanted_m}

    def _raised(self, task: Raise, t: float) -> Array:
        """(4) extension of the vertical joints at time t, m: ramps of `speed_m_s`, a new one every
        `every_s`.
        """
        start = self._held.joints[list(VERTICAL)]
        if t <= task.start_s:
            return start
        steps, since = divmod(t - task.start_s, task.every_s)
        height = task.step_m * steps + min(task.step_m, since * task.speed_m_s)
        return np.asarray(np.minimum(start + height, task.to_m))


def window(t: float, start: float, duration: float, edge: float) -> float:
    """0 outside [start, start + duration], 1 inside, with cosine edges of `edge` s (or a third of
    the duration).
    """
    edge = min(edge, duration / 3)
    inside = min(t - start, start + duration - t) / edge
    return float(0.5 - 0.5 * np.cos(np.pi * min(max(inside, 0.0), 1.0)))
