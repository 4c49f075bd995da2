"""Standing: hold the start posture, raise it in steps, lift a foot or haul a rope when the scenario
says so.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from testbed.control.gait import BelievedStart, Command, Measured
from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.machine.names import AXES, LEGS, RADIAL, ROTATION, SIDES, VERTICAL
from testbed.machine.scale import ROBOCLIMBER, Scale
from testbed.scenario.events import Event, LiftFoot, SetRope, share_of_tick
from testbed.scenario.tasks import Raise, Sway

REACHED_M = 0.002
"""So near to where they are told to be the pistons of a machine of four tonnes are there (E)."""
LIFT_EDGE_S = 0.4
"""Time in which an ordered lift of a foot rises and falls (E)."""

REACH_EDGE_S = 1.0
"""Time in which a lifted leg sets out and comes back (E)."""


class Hold:
    """Holds the posture `start` (12), m or rad, raises it in steps where the task says so, lifts
    feet and hauls ropes as the events order. A Gait.
    """

    def __init__(
        self,
        start: Array,
        task: object,
        events: tuple[Event, ...],
        limits: Array,
        scale: Scale = ROBOCLIMBER,
    ) -> None:
        """`limits` (12, 2): the joints' ranges, m or rad."""
        self._held = Command(start)
        self._limits = limits
        self._near_m = REACHED_M * scale.length
        self._lowest_m = float(start[list(VERTICAL)].min())
        """Shortest extension that was measured last."""
        self._raise = task if isinstance(task, Raise) else None
        self._events = tuple(event for event in events if isinstance(event, LiftFoot | SetRope))

    def command(self, t: float, dt: float, measured: Measured) -> Command:
        """See Gait."""
        if self._raise is None and not self._events:
            return self._held
        joints = self._held.joints.copy()
        stance = np.ones(len(LEGS), dtype=bool)
        rope_rates = np.zeros(len(SIDES))
        if self._raise is not None:
            self._lowest_m = float(measured.position[list(VERTICAL)].min())
            joints[list(VERTICAL)] = self._raised(self._raise, t + dt)
        for event in self._events:
            if isinstance(event, LiftFoot):
                leg = LEGS.index(event.leg)
                joints[VERTICAL[leg]] -= event.height_m * window(
                    t + dt, event.at_s, event.duration_s, LIFT_EDGE_S
                )
                joints += self._reached(event, leg, t + dt)
                if event.at_s <= t <= event.at_s + event.duration_s:
                    stance[leg] = False
            else:
                share = share_of_tick(t, dt, event.at_s, event.duration_s)
                rope_rates[SIDES.index(event.rope)] += share * event.pay_out_m / event.duration_s
        return replace(self._held, joints=joints, rope_rates_m_s=rope_rates, stance=stance)

    def _reached(self, event: LiftFoot, leg: int, t: float) -> Array:
        """(12) how far from where it stood, less its lift, the joints of a lifted leg are at time
        t, m or rad: once to either end of its radial and rotation ranges and three times as high
        again as it is lifted, each as far as its range allows.
        """
        out = np.zeros(len(AXES))
        edge_s = min(LIFT_EDGE_S, event.duration_s / 3.0)
        begins, lasts = event.at_s + edge_s, event.duration_s - 2.0 * edge_s
        if event.reach_share == 0.0 or not 0.0 < t - begins < lasts:
            return out
        eased = event.reach_share * window(t, begins, lasts, REACH_EDGE_S)
        angle = 2.0 * np.pi * (t - begins) / lasts
        held, vertical = self._held.joints, VERTICAL[leg]
        way = np.sin(angle)
        for joint in (RADIAL[leg], ROTATION[leg]):
            to_end = self._limits[joint, int(way > 0.0)] - held[joint]
            out[joint] = eased * abs(way) * to_end
        to_end = self._limits[vertical, 0] - (held[vertical] - event.height_m)
        out[vertical] = (
            eased * np.sin(1.5 * angle) ** 2 * float(np.clip(to_end, -event.height_m, 0))
        )
        return out

    def progress(self, t: float) -> dict[str, Any]:
        """How far the body is raised, as the encoders have it."""
        if self._raise is None:
            return {}
        wanted_m, told_m = self._raise.to_m, float(self._raised(self._raise, t).min())
        done = told_m >= wanted_m and self._lowest_m >= wanted_m - self._near_m
        return {"done": done, "raised_to_m": self._lowest_m, "raised_wanted_m": wanted_m}

    def _raised(self, task: Raise, t: float) -> Array:
        """(4) extension of the vertical joints at time t, m: ramps of `speed_m_s`, a new one every
        `every_s`. One that is longer than wanted at the start stays so.
        """
        start = self._held.joints[list(VERTICAL)]
        if t <= task.start_s:
            return start
        steps, since = divmod(t - task.start_s, task.every_s)
        height = task.step_m * steps + min(task.step_m, since * task.speed_m_s)
        return np.asarray(np.minimum(start + height, np.maximum(task.to_m, start)))


