"""Agents of the drilling task: ways to press a drill, as the handbook says, as the stance allows,
and as the rock answers.

The adaptive one knows the law of penetration (laws/penetration.py) but not the rock: from feed
and rate it infers how much energy the rock takes, layer by layer, and presses as hard as is best
for what it believes. How much of the stance's reserve it may use it finds out as it goes: less
after a foot that came near to losing its load, slowly more while all carry.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from testbed.benchmarks.control_tasks.agents import Readings, Vector
from testbed.envs.drill_hole import FEED_N, FEED_RANGE_N, HANDBOOK, DrillHoleEnv
from testbed.envs.observations import HOLE_TABLE
from testbed.formats.arrays import Array
from testbed.laws.penetration import penetration_rate
from testbed.machine.names import LEGS

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
