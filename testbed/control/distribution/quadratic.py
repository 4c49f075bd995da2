"""Sharing by a quadratic program: the highest use of friction is as low as it can be, whatever the
friction is.

    min  worst * s^2 + sum_i (tx_i^2 + ty_i^2 + even * n_i^2) / mean(n)^2 + steady * |pull - last
    pull|^2 with |t_i| + doubt <= s (n_i + taken_i)   each stance foot
         balance, n_i >= lowest, joint forces within what the supply gives, 0 <= pull <= rating

Forces in units of the load. `doubt` is what joints at rest hide of a tangential force: it keeps a
foot from living on a few hundred newtons that nobody can be sure of. `taken` is what a surge of the
thrust would take off a foot (none here). As s is sought and not given, no coefficient of friction
has to be believed, and a plan within the cones is found where there is one: the doubt is given up
as s passes what poor rock holds, the lowest load where it cannot be had.

s * n is not linear: it is taken about the last plan; the plans of following ticks converge.
use_program.py turns it into the arrays that daqp solves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from testbed.control.distribution.distribution import Plan
from testbed.control.distribution.statics import FEET, NORMALS, ROPES, UNKNOWNS, Balance
from testbed.control.distribution.use_program import LastPlan, ProgramScale, UseProgram, highest_use
from testbed.formats.arrays import Array
from testbed.machine.names import LEGS

CONE_SIDES = 8
"""Sides of the pyramid inside a friction cone."""
LOWEST_NORMAL_N = 800.0
"""Least normal load of a plan: twice what blows, estimates and the loops leave open (E)."""
DOUBT_N = 600.0
"""Break-away of a radial joint at rest (E)."""
POOR_FRICTION = 0.45
"""Coefficient of poor rock, 0.7 of the usual (E): plans that need more are made for friction
alone.
"""
WORST = 4.0
"""Weight of the highest use of friction, against friction use squared (E)."""
EVEN = 0.05
"""Weight of even normal loads (E)."""
STEADY = 0.02
"""Weight of quiet ropes (E)."""
STRICT = 50.0
"""How much more the highest use weighs where the doubt is given up (E)."""
FIRST_ROUNDS = 6
"""Rounds until the first plan."""
CLOSER = 0.02
"""Most by which s may fall from round to round."""


EASED = 0.7
"""The lowest load that is kept to falls to this share of itself where there is no plan (E)."""
TIGHTENED = 0.002
"""It grows by this share of the whole with each plan that there is (E)."""
GIVEN_UP = 0.1
"""Below this share it is not kept to at all (E)."""


@dataclass(frozen=True)
class Constraints:
    """low <= rows @ z <= high and below <= z <= above, balance @ z = value; z in units of `scale`
    N.
    """

    rows: Array
    low: Array
    high: Array
    balance: Array
    value: Array
    below: Array
    above: Array
    scale: float


@dataclass
class _Last:
    """What the next plan is made about."""

    normals: Array
    """(4,) in units of the load."""
    pull: Array
    use: float
    doubt: float = 1.0
    """Share of the doubt that is kept to."""
    lowest: float = 1.0
    """Share of the lowest load that is kept to."""


class Quadratic:
    """See the module's docstring. `friction`: what `constraints` takes it to be; None is the
    believed machine's.
    """

    def __init__(self, friction: float | None = None) -> None:
        self.friction = friction
        self._last: _Last | None = None
        self._use_rows = _cones(0.0)
        self._program = UseProgram(self._use_rows)

    def plan(self, now: Balance) -> Plan:
        """See Controller. Where no plan balances the load without a pulling foot, nothing is asked
        for.
        """
        rounds = 1
        if self._last is None:
            scale = _size(now.load)
            even = np.where(now.stance, 1 / 6, 0.0)
            self._last, rounds = (
                _Last(even, now.measured_pull_n / scale, 2 * POOR_FRICTION),
                FIRST_ROUNDS,
            )
        found = None
        for _ in range(rounds):
            found = self._solve(now, self._last)
        while found is None and self._last.lowest > 0.0:
            found = self._solve(now, self._last)
        if found is None:
            return Plan(now.measured, feasible=False)
        return Plan(found)

    def constraints(self, now: Balance, lowest_n: float) -> Constraints:
        """What a plan must keep to, with at least `lowest_n` on every stance foot."""
        scale = _size(now.load)
        below, above = np.full(UNKNOWNS, -np.inf), np.full(UNKNOWNS, np.inf)
        below[NORMALS] = np.where(now.stance, lowest_n / scale, 0.0)
        for leg in np.flatnonzero(~now.stance):
            below[3 * leg : 3 * leg + 3], above[3 * leg : 3 * leg + 3] = 0.0, 0.0
        below[ROPES], above[ROPES] = 0.0, now.rope_rating_n / scale
        low, high = (now.lowest - now.held) / scale, (now.highest - now.held) / scale
        rows = _cones(now.friction if self.friction is None else self.friction)
        cones, free = np.zeros(len(rows)), np.full(len(rows), -np.inf)
        return Constraints(
            np.vstack([rows, now.joint_map]),
            np.concatenate([free, low]),
            np.concatenate([cones, high]),
            now.balance,
            -now.load / scale,
            below,
            above,
            scale,
        )

    def taken(self, now: Balance) -> Array:
        """(4,) change of the normal loads, N, that a plan must stand without warning."""
        return np.zeros(len(now.stance))

    def _solve(self, now: Balance, last: _Last) -> Array | None:
        scale = _size(now.load)
        taken = self.taken(now) / scale * last.doubt
        begun = LastPlan(last.normals, last.pull, taken)
        found = self._program.solve(now, begun, self._about(last, scale, now))
        if found is None:
            last.lowest = 0.0 if last.lowest < GIVEN_UP else EASED * last.lowest
            return None
        last.lowest = min(last.lowest + TIGHTENED, 1.0)
        use = highest_use(found, self._use_rows)
        last.normals, last.pull, last.use = (
            found[:FEET:3].copy(),
            found[FEET:UNKNOWNS].copy(),
            max(float(found[UNKNOWNS]), 0.0),
        )
        last.doubt = (
            max(0.8 * last.doubt - 0.01, 0.0)
            if use > POOR_FRICTION
            else min(last.doubt + 0.02, 1.0)
        )
        return np.asarray(found[:UNKNOWNS] * scale)

    def _about(self, last: _Last, scale: float, now: Balance) -> ProgramScale:
        """|t| + doubt <= s_0 (n + taken) + (s - s_0) (n_0 + taken), about the last plan's s_0 and
        n_0.
        """
        tangential = max(sum(last.normals.tolist()) / len(LEGS), 0.02) ** -2
        return ProgramScale(
            scale=scale,
            lowest=now.scale.force * LOWEST_NORMAL_N * last.lowest / scale,
            highest_pull=now.rope_rating_n / scale,
            doubt=now.scale.force * DOUBT_N * last.doubt / scale,
            use=last.use,
            least_use=max(last.use - CLOSER, 0.0),
            tangential=tangential,
            even=EVEN * tangential,
            steady=STEADY,
            worst=WORST * (1.0 + STRICT * (1.0 - last.doubt)),
        )


def _size(load: Array) -> float:
    """Of a wrench's force, N."""
    force = load[:3]
    return math.sqrt(force @ force)


def _cones(friction: float) -> Array:
    """Rows r with r . z <= 0: pyramids inside the friction cones; for friction 0, |t| as the
    pyramid measures it.
    """
    rows = np.zeros((len(LEGS) * CONE_SIDES, UNKNOWNS))
    for leg in range(len(LEGS)):
        for side in range(CONE_SIDES):
            angle = 2 * np.pi * side / CONE_SIDES
            part = np.array([np.cos(angle), np.sin(angle)]) / np.cos(np.pi / CONE_SIDES)
            rows[leg * CONE_SIDES + side, 3 * leg : 3 * leg + 3] = (-friction, *part)
    return rows
