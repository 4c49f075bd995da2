"""Agents of the control tasks: each chooses an action from an observation. Here are those
for every task, and those that keep a stance; drilling.py has those that drill.

Of those that keep a stance one hauls what still holds, one also stands ready for a rope that may
part, one gives way with its legs.

All know from the foot loads what the slope pulls down: W = N tan(slope), N the sum of the foot
loads in the first step. With both ropes pulling c W the feet have (c - 1) W to hold up the slope;
in the moment in which one of them parts, (1 - c / 2) W down the slope. The secure pull makes the
larger of the two as small as can be, c = 4/3, and leaves the feet a part of the least friction
that has to be reckoned with.

What is then lacking the rope that is left takes over as it is stretched, by some centimetres in a
quarter of a second; hauling at 60 mm/s is too slow for that. The feet slide those centimetres,
unless the body goes them over feet that stay: the yielding agent predicts, decision by decision,
from the rope's stiffness, its tension and the loads, how far the body has to go until the feet
can hold the rest, and lets the legs go so far. Before a loss it compares what it has hauled with
what the tension has gained: rope that comes in and does not stretch drags the feet, and it pulls
less.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from testbed.control.gait import Observed
from testbed.control.layers import SHIFT_SPEED_M_S
from testbed.envs.keep import DIAGONAL, HAUL_M_S, RAISE_M_S
from testbed.envs.observations import KEEP_TABLE, in_units
from testbed.formats.arrays import Array, Flags
from testbed.formats.networks import Network
from testbed.machine.names import LEGS, SIDES

Vector = NDArray[np.float32]


class Agent(Protocol):
    """Acts for one episode."""

    def act(self, observation: Vector) -> Vector:
        """An action in [-1, 1] of a flat observation."""
        ...


class Constant:
    """The same action all the time."""

    def __init__(self, action: Sequence[float] | Vector) -> None:
        self._action = np.asarray(action, dtype=np.float32)

    def act(self, observation: Vector) -> Vector:
        """See Agent."""
        del observation
        return self._action.copy()


class Trained:
    """A policy of `testbed train`."""

    def __init__(self, network: Network) -> None:
        self._network = network

    def act(self, observation: Vector) -> Vector:
        """See Agent."""
        return self._network.answer(observation.astype(float)).astype(np.float32)


class Readings:
    """A flat observation's rows by name, in their units."""

    def __init__(self, observation: Vector, table: Sequence[Observed]) -> None:
        self._values = in_units(observation, table)

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def each(self, name: str, labels: Sequence[str]) -> NDArray[Any]:
        """Rows `name_label` of all labels, as a vector."""
        return np.array([self._values[f"{name}_{label}"] for label in labels])


STEP_S = 0.05
ROPE_N_M = 2.5e5
"""Stiffness that a rope of some thirty metres is hauled with (D: 327 kN/m at 30 m, less what the
feet give).
"""
SLACK_SHARE = 0.25
"""A rope with less than this share of its first tension holds no more."""
MOST_N = 3.0e4
"""Highest pull that is asked for: a little less than a traction device's rating."""
EVEN_SHARE = 0.03
"""Share of the load by which one diagonal may carry more than the other."""
EVENING_M_S = 0.012
"""How fast the rest is evened out, for all of the load on one diagonal."""
LEAST_FRICTION, USED_SHARE = 0.3, 0.83
"""Friction that has to be reckoned with on wet rock (D), and the share of it that may be used up
the slope (E).
"""
REACTION_S = 0.05
"""Time in which a lack of pull is made up for."""
RAISED_M = np.array([3.0e-3, 2.0e-3])
"""How far the diagonal of the lost rope's front foot and the front are raised after a loss."""
GIVEN_M, BORNE_SHARE = 0.01, 0.6
"""Feet that have been dragged so far before a loss bear this share of what was pulled more (E)."""
RELIED_ON = 0.08
"""Friction that feet which have just given way are relied on for."""


def slope_pull(seen: Readings) -> float:
    """What the slope pulls down the machine, N, from the foot loads of an episode's first step."""
    return float(seen.each("estimate_own", LEGS).sum() * np.tan(-seen["attitude_pitch"]))


def secure_share(slope: float, least_friction: float) -> float:
    """Pull of both ropes together over the slope's pull W; slope: its tangent."""
    return min(4.0 / 3.0, 1.0 + USED_SHARE * least_friction / slope)


