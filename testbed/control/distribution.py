"""From wanted foot forces to valves and ropes: the part that every force-distributing controller shares.

Twelve joints, six ways for the body to move: the other six combinations only squeeze the feet against each other
(one of them, the twist, shifts load between the diagonals; five squeeze along the ground). Encoders say nothing of
them: 0.1 mm is a kilonewton. So the position loops keep the six motions, and in the rest the measured forces rule:

    e = S (forces - wanted),  S takes off what moves the body: by least squares, weighed with what friction hides
    joint speed = gain * compliance * J^T e, plus an edge against the valve's dead band, where |J^T e| > tolerance

A displacement C e of the feet changes a self-balanced force by just -e. The dead band is found by the edge: a speed
that grows while the error stays. The ropes are hauled until their tensions are those wanted.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from testbed.control.references import Command, Measured, Program
from testbed.control.statics import FEET, NORMALS, UNKNOWNS, Balance, Statics
from testbed.control.trim import rope_rate
from testbed.parameters.names import LEGS, VERTICAL

Array = NDArray[np.float64]
VERTICAL_AXES = list(VERTICAL)
TOLERANCE: Array = np.tile([21.0, 49.0, 42.0], len(LEGS))
"""Joint force errors that are left alone, N m, N, N (E): a tenth of the joints' sliding friction."""
HIDDEN: Array = np.tile([60.0, 350.0, 150.0], len(LEGS))
"""What friction hides of the joints' forces, one standard deviation, N m, N, N (E); the vertical ones are estimated."""
GAIN_1_S = 1.8
EDGE_START: Array = np.tile([5.0e-3, 1.0e-3, 5.0e-4], len(LEGS))
EDGE_GROWTH_1_S, EDGE_LIMIT = 1.5, 6.0
"""Speed that the dead band swallows: first guess (rad/s, m/s), growth (in first guesses) while nothing comes, most."""
SPEED_LIMIT: Array = np.tile([2.5e-2, 5.0e-3, 4.0e-3], len(LEGS))
SMOOTH_S = 0.03
"""Time constant of the measured forces and tensions (E); 0.08 and more hunts."""
HANGING_SHARE, SEEK_M_S = 0.25, 2.0e-3
"""A foot that has less than this share of its load seeks the ground at this speed: in the air no force tells it (E)."""
PULL_SLEW_N_S = 4000.0
"""Fastest change of a wanted pull (E)."""


@dataclass(frozen=True)
class Plan:
    """Wanted forces (14,) in the order of Statics' unknowns, N; feasible: whether the controller found any."""

    forces: Array
    feasible: bool = True
    load: Array | None = None
    """(6,) the load it balances, where a controller believes in another one than it was given."""


class Sharing(Protocol):
    """A way to share the load out; one file each."""

    name: str

    def plan(self, now: Balance) -> Plan:
        """The forces to be had, from the balance now."""
        ...


class Distribution:
    """A program that carries the inner one's set points and shares the load out on top of it."""

    def __init__(self, inner: Program, statics: Statics, sharing: Sharing) -> None:
        self.inner, self.sharing = inner, sharing
        self.plan: Plan | None = None
        """The last plan."""
        self.balance: Balance | None = None
        """What it was made for."""
        self.solve_s: list[float] = []
        """Processor time of each plan, s."""
        self._statics = statics
        self._now = Command()
        self._smooth: Array | None = None
        self._pull = np.zeros(2)
        self._edge, self._side = np.ones(FEET), np.zeros(FEET)
        self._inner = self._jacobian = self._whole = self._balanced = np.empty(0)

    def update(self, t: float, dt: float, measured: Measured) -> Command:
        """See Program."""
        from time import thread_time

        command, out = self.inner.update(t, dt, measured), self._now
        out.reference[:], out.rate[:] = command.reference, command.rate
        out.carrying[:], out.rope_rate_m_s[:] = command.carrying, command.rope_rate_m_s
        self.balance = now = self._statics.look(measured, command.carrying)
        before = thread_time()
        self.plan = plan = self.sharing.plan(now)
        self.solve_s.append(thread_time() - before)
        smooth = self._smoothed(now.measured, dt)
        if plan.feasible:
            self._haul(plan.forces[FEET:], smooth[FEET:], dt, out)
            if command.carrying.all():
                self._squeeze(smooth - plan.forces, now, dt, measured, out)
                hanging = smooth[NORMALS] < HANGING_SHARE * plan.forces[NORMALS]
                out.rate[VERTICAL_AXES] += np.where(hanging, SEEK_M_S, 0.0)
        command.reference += command.rate * dt
        return out

    def _smoothed(self, z: Array, dt: float) -> Array:
        if self._smooth is None:
            self._smooth = z.copy()
            self._pull = z[FEET:UNKNOWNS].copy()
        self._smooth += min(1.0, dt / SMOOTH_S) * (z - self._smooth)
        return self._smooth

    def _haul(self, wanted: Array, tension: Array, dt: float, out: Command) -> None:
        step = PULL_SLEW_N_S * dt
        self._pull += np.clip(wanted - self._pull, -step, step)
        out.rope_rate_m_s += rope_rate(tension, self._pull)

    def _squeeze(self, excess: Array, now: Balance, dt: float, measured: Measured, out: Command) -> None:
        if now.inner is not self._inner:  # another posture
            self._inner, self._jacobian = now.inner, -now.joint_map[:, :FEET].T
            moved = np.linalg.solve(self._jacobian, now.rigid)
            self._whole, self._balanced = moved @ (now.rigid.T @ self._jacobian), self_balanced(now, self._jacobian)
        whole = self._whole @ (out.reference - measured.position)
        out.reference[:] = measured.position + whole  # the loops see the body's motion only
        out.rate += self._speed(self._jacobian.T @ (self._balanced @ excess), now.compliance, dt)

    def _speed(self, force: Array, compliance: Array, dt: float) -> Array:
        side = np.where(np.abs(force) < TOLERANCE, 0.0, np.sign(force))
        same = (side == self._side) & (side != 0.0)
        grown = np.minimum(self._edge + EDGE_GROWTH_1_S * dt, EDGE_LIMIT)
        self._edge = np.where(same, grown, np.maximum(1.0, np.where(side == 0.0, 1.0, 0.7 * self._edge)))
        self._side = side
        speed = GAIN_1_S * compliance * np.abs(force) + self._edge * EDGE_START
        return np.asarray(side * np.minimum(speed, SPEED_LIMIT))


def self_balanced(now: Balance, jacobian: Array) -> Array:
    """(12, 14): errors of foot forces and pulls, N -> the likeliest self-balanced error of the foot forces, N.

    Ropes that pull otherwise than planned change what the feet must bear: that part is no error of theirs. Of the rest,
    whatever moves the body is an error of the measurement; it is shared out by what each joint's friction may hide.
    `jacobian` (12 foot directions, 12 joints).
    """
    feet, inner = now.balance[:, :FEET], now.inner
    borne = feet.T @ np.linalg.solve(feet @ feet.T, now.balance[:, FEET:])
    scaled = jacobian / HIDDEN
    weighed = inner.T @ scaled @ scaled.T
    likeliest = inner @ np.linalg.solve(weighed @ inner, weighed)
    return np.hstack([likeliest, likeliest @ borne])
