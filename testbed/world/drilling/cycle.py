"""Drilling one hole: position, collar, drill, add a rod, drill ... extract, rod by rod.

The feed is a force source with a limited speed. On rock it builds up its force and the bit goes as
fast as the rock lets it; over a void it finds nothing to push on, so the thrust is gone within a
control tick and the string runs ahead until it lands. Pressed much harder than is best for the rock
the bit jams: it is drawn back and turned free, which takes its time. On the way out the string may
stick: the pull then grows, jerked and hammered, until the string comes free, or until it is left
behind.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from testbed.laws.penetration import best_feed, penetration_rate, thrust_factor, wandering
from testbed.machine.model import Machine
from testbed.scenario.drilling import DrillHole
from testbed.world.drilling.drilling import Loads, Ordered
from testbed.world.drilling.strata import VOID, Strata, sticking_places, strata_of

Happened = dict[str, Any]

JERK_HZ, JERK_SHARE = 1.0, 0.2
"""A stuck string is jerked: the pull swings by this share of itself, this often (E)."""
WEAR_S = 15.0
"""Time in which blows wear the hold of a stuck string down to 1/e (E)."""
TAKE, GIVE = 0.3, 0.7
"""Shares of a rod change at which the rod leaves one place and at which it is handed to the other
(E).
"""
MAKE_UP_SHARE = 0.5
"""Torque that screws or breaks a joint of the string, of the drilling torque (E)."""
TOUCH_SHARE = 0.1
"""Share of the feed with which the bit is set on the rock (E)."""


class DrillCycle:
    """One hole. `rods` are in the string, `bit_m` is where the bit is, both from the surface
    down.
    """

    def __init__(self, task: DrillHole, seed: int, numbers: Machine) -> None:
        self.task, self.loads = task, Loads()
        self.phase = "idle"
        self.store_change_kg = 0.0
        self.ordered = Ordered()
        self.most_n = math.inf
        self.feed_n: float | None = None
        self.hammer = 1.0
        rng = np.random.default_rng([seed if task.rock.seed is None else task.rock.seed, 11])
        rock_seed = seed if task.rock.seed is None else task.rock.seed
        strengths = np.random.default_rng([rock_seed, 13])
        self.strata: Strata = strata_of(task.rock, task.depth_m, rng, strengths)
        self._sticking = sticking_places(
            task.rock, task.depth_m, task.rod_length_m, task.feed_n, rng
        )
        self._rng = np.random.default_rng([seed, 12])
        self._numbers = numbers
        self.rods = task.rods_at_start
        self.depth_m = self.bit_m = task.drilled_m
        self._in_hand = 0
        self._since = 0.0
        self._force = 0.0
        """Feed (+) or pull (-) that has built up, N."""
        self._wander = [0.0, 0.0]
        """By how much feed and torque are off what they are meant to be, as shares."""
        self._hold: float | None = None
        self._in_void = False
        self._clogged_s = 0.0
        """How near the bit is to a jam."""
        self._news: list[Happened] = []
        self._count = {
            "rods_added": 0,
            "rods_removed": 0,
            "voids": 0,
            "jams": 0,
            "stuck": 0,
            "freed": 0,
            "rods_lost": 0,
        }
        self._pull_max = 0.0
        self._phases: dict[str, Callable[[float], None]] = {
            "position": self._position,
            "collar": self._drill,
            "drill": self._drill,
            "jam": self._turn_free,
            "add_rod": self._add_rod,
            "extract": self._extract,
            "remove_rod": self._remove_rod,
        }
        self._weigh()

    @property
    def store_kg(self) -> float:
        """Rods in the store, kg."""
        return (
            self.task.rods - self.rods - self._in_hand - self._count["rods_lost"]
        ) * self.task.rod_kg

    @property
    def stored_kg(self) -> float:
        """See drilling.Drilling."""
        return self.store_kg - self.task.stored_kg

    def update(self, t: float, dt: float) -> list[Happened]:
        """See drilling.Drilling."""
        self._news = []
        if t < self.task.start_s or self.phase == "done":
            return self._news
        if self.phase == "idle":
            self._begin("position")
        self.loads.scale_order(0.0)
        self.ordered.thrust = self.ordered.torque = 0.0
        before = self.store_kg
        self._phases[self.phase](dt)
        self._since += dt
        self.store_change_kg += self.store_kg - before
        self._pull_max = max(self._pull_max, self.loads.pull)
        if self.phase == "done":
            self.loads.scale_order(0.0)
            self.ordered.thrust = self.ordered.torque = 0.0
        self._weigh()
        return self._news

    def reseed(self, seed: int) -> None:
        """See drilling.Drilling: how feed and torque wander; the rock stays."""
        self._rng = np.random.default_rng([seed, 12])

    def _begin(self, phase: str) -> None:
        self.phase, self._since = phase, 0.0
        self._news.append(
            {"kind": f"drill_{phase}", "depth_m": round(self.bit_m, 3), "rods": self.rods}
        )

    def _weigh(self) -> None:
        """Where the string's mass is: what stands out of the hole is in the mast, with the rod in
        hand.
        """
        task = self.task
        out_m = min(
            max(self.rods * task.rod_length_m - self.bit_m, 0.0), self.rods * task.rod_length_m
        )
        share = out_m / task.rod_length_m
        self.loads.mast_mass = (share + self._in_hand) * task.rod_kg
        self.loads.string_mass = (self.rods - share) * task.rod_kg
        self.loads.mast_height = 0.5 * max(out_m, self._in_hand * task.rod_length_m)
        self.loads.depth = self.depth_m

    def _towards(self, wanted_n: float, full_n: float, dt: float) -> float:
        """Force of the feed, which changes by at most `full_n` in ramp_s."""
        step = full_n * dt / self.task.ramp_s
        self._force += min(max(wanted_n - self._force, -step), step)
        return self._force

    # ---- the phases, each for one tick -----------------------------------------------------------

    def _position(self, dt: float) -> None:
        touching = self._since > 0.5 * self.task.position_s
        self._push(
            self._towards(
                TOUCH_SHARE * self.task.feed_n if touching else 0.0, self.task.feed_n, dt
            ),
            0.0,
        )
        if self._since >= self.task.position_s:
            self._begin("collar" if self.depth_m < self.task.collar_m else "drill")

    def _drill(self, dt: float) -> None:
        task, kind_bottom = self.task, self.strata.at(self.depth_m)
        gentle = task.collar_share if self.phase == "collar" else 1.0
        self.ordered.thrust = min(gentle * self._wanted_n, self.most_n)
        self.ordered.torque = gentle * task.torque_nm
        if kind_bottom[0] == VOID:
            self._fall(kind_bottom[1], dt)
        else:
            self._eat(kind_bottom[0], gentle, dt)
        self.bit_m = self.depth_m
        if self._clogged_s >= self._numbers.drill.jam_s:
            self._clogged_s = 0.0
            self._count["jams"] += 1
            self._begin("jam")
            return
        if self.depth_m >= task.depth_m - 1e-9:
            self._begin("extract" if task.extract else "done")
        elif self.depth_m >= self.rods * task.rod_length_m - 1e-9:
            self._begin("add_rod")
        elif self.phase == "collar" and self.depth_m >= task.collar_m:
            self._begin("drill")

    @property
    def _wanted_n(self) -> float:
        """Feed that is wanted in full drilling, N."""
        return self.task.feed_n if self.feed_n is None else self.feed_n

    def best_feed_n(self, depth_m: float) -> float:
        """Feed with which the rock at a depth (m) is drilled fastest, N; in a void that of medium
        rock.
        """
        kind, _ = self.strata.at(depth_m)
        drill, rocks = self._numbers.drill, self._numbers.rock
        if kind == VOID:
            return drill.best_feed_n
        energy = getattr(rocks, kind).specific_energy_j_m3 * self.strata.strength_at(depth_m)
        ratio = energy / rocks.medium.specific_energy_j_m3
        return best_feed(drill.best_feed_n, ratio, drill.feed_exponent)

    def _turn_free(self, dt: float) -> None:
        """A jammed bit: the feed lets go, the string is drawn back a little and turned until it
        runs freely.
        """
        self._push(self._towards(0.0, self.task.feed_n, dt), self.task.torque_nm)
        self.ordered.torque = self.task.torque_nm
        if self._since >= self.task.jam_free_s:
            self._begin("collar" if self.depth_m < self.task.collar_m else "drill")

    def _fall(self, bottom_m: float, dt: float) -> None:
        """Through a void: no thrust, no blows, the string runs ahead."""
        if not self._in_void:
            self._in_void = True
            self._count["voids"] += 1
            self._news.append({"kind": "drill_break_through", "depth_m": round(self.depth_m, 3)})
        self._force = 0.0
        limit = min(bottom_m, self.task.depth_m, self.rods * self.task.rod_length_m)
        self.depth_m = min(self.depth_m + self.task.feed_speed_m_s * dt, limit)

    def _eat(self, kind: str, gentle: float, dt: float) -> None:
        """On rock: feed, blows and torque, and the way that the rock allows."""
        task, numbers, rock = self.task, self._numbers.drill, getattr(self._numbers.rock, kind)
        if self._in_void:
            self._in_void = False
            self._news.append({"kind": "drill_landed", "depth_m": round(self.depth_m, 3)})
        feed = min(self._towards(gentle * self._wanted_n, task.feed_n, dt), self.most_n)
        built = feed / task.feed_n
        pressed = feed / self.best_feed_n(self.depth_m)
        over = (pressed - numbers.jam_feed_share) / (2.0 - numbers.jam_feed_share)
        self._clogged_s = max(0.0, self._clogged_s + max(over, -1.0) * dt)
        self._push(feed, rock.torque_share * built * task.torque_nm)
        self._wander = [
            wandering(
                wander, numbers.unsteadiness, numbers.unsteadiness_time_s, dt, self._rng.normal()
            )
            for wander in self._wander
        ]
        feed_share, torque_share = (max(0.0, 1.0 + wander) for wander in self._wander)
        self.loads.feed *= feed_share
        self.loads.torque *= torque_share
        self.loads.blow, self.loads.blow_rate = (
            rock.blow_share * built * self.hammer * task.blow_n,
            task.blow_hz,
        )
        rate = penetration_rate(
            gentle * self.hammer * numbers.blow_energy_j,
            task.blow_hz,
            numbers.energy_share,
            self._numbers.drill_body.hole_diameter_m,
            rock.specific_energy_j_m3 * self.strata.strength_at(self.depth_m),
            thrust_factor(pressed, 1.0),
        )
        self.depth_m = min(self.depth_m + min(rate, task.feed_speed_m_s) * dt, task.depth_m)

    def _add_rod(self, dt: float) -> None:
        share = self._handle(dt)
        if share >= TAKE and self._in_hand == 0:
            self._in_hand = 1
        if share >= 1.0:
            self._in_hand = 0
            self.rods += 1
            self._count["rods_added"] += 1
            self._begin("drill")

    def _remove_rod(self, dt: float) -> None:
        share = self._handle(dt)
        if (
            share >= TAKE
            and self._in_hand == 0
            and self.rods * self.task.rod_length_m > self.bit_m + 1e-9
        ):
            self._in_hand = 1
            self.rods -= 1
        if share >= GIVE:
            self._in_hand = 0
        if share >= 1.0:
            self._count["rods_removed"] += 1
            self._begin("extract")

    def _handle(self, dt: float) -> float:
        """A rod is changed: the feed lets go, the joint is screwed at the end or broken at the
        start; share of it.
        """
        share = (self._since + dt) / self.task.rod_change_s
        self._push(self._towards(0.0, self.task.feed_n, dt), 0.0)
        screws = share > GIVE if self.phase == "add_rod" else share < TAKE
        self.loads.torque = (
            MAKE_UP_SHARE
            * self.task.torque_nm
            * screws
            * (1.0 if self.phase == "add_rod" else -1.0)
        )
        self.ordered.torque = self.loads.torque
        return share

    def _extract(self, dt: float) -> None:
        task = self.task
        if self._hold is None and self._sticking and self.bit_m <= self._sticking[0][0]:
            self._hold = self._sticking.pop(0)[1]
            self._since = 0.0
            self._count["stuck"] += 1
            self._news.append(
                {"kind": "rod_stuck", "depth_m": round(self.bit_m, 3), "hold_n": round(self._hold)}
            )
        if self._hold is not None:
            self._free(dt)
            return
        self._push(self._towards(-task.pull_n, task.feed_n, dt), 0.0)
        goal = (self.rods - 1) * task.rod_length_m
        lowest = max(goal, self._sticking[0][0] if self._sticking else 0.0)
        if self._force <= -0.5 * task.pull_n:
            self.bit_m = max(self.bit_m - task.feed_speed_m_s * dt, lowest)
        if self.bit_m <= goal + 1e-9:
            self._begin("remove_rod" if self.rods > 1 else "done")

    def _free(self, dt: float) -> None:
        """Pull harder, jerk and hammer until the string comes, or leave it."""
        task = self.task
        assert self._hold is not None
        pull = -self._towards(-task.pull_max_n, task.pull_max_n / 10.0, dt)
        jerk = 1.0 - JERK_SHARE + JERK_SHARE * math.sin(2.0 * math.pi * JERK_HZ * self._since)
        self._push(-pull * jerk, 0.0)
        self.loads.blow, self.loads.blow_rate = 0.5 * task.blow_n, task.blow_hz
        self._hold *= math.exp(-dt / WEAR_S)
        if pull * jerk > self._hold:
            self._hold = None
            self._force = -task.pull_n
            self._count["freed"] += 1
            self._news.append(
                {"kind": "rod_freed", "depth_m": round(self.bit_m, 3), "pull_n": round(pull * jerk)}
            )
        elif self._since > task.give_up_s:
            self._count["rods_lost"] += self.rods
            self._news.append({"kind": "rods_lost", "rods": self.rods})
            self.rods, self.bit_m, self._force = 0, 0.0, 0.0
            self._begin("done")

    def _push(self, force_n: float, torque_nm: float) -> None:
        """Feed (+) or pull (-) and torque of this tick; but for drilling, the controls ordered just
        that.
        """
        self.loads.feed, self.loads.pull = max(force_n, 0.0), max(-force_n, 0.0)
        self.loads.torque = torque_nm
        if self.phase not in ("collar", "drill"):
            self.ordered.thrust = force_n

    def summary(self) -> dict[str, Any]:
        """See drilling.Drilling."""
        layers = zip(self.strata.kinds, self.strata.bottoms_m, strict=True)
        found = {
            **self._count,
            "pull_max_n": self._pull_max,
            "phase": self.phase,
            "layers": [{"kind": kind, "bottom_m": bottom} for kind, bottom in layers],
        }
        return {"hole_depth_m": self.depth_m, "drill": found}

    def progress(self) -> dict[str, Any]:
        """See drilling.Drilling."""
        return {
            "done": self.phase == "done",
            "phase": self.phase,
            "hole_depth_m": self.depth_m,
            "hole_depth_wanted_m": self.task.depth_m,
        }
