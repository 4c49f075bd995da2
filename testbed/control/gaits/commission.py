"""What a crew lets the robot do to know itself: each foot lifted and moved in the air, then the
body raised, lowered and leant.

On level ground, without ropes. A foot in the air carries nothing, so its three cylinders show their
zeros and their friction at several speeds as it goes up and down, out and in, to and fro; a body
that moves up and down on four feet shows its weight, its ways to the sides show where that is. On
its ropes the robot keeps its feet on the ground: it pulls and slackens one rope, then the other,
then both, and moves at each pull up, down and to the sides, so that friction shows itself apart
from the ropes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from testbed.control.gait import BelievedStart, Command, Measured
from testbed.formats.arrays import Array
from testbed.machine.names import LEGS
from testbed.machine.scale import ROBOCLIMBER, Scale
from testbed.scenario.tasks import Commission

SHIFT_M, SHIFT_S = 0.10, 4.0
"""How far the body goes away from the foot that is to be lifted, forward and to the side, and in
what time: its weight comes within the other three feet, and no radial cylinder to its stop.
"""
LIFT_M, SPEED_M_S = 0.04, 0.02
"""A foot is lifted so far before it moves, at this speed."""
HEIGHT_M, LEAN_M, AWAY_M = 0.10, 0.05, 0.12
"""Ways of the body: up, one pair of feet against the other, to the sides."""
BOB_M, AWAY_S = 0.03, 4.0
"""At the sides it goes up and down so far; the time for a way to the side."""
FOOT_SPEEDS_M_S, BODY_SPEEDS_M_S = (0.006, 0.02, 0.06), (0.02,)
"""Of a foot in the air and of the body, each up and down."""
REACH_M, REACH_SPEEDS_M_S = 0.10, (0.02, 0.06)
"""In and out of a foot in the air, whose cylinder is far out then, and its speeds."""
SWING_M, SWING_SPEEDS_M_S = 0.10, (0.04, 0.10)
"""To and fro of a foot in the air, across its leg, and its speeds."""
REST_S = 0.5
PULLS_M = (
    (0.0, 0.0),
    (0.012, 0.0),
    (0.0, 0.012),
    (0.012, 0.012),
    (-0.01, 0.0),
    (0.0, -0.01),
    (-0.01, -0.01),
)
"""Rope taken in, left and right, at which the body moves; a metre is worth some 300 kN of a rope of
30 m.
"""
PULL_S, MOVE_M = 2.0, 0.03
"""The time for a change of pull; the body's ways at each."""


@dataclass(frozen=True)
class KeyPose:
    """Where body and feet are to be at a time; between two keys they go steadily. `stance`: which
    feet carry on the way there.
    """

    t: float
    body_m: tuple[float, float, float]
    lift_m: tuple[float, float, float, float]
    stance: tuple[bool, bool, bool, bool]
    swing_m: tuple[float, float] = (0.0, 0.0)
    """Of the foot in the air, out along its leg and across it (to the leg's left)."""
    pull_m: tuple[float, float] = (0.0, 0.0)
    """Rope taken in beyond what the body's way asks for, left and right."""

    def longer(self, factor: float) -> KeyPose:
        """The same with ways that are longer by a factor."""
        x, y, z = (factor * way for way in self.body_m)
        fl, fr, rl, rr = (factor * way for way in self.lift_m)
        out, across = (factor * way for way in self.swing_m)
        return replace(self, body_m=(x, y, z), lift_m=(fl, fr, rl, rr), swing_m=(out, across))


class CommissionGait:
    """See the module's docstring. A Gait."""

    def __init__(self, task: Commission, start: BelievedStart) -> None:
        self._legs = start.legs
        self._feet = self._legs.feet(start.joints)
        self._nought = start.joints - self._legs.joints(self._feet)
        self._ropes = start.rope_directions_in_body
        on_ropes = bool(np.any(start.rope_tension_n > 0.0))
        self._keys = program(task, start.robot.machine.scale, on_ropes)
        self._times = np.array([key.t for key in self._keys])
        self._places = np.array(
            [(*key.body_m, *key.lift_m, *key.swing_m, *key.pull_m) for key in self._keys]
        )
        outward = self._feet[:, :2] - start.legs.hips_m[:, :2]
        self._outward = outward / np.linalg.norm(outward, axis=1)[:, None]

    def command(self, t: float, dt: float, measured: Measured) -> Command:
        """See Gait."""
        del measured
        before, now = self._at(t), self._at(t + dt)
        feet = self._feet - now[:3]
        feet[:, 2] += now[3:7]
        goal = min(int(np.searchsorted(self._times, t + dt)), len(self._keys) - 1)
        stance = np.array(self._keys[goal].stance)
        in_air = ~stance
        out, across = now[7:9]
        along_x, along_y = self._outward[in_air].T
        feet[in_air, 0] += out * along_x - across * along_y
        feet[in_air, 1] += out * along_y + across * along_x
        rope_ways = -self._ropes @ (now[:3] - before[:3]) - (now[9:] - before[9:])
        return Command(
            joints=self._legs.joints(feet) + self._nought,
            rope_rates_m_s=rope_ways / dt,
            stance=stance,
        )

    def _at(self, t: float) -> Array:
        """Body (3), feet (4), swing (2) and ropes (2) at a time, as the keys have them."""
        return np.array([np.interp(t, self._times, way) for way in self._places.T])


