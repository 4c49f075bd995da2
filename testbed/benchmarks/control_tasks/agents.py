"""Agents of the tasks of control: each is told an observation, and says an action."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from testbed.control.gait import Observed
from testbed.control.layers import SHIFT_SPEED_M_S
from testbed.envs.drill_hole import FEED_N, FEED_RANGE_N, HANDBOOK, DrillHoleEnv
from testbed.envs.keep import DIAGONAL, HAUL_M_S, RAISE_M_S
from testbed.envs.observations import HOLE_TABLE, KEEP_TABLE, in_units
from testbed.formats.arrays import Array, Flags
from testbed.formats.networks import Network
from testbed.laws.penetration import penetration_rate
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


# Agents that keep a stance: one hauls what still holds, one also stands ready for a rope that may
# part, one gives way with its legs.
#
# All know from the foot loads what the slope pulls down: W = N tan(slope), N the sum of the foot
# loads in the first step. With both ropes pulling c W the feet have (c - 1) W to hold up the slope;
# in the moment in which one of them parts, (1 - c / 2) W down the slope. The secure pull makes the
# larger of the two as small as can be, c = 4/3, and leaves the feet a part of the least friction
# that has to be reckoned with.
#
# What is then lacking the rope that is left takes over as it is stretched, by some centimetres in a
# quarter of a second; hauling at 60 mm/s is too slow for that. The feet slide those centimetres,
# unless the body goes them over feet that stay: the yielding agent predicts, decision by decision,
# from the rope's stiffness, its tension and the loads, how far the body has to go until the feet
# can hold the rest, and lets the legs go so far. Before a loss it compares what it has hauled with
# what the tension has gained: rope that comes in and does not stretch drags the feet, and it pulls
# less.

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
    """The same, and pulls so that the feet can hold what comes when either rope parts: see
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
    """The same, and gives way with its legs as far as the rope that is left has still to be
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


# Ways to press a drill: as the handbook says, as the stance allows, and as the rock answers.
#
# The adaptive one knows the law of penetration (laws/penetration.py) but not the rock: from feed
# and rate it infers how much energy the rock takes, layer by layer, and presses as hard as is best
# for what it believes. How much of the stance's reserve it may use it finds out as it goes: less
# after a foot that came near to losing its load, slowly more while all carry.

FEEDS_N = np.arange(FEED_N - FEED_RANGE_N, FEED_N + FEED_RANGE_N + 1.0, 250.0)
"""Feeds that are weighed against each other."""
ENERGIES = np.exp(np.linspace(math.log(0.1), math.log(6.0), 81))
"""Specific energies that the rock may take, relative to medium rock."""
USUAL, SPREAD = 0.8, 0.75
"""Middle of them, and standard deviation of their logarithm, before anything is known (E)."""
CHANGES = 0.04
"""Probability that the layer changes within a decision (E: a layer of 0.15 m at 5 mm/s)."""
RATE_SD = 0.15
"""Standard deviation of the logarithm of a rate: the feed wanders (E)."""
STANDSTILL_M_S, VOID_M_S = 1.0e-5, 0.029
"""A bit that is slower stands, one that is faster falls through a void."""
ALL_THE_TIME = 0.99
"""A state's mean over a step from which it lasted for all of it."""
NEARLY_LOST_N = 500.0
"""A foot with less load is about to be lost (E)."""
JAM_WORTH_S = 8.0
"""Time that a jam costs: it is drawn back and turned free."""


@dataclass(frozen=True)
class Drill:
    """What is known of the drill beforehand."""

    medium_m_s: float
    """Rate in medium rock with the best feed and the full hammer."""
    best_feed_n: float
    """In medium rock."""
    feed_exponent: float
    jam_feed_share: float
    jam_s: float
    reserve_n: float
    """Thrust at which a foot would leave, as reckoned at the start."""

    @classmethod
    def of(cls, env: DrillHoleEnv) -> Drill:
        """Of the machine that is believed, at work in an environment that was reset."""
        machine, task = env.believed, env.task
        drill = machine.drill
        rate = penetration_rate(
            drill.blow_energy_j,
            task.blow_hz,
            drill.energy_share,
            machine.drill_body.hole_diameter_m,
            machine.rock.medium.specific_energy_j_m3,
            1.0,
        )
        return cls(
            rate,
            drill.best_feed_n,
            drill.feed_exponent,
            drill.jam_feed_share,
            drill.jam_s,
            env.reserve_n,
        )


