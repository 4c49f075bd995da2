"""From wanted foot forces to valves and ropes: the part that every force-distributing controller
shares.

Twelve joints, six ways for the body to move: the other six combinations only squeeze the feet
against each other (one internal force shifts load between the diagonals, five squeeze along the
ground). Encoders say nothing of
them: 0.1 mm is a kilonewton. So the position loops keep the six motions, and in the rest the
measured forces rule:

    e = S (forces - wanted),  S takes off what moves the body: by least squares, weighed with what
    friction hides joint speed = gain * compliance * J^T e, plus an edge against the valve's dead
    band, where |J^T e| > tolerance

A displacement C e of the feet changes a self-balanced force by just -e. The dead band is found by
the edge: a speed that grows while the error stays. The ropes are hauled until their tensions are
those wanted.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from time import thread_time
from typing import NamedTuple, Protocol

import numpy as np

from testbed.compiled import njit
from testbed.control.distribution.statics import FEET, UNKNOWNS, Balance, Statics
from testbed.control.gait import Command, Measured, SetPoints
from testbed.control.layers import Hauling, haul, hauling
from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.formats.sockets import numbers_of, own_file
from testbed.machine.names import LEGS
from testbed.machine.scale import Scale

# From errors of the forces to rates: how fast joints squeeze and ropes are hauled, compiled. See
# distribution.py.


TOLERANCE: Array = np.tile([21.0, 49.0, 42.0], len(LEGS))
"""Joint force errors that are left alone, N m, N, N (E): a tenth of the joints' sliding
friction.
"""
GAIN_1_S = 3.0
"""Share of an error of the joint forces that is taken off in a second (E). Chosen on 30 drawn
machines whose feet stand 0.7 mm wrong, whose mean friction use is 0.42 with 1.8, 0.40 with 3, 0.44
with 5 and 0.39 with 8: beyond 3 chance decides.
"""
EDGE_START: Array = np.tile([5.0e-3, 1.0e-3, 5.0e-4], len(LEGS))
"""First guess of the speed that the valves' dead bands swallow, rad/s, m/s, m/s (E)."""
EDGE_GROWTH_1_S = 1.5
"""Growth of that speed, in first guesses a second, while nothing comes (E)."""
EDGE_LIMIT = 6.0
"""Most of it, in first guesses (E)."""
SPEED_LIMIT: Array = np.tile([2.5e-2, 5.0e-3, 4.0e-3], len(LEGS))
"""Fastest squeezing, rad/s, m/s, m/s (E)."""
HANGING_SHARE = 0.25
"""A foot that has less than this share of its load hangs, and seeks the ground: in the air no force
tells it (E).
"""
SEEK_M_S = 2.0e-3
"""Speed at which a hanging foot seeks the ground (E)."""
PULL_SLEW_N_S = 4000.0
"""Fastest change of a wanted pull (E)."""


class InternalForceState(NamedTuple):
    """These numbers for one machine."""

    tolerance: Array
    edge_start: Array
    speed_limit: Array
    seek_m_s: float
    pull_slew_n_s: float
    hauling: Hauling


def internal_force_state(scale: Scale) -> InternalForceState:
    """Those of a machine of this size."""
    speeds = np.tile([1.0 / scale.speed, scale.speed, scale.speed], len(LEGS))
    return InternalForceState(
        np.tile([scale.moment, scale.force, scale.force], len(LEGS)) * TOLERANCE,
        speeds * EDGE_START,
        speeds * SPEED_LIMIT,
        scale.speed * SEEK_M_S,
        scale.force / scale.speed * PULL_SLEW_N_S,
        hauling(scale),
    )


@njit
def add_pull(
    wanted: Array, tension: Array, dt: float, by: InternalForceState, pull: Array, rates: Array
) -> None:
    """Let `pull` (2) follow what is wanted (2), N; add to the ropes' rates (2) what brings the
    tensions (2) there.
    """
    step = by.pull_slew_n_s * dt
    for index in range(pull.shape[0]):
        pull[index] += min(max(wanted[index] - pull[index], -step), step)
    haul(tension, pull, by.hauling, rates)


@njit
def add_internal_force(
    force: Array,
    compliance: Array,
    felt: Array,
    wanted: Array,
    dt: float,
    by: InternalForceState,
    edges: Array,
    rates: Array,
) -> None:
    """Add to the joints' rates (12) what takes `force` (12) off them, and what lets hanging feet
    seek the ground.

    compliance (12) of the joints; felt, wanted (14): forces in the order of Statics' unknowns;
    edges (2, 12): in first guesses, and -1, 0, 1 as the side, of the last tick, brought up to date.
    """
    edge, side = edges[0], edges[1]
    for index in range(rates.shape[0]):
        size = abs(force[index])
        now = 0.0 if size < by.tolerance[index] else 1.0 if force[index] > 0.0 else -1.0
        if now != 0.0 and now == side[index]:
            edge[index] = min(edge[index] + EDGE_GROWTH_1_S * dt, EDGE_LIMIT)
        else:
            edge[index] = max(1.0, 1.0 if now == 0.0 else 0.7 * edge[index])
        side[index] = now
        rates[index] += now * min(
            GAIN_1_S * compliance[index] * size + edge[index] * by.edge_start[index],
            by.speed_limit[index],
        )
    for leg in range(len(LEGS)):
        if felt[3 * leg] < HANGING_SHARE * wanted[3 * leg]:
            rates[3 * leg + 2] += by.seek_m_s