def duration_s(task: Commission, scale: Scale = ROBOCLIMBER, on_ropes: bool = False) -> float:
    """How long the whole programme takes."""
    return program(task, scale, on_ropes)[-1].t + REST_S


def program(task: Commission, scale: Scale = ROBOCLIMBER, on_ropes: bool = False) -> list[KeyPose]:
    """The programme as keys, in order; its ways are as long as the machine is large, its times
    stay.
    """
    keys = _pulling(task) if on_ropes else _lifting(task)
    if scale.length == 1.0:
        return keys
    return [key.longer(scale.length) for key in keys]


def _pulling(task: Commission) -> list[KeyPose]:
    """On four feet and two ropes."""
    on, none = (True,) * 4, (0.0,) * 4
    keys = [KeyPose(task.start_s, (0.0, 0.0, 0.0), none, on)]
    ways = (
        (0, 0, 1),
        (0, 0, -1),
        (0, 0, 1),
        (0, 0, 0),
        (1, 0, 0),
        (-1, 0, 0),
        (0, 1, 0),
        (0, -1, 0),
        (0, 0, 0),
    )
    for pull in (*PULLS_M, (0.0, 0.0)):
        keys.append(KeyPose(keys[-1].t + PULL_S, (0.0, 0.0, 0.0), none, on, pull_m=pull))
        for way in ways:
            goal = MOVE_M * np.array(way)
            seconds = float(np.linalg.norm(goal - keys[-1].body_m)) / SPEED_M_S
            x, y, z = goal.tolist()
            keys.append(
                KeyPose(keys[-1].t + max(seconds, REST_S), (x, y, z), none, on, pull_m=pull)
            )
    return keys


def _lifting(task: Commission) -> list[KeyPose]:
    """Without ropes, on level ground."""
    keys = [KeyPose(task.start_s, (0.0, 0.0, 0.0), (0.0,) * 4, (True,) * 4)]

    def go(
        seconds: float,
        body: Array,
        lift: Array,
        leg: int | None = None,
        swing: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        x, y, z = body.tolist()
        fl, fr, rl, rr = lift.tolist()
        stance = (leg != 0, leg != 1, leg != 2, leg != 3)
        keys.append(KeyPose(keys[-1].t + seconds, (x, y, z), (fl, fr, rl, rr), stance, swing))

    nought, none = np.zeros(3), np.zeros(4)
    for leg in range(len(LEGS)):
        away = np.array([-SHIFT_M if leg < 2 else SHIFT_M, SHIFT_M if leg % 2 else -SHIFT_M, 0.0])
        go(SHIFT_S, away, none)
        go(REST_S, away, none)
        only = np.eye(len(LEGS))[leg]
        height = 0.0
        for goal, speed in ((LIFT_M, SPEED_M_S), *_strokes()):
            go(abs(goal - height) / speed, away, goal * only, leg)
            height = goal
        for seconds, swing in _swings():
            go(seconds, away, LIFT_M * only, leg, swing)
        go(LIFT_M / SPEED_M_S, away, none, leg)
        go(REST_S, away, none)
        go(SHIFT_S, nought, none)
    for speed in BODY_SPEEDS_M_S:
        for height in (HEIGHT_M, 0.0, -HEIGHT_M, 0.0):
            go(HEIGHT_M / speed, np.array([0.0, 0.0, height]), none)
    for pair in (np.array([1.0, 1.0, -1.0, -1.0]), np.array([1.0, -1.0, 1.0, -1.0])):
        for side in (1.0, -1.0, 0.0):
            go(2.0 * LEAN_M / SPEED_M_S, nought, side * LEAN_M * pair)
    for x, y in ((1, 0), (0, 0), (-1, 0), (0, 0), (0, 1), (0, 0), (0, -1), (0, 0)):
        place = AWAY_M * np.array([x, y, 0.0])
        go(AWAY_S, place, none)
        for bob in (BOB_M, -BOB_M, 0.0):
            go(2.0, place + np.array([0.0, 0.0, bob]), none)
    return keys


def _strokes() -> list[tuple[float, float]]:
    """(height m, speed m/s) of a foot's ways in the air, to and fro at every speed."""
    return [
        (height, speed)
        for speed in FOOT_SPEEDS_M_S
        for height in (LIFT_M + min(0.12, 4.0 * speed), LIFT_M)
    ]


def _swings() -> list[tuple[float, tuple[float, float]]]:
    """(time s, (out m, across m)) of a foot's ways in the air, to and fro at every speed."""
    ways = []
    for speed in REACH_SPEEDS_M_S:
        ways += [(REACH_M / speed, (-REACH_M, 0.0)), (REACH_M / speed, (0.0, 0.0))]
    for speed in SWING_SPEEDS_M_S:
        for goal, distance in ((SWING_M, 1.0), (-SWING_M, 2.0), (0.0, 1.0)):
            ways.append((distance * SWING_M / speed, (0.0, goal)))
    return ways