class Hauling:
    """Hauls the rope that is left when the other holds no more, and hauls back one that has
    slipped.
    """

    def __init__(self, reaction_s: float = REACTION_S) -> None:
        self.reaction_s = reaction_s
        """Time in which a lack of pull is made up for."""
        self._first: Array | None = None
        self._slope = self._weight_n = self._slope_n = 0.0

    def act(self, observation: Vector) -> Vector:
        """See Agent."""
        seen = Readings(observation, KEEP_TABLE)
        tension = seen.each("rope_tension", SIDES)
        if self._first is None:
            self._first = tension
            self._slope = float(np.tan(-seen["attitude_pitch"]))
            self._weight_n = float(seen.each("estimate_own", LEGS).sum())
            self._slope_n = slope_pull(seen)
        latest = self._first + seen.each("control.pull_change", SIDES)
        holds = latest > SLACK_SHARE * self._first
        pull, whole = np.where(holds, latest, 0.0), bool(holds.all())
        left = self._first if whole else np.where(holds, self._left_n(seen, pull), self._first)
        wanted = self._ready(seen, latest) if whole else left
        lacking = np.minimum(wanted, MOST_N) - latest
        if not whole:
            lacking = np.maximum(lacking, 0.0)  # what is left of the ropes is never given away
        speeds = lacking / ROPE_N_M / self.reaction_s / HAUL_M_S
        raised = np.asarray(self._raised_m_s(seen, holds)) / RAISE_M_S
        shifted = self._shifted_m_s(seen, pull) / SHIFT_SPEED_M_S
        action = np.clip([*speeds, *raised, shifted], -1.0, 1.0)
        return np.asarray(action, dtype=np.float32)

    def _left_n(self, seen: Readings, pull: Array) -> float:
        """Pull that is wanted of a rope that is left alone, N, from the readings and the pulls (2),
        N: all of the slope's.
        """
        del seen, pull
        return self._slope_n

    def _ready(self, seen: Readings, tension: Array) -> Array:
        """Pulls (2) that are wanted while both ropes hold, N: those that they have."""
        del seen
        return tension

    def _raised_m_s(self, seen: Readings, holds: Flags) -> tuple[float, float]:
        """Speeds at which the diagonal and the front are raised, m/s, from the readings and which
        ropes hold: none.
        """
        del seen, holds
        return 0.0, 0.0

    def _shifted_m_s(self, seen: Readings, pull: Array) -> float:
        """Speed of the body up the slope, m/s, from the readings and the pulls (2), N: none."""
        del seen, pull
        return 0.0


class Secure(Hauling):
    """Hauls, and pulls so that the feet can hold what comes when either rope parts: see
    above for how much that is.
    """

    def __init__(
        self, least_friction: float = LEAST_FRICTION, reaction_s: float = REACTION_S
    ) -> None:
        super().__init__(reaction_s)
        self._least_friction = least_friction
        self._stood_m: Array | None = None
        """How far diagonal and front were raised at the loss."""

    def _ready(self, seen: Readings, tension: Array) -> Array:
        del seen, tension
        share = secure_share(self._slope, self._least_friction)
        return np.full(len(SIDES), 0.5 * share * self._slope_n)

    def _raised_m_s(self, seen: Readings, holds: Flags) -> tuple[float, float]:
        """Both diagonals are to carry alike while both ropes hold: only then do all four feet hold
        against a turn on one rope. After a loss the feet that hold best against the turn are given
        more to carry.
        """
        now = np.array([seen["orders.diagonal"], seen["orders.front"]])
        if not holds.all():
            if self._stood_m is None:
                self._stood_m = now
            side = np.array([1.0 if holds[1] else -1.0, 1.0])
            diagonal, front = ((self._stood_m + side * RAISED_M - now) / STEP_S).tolist()
            return diagonal, front
        loads = seen.each("estimate_own", LEGS)
        uneven = float(DIAGONAL @ loads) / max(float(loads.sum()), 1.0)
        return (0.0 if abs(uneven) < EVEN_SHARE else -EVENING_M_S * uneven), 0.0


class Yielding(Secure):
    """Secures, and gives way with its legs as far as the rope that is left has still to be
    stretched: see above for how it predicts that.
    """

    def __init__(
        self,
        least_friction: float = LEAST_FRICTION,
        reaction_s: float = REACTION_S,
        relied_on: float = RELIED_ON,
    ) -> None:
        super().__init__(least_friction, reaction_s)
        self._relied_on = relied_on
        self._given_m, self._most_n = 0.0, np.inf
        """How far the feet have given way, and the mean pull that they bear."""

    def _ready(self, seen: Readings, tension: Array) -> Array:
        """Rope that comes in without stretching comes from feet that give way."""
        assert self._first is not None
        gained_n = float((tension - self._first).mean())
        given_m = float(seen.each("orders.hauled", SIDES).mean()) - gained_n / ROPE_N_M
        if given_m > self._given_m + GIVEN_M:
            self._given_m = given_m
            self._most_n = float(self._first.mean()) + BORNE_SHARE * gained_n
        return np.minimum(super()._ready(seen, tension), self._most_n)

    def _shifted_m_s(self, seen: Readings, pull: Array) -> float:
        """As far as is predicted, within this decision."""
        del seen
        if pull.all():
            return 0.0
        holding = int(np.count_nonzero(pull))
        stiffness = ROPE_N_M * max(holding, 1)
        lacking = self._slope_n - self._relied_on * self._weight_n - float(pull.sum())
        return -max(lacking, 0.0) / stiffness / STEP_S
