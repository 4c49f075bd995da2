"""Discontinuous crawl up the slope: sway, swing one leg, seek the ground by the force estimate, move on.

Feet and body are reckoned in a path frame: parallel to the slope, where the body frame stood at the start. A swing has
three parts of its period: the body sways until the centre of pressure lies inside the triangle of the three standing
feet (and has moved a quarter of a step forward), the leg swings, the foot is lowered until its estimated load says
that it stands. The ropes are hauled with the body and keep their tension.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.control.references import Command, Measured
from testbed.parameters.names import LEGS
from testbed.parameters.provenance import roboclimber
from testbed.parameters.scenario_tasks import Crawl
from testbed.robot.kinematics import LegKinematics

Array = NDArray[np.float64]

SWAY_END, SWING_END = 0.45, 0.8
"""Shares of a period at which sway and swing end; the rest lowers the foot."""
SWAY_SHARE = 0.5
"""How far from the middle of four feet towards the middle of the three standing ones."""
LEVEL_GAIN_1_S = 0.3
"""Rate at which standing legs take out a tilt of the body."""
TENSION_GAIN_M_S_N = 2.0e-6
"""Rope pay-out speed per newton above the tension to be kept."""
TOUCH_N = 1500.0
"""Estimated load at which a lowered foot is said to stand."""
LOWER_M_S = 0.04
DEEPEST_M = 0.12


class CrawlProgram:
    """Set points of a crawl. `pressure_offset_m` (2): centre of pressure in the body frame at the start, m."""

    def __init__(
        self, task: Crawl, start: Array, rope_tension_n: Array, rope_directions_in_path: Array, pressure_offset_m: Array
    ) -> None:
        self.task = task
        self._legs = LegKinematics.from_parameters(roboclimber())
        self._feet = self._legs.feet(start)
        self._body = np.zeros(3)
        self._tension = rope_tension_n.copy()
        self._ropes = rope_directions_in_path
        self._offset = pressure_offset_m
        self._middle = self._feet[:, :2].mean(axis=0)
        self._attitude: Array | None = None
        self._step = -1
        self._sway_from = self._body.copy()
        self._swing_from = self._feet[0].copy()
        self._down = False
        self._now = Command(reference=start.copy())
        self.steps_done = 0

    def update(self, t: float, dt: float, measured: Measured) -> Command:
        """See Program."""
        task, command = self.task, self._now
        if self._attitude is None:
            self._attitude = measured.attitude_rad.copy()
        since = t - task.start_s
        before = self._body.copy()
        command.carrying[:] = True
        if since >= 0.0:
            step = int(since // task.period_s)
            if step < task.steps:
                self._walk(step, (since % task.period_s) / task.period_s, dt, measured, command)
            else:
                self._finish(since - task.steps * task.period_s)
        self._level(dt, measured, command)
        wanted = self._legs.joints(self._feet - self._body)
        command.rate[:] = (wanted - command.reference) / dt
        command.rate[np.abs(command.rate) < 1e-7] = 0.0
        speed = (self._body - before) / dt
        slack = np.minimum(TENSION_GAIN_M_S_N * (measured.rope_tension_n - self._tension), 0.02)
        command.rope_rate_m_s[:] = -self._ropes @ speed + np.maximum(slack, -0.02)
        return command

    def _walk(self, step: int, part: float, dt: float, measured: Measured, command: Command) -> None:
        leg = LEGS.index(self.task.order[step % 4])
        if step != self._step:
            self._land(measured)
            self._step = step
            self._sway_from = self._body.copy()
            self._swing_from = self._feet[leg].copy()
            self._down = False
        if part < SWAY_END:
            share = smooth(part / SWAY_END)
            self._body = (1 - share) * self._sway_from + share * self._sway_goal(leg)
        elif part < SWING_END:
            share = (part - SWAY_END) / (SWING_END - SWAY_END)
            foot = self._swing_from.copy()
            foot[0] += self.task.step_length_m * smooth(min(1.0, max(0.0, (share - 0.2) / 0.6)))
            foot[2] += self.task.swing_height_m * np.sin(np.pi * min(max(share, 0.0), 1.0)) ** 2 + 0.01
            self._feet[leg] = foot
            command.carrying[leg] = False
        elif not self._down:
            command.carrying[leg] = False
            floor = self._swing_from[2] - DEEPEST_M
            self._feet[leg, 2] = max(self._feet[leg, 2] - LOWER_M_S * dt, floor)
            self._down = bool(measured.load_n[leg] > TOUCH_N) or bool(self._feet[leg, 2] == floor)
            if self._down:
                self.steps_done += 1

    def _land(self, measured: Measured) -> None:
        """Nothing to take over: a landed foot stays where it was stopped."""
        del measured
        self._middle = self._feet[:, :2].mean(axis=0)

    def _sway_goal(self, leg: int) -> Array:
        standing = [k for k in range(4) if k != leg]
        triangle = self._feet[standing, :2].mean(axis=0)
        point = (1 - SWAY_SHARE) * self._middle + SWAY_SHARE * triangle
        return np.array([point[0] - self._offset[0], point[1] - self._offset[1], self._body[2]])

    def _finish(self, since: float) -> None:
        """After the last swing: back over the middle of the feet."""
        if self._step != self.task.steps:
            self._step = self.task.steps
            self._sway_from = self._body.copy()
            self._middle = self._feet[:, :2].mean(axis=0)
        share = smooth(min(1.0, since / (SWAY_END * self.task.period_s)))
        goal = np.array([*(self._middle - self._offset), self._body[2]])
        self._body = (1 - share) * self._sway_from + share * goal

    def _level(self, dt: float, measured: Measured, command: Command) -> None:
        """Standing legs turn the body back to its start attitude, slowly."""
        assert self._attitude is not None
        roll, pitch, _ = measured.attitude_rad - self._attitude
        arm = self._feet[:, :2] - self._body[:2]
        push = LEVEL_GAIN_1_S * dt * (roll * arm[:, 1] - pitch * arm[:, 0])
        self._feet[command.carrying, 2] += push[command.carrying]


def smooth(share: float) -> float:
    """0 to 1 with rest at both ends (cosine)."""
    return float(0.5 - 0.5 * np.cos(np.pi * share))