def action_of(feed_n: float, hammer: float = 1.0, pulls: float = 0.0) -> Vector:
    """The action that orders a feed, a share of the hammer, and of both ropes this share of PULL_N
    beyond the plan's; the stance is left alone.
    """
    action = HANDBOOK.copy()
    action[:2] = (feed_n - FEED_N) / FEED_RANGE_N, 2.0 * hammer - 1.0
    action[2:4] = pulls
    return np.clip(action, -1.0, 1.0)


class Reserve:
    """One feed everywhere, held to a share of what the stance allows, and one pull of the ropes."""

    def __init__(self, drill: Drill, feed_n: float, share: float, pulls: float = 0.0) -> None:
        self._action = action_of(min(feed_n, share * drill.reserve_n), pulls=pulls)

    def act(self, observation: Vector) -> Vector:
        """See Agent."""
        del observation
        return self._action.copy()


class Stance:
    """How much of the stance's reserve the thrust may use: found out as it goes."""

    def __init__(self, drill: Drill, share: float, most: float) -> None:
        self._reserve_n, self._most = drill.reserve_n, most
        self.share = min(share, most)

    def allowed_n(self, seen: Readings, feed_n: float) -> float:
        """The highest feed for now, from the feet's loads under the feed so far."""
        loads = seen.each("estimate_own", LEGS)
        if loads.min() < NEARLY_LOST_N:
            self.share = max(0.85 * min(self.share, feed_n / self._reserve_n), 0.1)
        else:
            self.share = min(self.share + 0.01, self._most)
        return self.share * self._reserve_n


class Adaptive:
    """Infers from feed and rate how much energy the rock takes, and presses as hard as is best for
    that.
    """

    def __init__(self, drill: Drill, share: float = 0.6, most: float = 0.8) -> None:
        self._drill = drill
        self._stance = Stance(drill, share, most)
        distance = np.log(ENERGIES / USUAL) / SPREAD
        prior = np.exp(-0.5 * distance**2)
        self._prior: Array = prior / prior.sum()
        self._believed = self._prior.copy()
        best = drill.best_feed_n * ENERGIES**drill.feed_exponent
        pressed = FEEDS_N[:, None] / best
        rate = drill.medium_m_s / ENERGIES * np.maximum(pressed * (2.0 - pressed), 0.0)
        over = np.maximum(pressed - drill.jam_feed_share, 0.0) / (2.0 - drill.jam_feed_share)
        lost = np.minimum(over / drill.jam_s, 1.0) * JAM_WORTH_S
        self._rates: Array = rate
        """(feeds, energies) with the full hammer, m/s."""
        self._worth: Array = rate / (1.0 + lost)

    def act(self, observation: Vector) -> Vector:
        """See Agent."""
        seen = Readings(observation, HOLE_TABLE)
        self._learn(seen)
        allowed = self._stance.allowed_n(seen, seen["orders.feed"])
        worth = self._worth @ self._believed
        worth[allowed + 1.0 < FEEDS_N] = -1.0
        return action_of(float(FEEDS_N[int(np.argmax(worth))]))

    def _learn(self, seen: Readings) -> None:
        """Take over what the last step's rate says of the rock."""
        self._believed = (1.0 - CHANGES) * self._believed + CHANGES * self._prior
        rate, hammer = seen["control.bit_rate"], seen["orders.hammer"]
        if seen["control.drilling"] < ALL_THE_TIME or hammer <= 0.0:
            return
        if not STANDSTILL_M_S < rate < VOID_M_S:
            return
        row = int(np.argmin(np.abs(FEEDS_N - seen["orders.feed"])))
        expected = np.maximum(hammer * self._rates[row], 1e-7)
        likelihood = np.exp(-0.5 * (np.log(rate / expected) / RATE_SD) ** 2) + 1e-6
        self._believed = self._believed * likelihood
        self._believed /= self._believed.sum()