def window(t: float, start: float, duration: float, edge: float) -> float:
    """0 outside [start, start + duration], 1 inside, with cosine edges of `edge` s (or a third of
    the duration).
    """
    edge = min(edge, duration / 3)
    inside = min(t - start, start + duration - t) / edge
    return float(0.5 - 0.5 * np.cos(np.pi * min(max(inside, 0.0), 1.0)))


RISE_S = 3.0
"""The amplitudes grow from nothing within this time (E)."""
USUAL_M = (0.06, 0.05, 0.05)
"""Amplitudes that nobody asked for, of a machine of ROBOCLIMBER's size (E)."""
TRIED_S, TRIED_EVERY_S = 60.0, 0.25
"""Set points are looked at beforehand for so long: by then all three axes have met (E)."""


class SwayGait:
    """Set points of a body that moves to and fro over standing feet: sinusoids along its
    three axes.

    All feet stay where they are, so every cylinder moves in both directions under load: what
    a residual needs to show friction, leakage and drift apart. The ropes are hauled and paid
    out with the body.

    A Gait.
    """

    def __init__(self, task: Sway, start: BelievedStart) -> None:
        """Raises InputError where a cylinder would be asked beyond its range."""
        self.task = task
        usual = start.robot.machine.scale.length * np.array(USUAL_M)
        self._amplitude_m = usual if task.amplitude_m is None else np.array(task.amplitude_m)
        self._legs = start.legs
        self._feet = self._legs.feet(start.joints)
        self._nought = start.joints - self._legs.joints(self._feet)
        self._ropes = start.rope_directions_in_body
        self._refuse_beyond(start.model.limits)

    def _refuse_beyond(self, limits: Array) -> None:
        """Refuse a way that asks a joint beyond its range, `limits` (12, 2), m or rad."""
        until = self.task.start_s + min(self.task.for_s or TRIED_S, TRIED_S)
        ways = [self.body_m(t) for t in np.arange(self.task.start_s, until, TRIED_EVERY_S)]

        def furthest(share: float) -> Array:
            """(12) how far each joint would be asked beyond its range at most."""
            joints = np.array([self._joints(share * way) for way in ways])
            return np.asarray(np.maximum(limits[:, 0] - joints, joints - limits[:, 1]).max(axis=0))

        beyond = furthest(1.0)
        if beyond.max() <= 0.0:
            return
        fits = next((k / 10 for k in range(9, 0, -1) if furthest(k / 10).max() <= 0.0), 0.0)
        raise InputError(
            f"asks {AXES[int(np.argmax(beyond))]} beyond its range",
            field="task.amplitude_m",
            value=[float(f"{way:.3g}") for way in self._amplitude_m],
            allowed=f"{fits:g} times that, or another stance",
        )

    def _joints(self, way_m: Array) -> Array:
        """Joints (12) with the body that far from where it started, (3) m."""
        return np.asarray(self._legs.joints(self._feet - way_m) + self._nought)

    def body_m(self, t: float) -> Array:
        """Where the body is meant to be at time t, from where it started (3), m, body axes."""
        since = t - self.task.start_s
        if since <= 0.0:
            return np.zeros(3)
        rise = 0.5 - 0.5 * np.cos(np.pi * min(since / RISE_S, 1.0))
        angle = 2.0 * np.pi * since / np.array(self.task.period_s)
        return np.asarray(rise * self._amplitude_m * np.sin(angle))

    def command(self, t: float, dt: float, measured: Measured) -> Command:
        """See Gait."""
        del measured
        goal = self.body_m(t + dt)
        return Command(
            joints=self._joints(goal), rope_rates_m_s=-self._ropes @ (goal - self.body_m(t)) / dt
        )