HIDDEN: Array = np.tile([60.0, 350.0, 150.0], len(LEGS))
"""What friction hides of the joints' forces, one standard deviation, N m, N, N (E); the vertical
ones are estimated.
"""


@dataclass(frozen=True)
class Plan:
    """Wanted forces (14,) in the order of Statics' unknowns, N; feasible: whether the controller
    found any.
    """

    forces: Array
    feasible: bool = True
    load: Array | None = None
    """(6,) the load it balances, where a controller believes in another one than it was given."""


class Controller(Protocol):
    """A way to share the load out between feet and ropes; one file each. One of a user's own is
    made without arguments.
    """

    def plan(self, now: Balance) -> Plan:
        """The forces to be had, from the balance now; asked at every tick, 100 Hz."""
        ...


class Distribution:
    """A Layer that shares the load out on top of the gait's set points, the way that `controller`
    plans it.
    """

    def __init__(self, statics: Statics, controller: Controller) -> None:
        self.controller = controller
        self.plan: Plan | None = None
        """The last plan."""
        self.balance: Balance | None = None
        """What it was made for."""
        self.timed = False
        self.solve_s: list[float] = []
        """Processor time of each plan, s, if `timed`: to ask for it takes as long as a part of the
        plan.
        """
        self._statics = statics
        self._gait: SetPoints | None = None
        """Where the gait's own set points stand."""
        self._pull: Array | None = None
        self._edges = np.array([np.ones(FEET), np.zeros(FEET)])
        scale = statics.scale
        self._internal_force = internal_force_state(scale)
        self._hidden = HIDDEN * np.tile([scale.moment, scale.force, scale.force], len(LEGS))
        self._inner = self._jacobian = self._whole = self._balanced = np.empty(0)

    def over(self, command: Command, t: float, dt: float, measured: Measured) -> Command:
        """See Layer."""
        self.balance = now = self._statics.balance(measured, command.stance)
        before = thread_time() if self.timed else 0.0
        self.plan = plan = checked_plan(self.controller.plan(now), self.controller)
        if self.timed:
            self.solve_s.append(thread_time() - before)
        if self._gait is None:
            self._gait = SetPoints(command.joints)
        begin, rates = self._gait.follow(command, dt)
        if self._pull is None:
            self._pull = now.measured_pull_n.copy()
        rope_rates = command.rope_rates_m_s
        if plan.feasible:
            rope_rates = rope_rates.copy()
            wanted, felt = plan.forces[FEET:], now.measured[FEET:]
            add_pull(wanted, felt, dt, self._internal_force, self._pull, rope_rates)
            if command.stance.all():
                begin, rates = self._with_internal_force(
                    plan, now, dt, begin, rates, measured.position
                )
        return replace(
            command, joints=begin + rates * dt, joint_rates=rates, rope_rates_m_s=rope_rates
        )

    def _with_internal_force(
        self, plan: Plan, now: Balance, dt: float, begin: Array, rates: Array, position: Array
    ) -> tuple[Array, Array]:
        """Set points (12) and rates (12) that keep the body's motion and squeeze the feet as
        planned.
        """
        self._look_at_posture(now)
        measured_n = now.measured  # as it is: a mean over 30 ms makes the loop hunt
        force = np.asarray(self._jacobian.T @ (self._balanced @ (measured_n - plan.forces)))
        rates = rates.copy()
        by, edges = self._internal_force, self._edges
        add_internal_force(force, now.compliance, measured_n, plan.forces, dt, by, edges, rates)
        return position + self._whole @ (begin - position), rates

    def _look_at_posture(self, now: Balance) -> None:
        """Work out anew, in another posture: which set points move the body, which forces squeeze
        the feet.
        """
        if now.inner is self._inner:
            return
        self._inner, self._jacobian = now.inner, -now.joint_map[:, :FEET].T
        moved = np.linalg.solve(self._jacobian, now.rigid)
        self._whole = moved @ (now.rigid.T @ self._jacobian)
        self._balanced = self_balanced(now, self._jacobian, self._hidden)


def checked_plan(plan: Plan, controller: object) -> Plan:
    """The plan; InputError where it is none that can be followed, as one of a user's own may be."""
    name = type(controller).__name__
    if not isinstance(plan, Plan):
        raise InputError(
            "answered no plan",
            file=own_file(controller),
            field=name,
            value=type(plan).__name__,
            allowed="a Plan",
        )
    forces = numbers_of(plan.forces, (UNKNOWNS,), controller, "forces")
    if not np.isfinite(forces).all():
        raise InputError(
            "planned no forces that can be had",
            file=own_file(controller),
            field=name,
            value=forces.tolist(),
            allowed=f"({UNKNOWNS},) finite numbers",
        )
    return plan


def self_balanced(now: Balance, jacobian: Array, hidden: Array = HIDDEN) -> Array:
    """(12, 14): errors of foot forces and pulls, N -> the likeliest self-balanced error of the foot
    forces, N.

    Ropes that pull otherwise than planned change what the feet must bear: that part is no error of
    theirs. Of the rest, whatever moves the body is an error of the measurement; it is shared out by
    what each joint's friction may hide. `jacobian` (12 foot directions, 12 joints); `hidden` (12).
    """
    feet, inner = now.balance[:, :FEET], now.inner
    borne = feet.T @ np.linalg.solve(feet @ feet.T, now.balance[:, FEET:])
    scaled = jacobian / hidden
    weighed = inner.T @ scaled @ scaled.T
    likeliest = inner @ np.linalg.solve(weighed @ inner, weighed)
    return np.hstack([likeliest, likeliest @ borne])
