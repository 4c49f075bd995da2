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
from time import thread_time
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from testbed.control.distribution.squeeze import add_pull, add_squeeze
from testbed.control.distribution.statics import FEET, Balance, Statics
from testbed.control.programs.references import Command, Measured, Program
from testbed.machine.names import LEGS

Array = NDArray[np.float64]
HIDDEN: Array = np.tile([60.0, 350.0, 150.0], len(LEGS))
"""What friction hides of the joints' forces, one standard deviation, N m, N, N (E); the vertical ones are estimated."""


@dataclass(frozen=True)
class Plan:
    """Wanted forces (14,) in the order of Statics' unknowns, N; feasible: whether the controller found any."""

    forces: Array
    feasible: bool = True
    load: Array | None = None
    """(6,) the load it balances, where a controller believes in another one than it was given."""


class Sharing(Protocol):
    """A way to share the load out; one file each."""

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
        self.timed = False
        self.solve_s: list[float] = []
        """Processor time of each plan, s, if `timed`: to ask for it takes as long as a part of the plan."""
        self._statics = statics
        self._now = Command()
        self._pull: Array | None = None
        self._edge, self._side = np.ones(FEET), np.zeros(FEET)
        self._inner = self._jacobian = self._whole = self._balanced = np.empty(0)

    def update(self, t: float, dt: float, measured: Measured) -> Command:
        """See Program."""
        command, out = self.inner.update(t, dt, measured), self._now
        out.follow(command)
        self.balance = now = self._statics.look(measured, command.carrying)
        before = thread_time() if self.timed else 0.0
        self.plan = plan = self.sharing.plan(now)
        if self.timed:
            self.solve_s.append(thread_time() - before)
        self._follow(plan, now, dt, measured, command)
        return out

    def _follow(
        self, plan: Plan, now: Balance, dt: float, measured: Measured, command: Command
    ) -> None:
        """What is wanted, in set points; the inner command moves on."""
        out = self._now
        measured_n = now.measured  # as it is: a mean over 30 ms makes the loop hunt
        if self._pull is None:
            self._pull = now.measured_pull_n.copy()
        if plan.feasible:
            add_pull(plan.forces[FEET:], measured_n[FEET:], dt, self._pull, out.rope_rate_m_s)
            if command.carrying.all():
                force = self._squeezing(measured_n - plan.forces, now, measured.position)
                add_squeeze(
                    force,
                    now.compliance,
                    measured_n,
                    plan.forces,
                    dt,
                    self._edge,
                    self._side,
                    out.rate,
                )
        command.reference += command.rate * dt

    def _squeezing(self, excess: Array, now: Balance, position: Array) -> Array:
        """(12,) joint forces that squeeze the feet wrongly; the loops are left the body's motion only."""
        if now.inner is not self._inner:  # another posture
            self._inner, self._jacobian = now.inner, -now.joint_map[:, :FEET].T
            moved = np.linalg.solve(self._jacobian, now.rigid)
            self._whole, self._balanced = (
                moved @ (now.rigid.T @ self._jacobian),
                self_balanced(now, self._jacobian),
            )
        reference = self._now.reference
        reference[:] = position + self._whole @ (reference - position)
        return np.asarray(self._jacobian.T @ (self._balanced @ excess))


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
