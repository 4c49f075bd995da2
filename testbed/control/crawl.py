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
MARGIN_M = 0.16
"""Distance that the centre of pressure keeps from the sides of the triangle of standing feet (E)."""
LEVEL_GAIN_1_S = 0.3
"""Rate at which standing legs take out a tilt of the body."""
TENSION_GAIN_M_S_N = 2.0e-6
"""Rope pay-out speed per newton above the tension to be kept."""
TOUCH_N = 1500.0
"""Estimated load at which a lowered foot is said to have met the ground."""
SEAT_N = 4000.0
"""Estimated load up to which a foot is pressed on after it has met the ground."""
LOWER_M_S, PRESS_M_S = 0.04, 0.004
DEEPEST_M = 0.12
TWIST = np.array([1.0, -1.0, -1.0, 1.0])
"""Heights of fl, fr, rl, rr that move load between the two diagonals and nothing else."""
TWIST_GAIN_M_S_N = 2.0e-8
"""Rate of that height per newton of difference between the diagonals."""


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
            self._middle = self._feet[:, :2].mean(axis=0)
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
        else:
            self._lower(leg, dt, measured, command)

    def _lower(self, leg: int, dt: float, measured: Measured, command: Command) -> None:
        """Lower the foot until it meets the ground, then press it on until it carries."""
        load, floor = measured.load_n[leg], self._swing_from[2] - DEEPEST_M
        if not self._down:
            command.carrying[leg] = False
            self._feet[leg, 2] = max(self._feet[leg, 2] - LOWER_M_S * dt, floor)
            self._down = bool(load > TOUCH_N) or bool(self._feet[leg, 2] == floor)
            self.steps_done += self._down
        elif load < SEAT_N:
            self._feet[leg, 2] -= PRESS_M_S * dt

    def _sway_goal(self, leg: int) -> Array:
        """Body position over the point nearest to the feet's middle that keeps MARGIN_M inside the three others."""
        corners = [self._feet[k, :2] for k in range(4) if k != leg]
        point = inside(self._middle, corners, MARGIN_M)
        return np.array([*(point - self._offset), self._body[2]])

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
        if command.carrying.all():
            push = push + TWIST * (TWIST_GAIN_M_S_N * dt * float(TWIST @ measured.load_n))
        self._feet[command.carrying, 2] += push[command.carrying]


def smooth(share: float) -> float:
    """0 to 1 with rest at both ends (cosine)."""
    return float(0.5 - 0.5 * np.cos(np.pi * share))


def inside(point: Array, corners: list[Array], margin_m: float) -> Array:
    """The point nearest to `point` (2) that lies `margin_m` inside the triangle of `corners`, by projections."""
    middle = np.mean(corners, axis=0)
    out = point.copy()
    for _ in range(8):
        for k in range(3):
            start, side = corners[k], corners[(k + 1) % 3] - corners[k]
            normal = np.array([-side[1], side[0]]) / np.hypot(*side)
            normal *= np.sign(normal @ (middle - start))
            lack = margin_m - float(normal @ (out - start))
            if lack > 0.0:
                out = out + lack * normal
    return out
