"""Walking: shift the body, swing a leg, seek the ground by the force estimate, let the foot carry, and again.

Feet and body are reckoned in the path frame: parallel to the slope, where the body frame stood at the start. Where they
go is planned in footholds.py, how fast in pace.py, how a leg swings in swing.py, how its foot finds the ground in
ground_search.py, how standing feet keep the body level in levelling.py, what the ropes do in rope_hold.py; this file is
the order of events.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from testbed.control.programs.footholds import Footholds
from testbed.control.programs.ground_search import GroundSearch
from testbed.control.programs.levelling import Levelling
from testbed.control.programs.pace import Pace, progress
from testbed.control.programs.references import Command, Measured
from testbed.control.programs.rope_hold import RopeHold
from testbed.control.programs.swing import Swing
from testbed.errors import InputError
from testbed.machine.names import LEGS
from testbed.robot.kinematics import LegKinematics
from testbed.robot.model import attitude_gravity
from testbed.scenario.tasks import Crawl

Array = NDArray[np.float64]
SEAT_S = 0.5
"""How long a foot is seated after it has met the ground."""
UNLOAD_S, UNLOAD_M_S, UNLOADED_SHARE = 1.0, 0.005, 0.3
"""Before it swings, a foot is raised at this speed until it carries less than this share of the load that would tell
its touch, or for so long: a foot that is torn off makes the one across from it jump."""
SEATED_SHARE, SEAT_MOST, SEARCHES = 0.8, 4.0, 3
"""A seated foot carries this share of the load that told its touch. One that does not after SEAT_S has met nothing: it
searches on, so many times in all; the last time it gets so many times SEAT_S."""
WAY_SAMPLES = 20
WAITS = np.linspace(0.0, 1.0, 5)
"""Where the next swings are out of reach, the body falls behind its plan by the first of these shares of its next way
that brings them within reach: on rock a foot does not always stand where it was meant to."""
REHEARSED = 8
"""Swings that are planned before the first one is made."""
SUPPLY_LOW_PA, SUPPLY_FULL_PA = 5.5e6, 7.0e6
"""The body stands still below the first supply pressure and moves at full speed above the second (E)."""


class Doing(Enum):
    """What the robot is at."""

    SHIFT = "shift"
    UNLOAD = "unload"
    SWING = "swing"
    SEARCH = "search"
    SEAT = "seat"


@dataclass
class Phase:
    """One piece of the walk. Places are (3,) in the path frame, m."""

    doing: Doing
    duration_s: float
    body_from: Array
    body_to: Array
    leg: int = -1
    swing: Swing | None = None
    old_m: float = 0.0
    """Height of the old foothold, path frame: a search begins above it and ends below it."""
    tries: int = 1
    """Which search for this foothold it is, or was before this seat."""
    travels: bool = field(init=False)
    ends: list[tuple[float, float]] = field(init=False)
    """The body's start and end along x, y and z."""

    def __post_init__(self) -> None:
        self.ends = list(zip(self.body_from.tolist(), self.body_to.tolist(), strict=True))
        self.travels = any(start != end for start, end in self.ends)


class CrawlProgram:
    """Set points of a walk. See Program."""

    def __init__(
        self,
        task: Crawl,
        start: Array,
        legs: LegKinematics,
        footholds: Footholds,
        pace: Pace,
        ropes: RopeHold,
        loads_n: Array,
    ) -> None:
        """start (12): joints at the start; loads_n (4): the feet's loads then."""
        self.task, self._legs, self._footholds, self._pace, self._ropes = (
            task,
            legs,
            footholds,
            pace,
            ropes,
        )
        self._feet = footholds.home.copy()
        self._body = np.zeros(3)
        total = float(loads_n.sum())
        offset = loads_n @ self._feet[:, :2] / total - self._feet[:, :2].mean(axis=0)
        self._offset = np.array([*offset, 0.0])
        self._lightness = min(total / footholds.weight_n, 1.0)
        self._ground = GroundSearch(total, self._lightness, task.ground_steps_m)
        self._levelling: Levelling | None = None
        heading = np.radians(task.heading_deg)
        self._ahead = np.array([np.cos(heading), np.sin(heading), 0.0])
        self._groups = 2 if task.gait == "two_phase" else 1
        self._queue: list[Phase] = []
        self._phase: Phase | None = None
        self._clock = 0.0
        self._behind_m = 0.0
        self._now = Command(reference=start.copy())
        self.steps_done = 0
        self.done = self._returning = False
        self.margins_n: list[float] = []
        """Planned wrench margin of every group of swings, N."""
        self._rehearse()

    @property
    def way_m(self) -> float:
        """How far the body has gone in the direction of travel, by its set points."""
        return float(self._ahead @ self._body)

    def update(self, t: float, dt: float, measured: Measured) -> Command:
        """See Program."""
        if self._levelling is None:
            roll, pitch, _ = measured.attitude_rad
            self._footholds.stand_under(attitude_gravity(float(roll), float(pitch)))
            self._levelling = Levelling(measured.attitude_rad, self._lightness)
            self._levelling.stand_on(self._feet)
        command, before = self._now, self._body
        command.carrying[:] = True
        if t >= self.task.start_s and not self.done:
            self._go(dt, measured, command, self._levelling)
        seating = self._phase is not None and self._phase.doing is Doing.SEAT
        self._levelling.correct(self._feet, self._body, command.carrying, measured, seating, dt)
        self._footholds.rates(self._feet, self._body, command.reference, dt, command.rate)
        self._ropes.rates_m_s(
            self._body, before, dt, measured.rope_tension_n, command.rope_rate_m_s
        )
        return command

    # ---- the order of events -------------------------------------------------------------------------------

    def _go(self, dt: float, measured: Measured, command: Command, levelling: Levelling) -> None:
        if self._phase is None:
            if not self._queue:
                self._plan()
            self._phase, self._clock = self._queue.pop(0), 0.0
            if self._phase.swing is not None:
                self._phase.swing = replace(
                    self._phase.swing, start=self._feet[self._phase.leg].copy()
                )
            levelling.stand_on(self._feet)
        phase = self._phase
        self._clock += dt * (self._readiness(measured) if phase.travels else 1.0)
        share = self._clock / phase.duration_s
        self._body = phase.body_from
        if phase.travels:
            way = progress(share)
            self._body = np.array([start + (end - start) * way for start, end in phase.ends])
        over = share >= 1.0
        if phase.doing is Doing.UNLOAD:
            command.carrying[phase.leg] = False
            self._feet[phase.leg, 2] += UNLOAD_M_S * dt
            over = over or bool(measured.load_n[phase.leg] < UNLOADED_SHARE * self._ground.touch_n)
        elif phase.doing is Doing.SWING:
            over = self._swing(phase, share, dt, measured, command)
        elif phase.doing is Doing.SEARCH:
            over = self._search(phase, dt, measured, command)
        elif phase.doing is Doing.SEAT:
            over = over and self._seated(phase, share, measured)
        if over:
            self._phase = None
            self.done = self._returning and not self._queue

    def _readiness(self, measured: Measured) -> float:
        supply = (measured.supply_pressure_pa - SUPPLY_LOW_PA) / (SUPPLY_FULL_PA - SUPPLY_LOW_PA)
        return min(self._ropes.readiness(self._body, measured.rope_tension_n), max(supply, 0.0))

    def _seated(self, phase: Phase, share: float, measured: Measured) -> bool:
        """True where a seat is over: the foot carries, or is to search on, or has been given time enough."""
        load = float(measured.load_n[phase.leg])
        if load < SEATED_SHARE * self._ground.touch_n:
            if phase.tries < SEARCHES and self._feet[phase.leg, 2] > self._ground.lowest_m(
                phase.old_m
            ):
                self._queue[:0] = self._search_phases(
                    phase.leg, phase.body_to, phase.old_m, phase.tries + 1
                )
                self._ground.begin(load)
                return True
            if share < SEAT_MOST:
                return False
        self.steps_done += 1
        return True

    def _swing(
        self, phase: Phase, share: float, dt: float, measured: Measured, command: Command
    ) -> bool:
        """Carry the foot over; true at its end, or where ground comes before it is sought."""
        leg, load, before = (
            phase.leg,
            float(measured.load_n[phase.leg]),
            float(self._feet[phase.leg, 2]),
        )
        command.carrying[leg] = False
        assert phase.swing is not None
        self._feet[leg] = phase.swing.foot(self._clock, self._body)
        if share <= 0.6:
            self._ground.begin(load)
        elif self._ground.met(load, 0.0, dt):
            return self._touch(leg, measured)
        # The search takes over at its own speed: a foot that stopped and set off again would turn its friction over.
        speed = self._ground.speed_m_s(
            float(self._feet[leg, 2]), float(phase.swing.end[2]) - self._ground.above_m
        )
        return share >= 1.0 or (
            share > phase.swing.arrival and before - self._feet[leg, 2] < speed * dt
        )

    def _search(self, phase: Phase, dt: float, measured: Measured, command: Command) -> bool:
        """Lower the foot until its load rises, or as far as the search goes."""
        leg, load = phase.leg, float(measured.load_n[phase.leg])
        command.carrying[leg] = False
        self._feet[leg, 2] -= self._ground.speed_m_s(float(self._feet[leg, 2]), phase.old_m) * dt
        if self._ground.met(load, self._clock, dt) or self._feet[leg, 2] <= self._ground.lowest_m(
            phase.old_m
        ):
            return self._touch(leg, measured)
        return False

    def _touch(self, leg: int, measured: Measured) -> bool:
        """The foot stays where the encoders see it; what is left of this leg's swing is not needed any more."""
        if self._queue and self._queue[0].leg == leg and self._queue[0].doing is Doing.SEARCH:
            self._queue.pop(0)
        position = measured.position.copy() - self._footholds.nought
        self._feet[leg, 2] = self._body[2] + self._legs.feet(position)[leg, 2]
        self._feet[leg, :2] = self._body[:2] + self._legs.feet(position)[leg, :2]
        return True

    # ---- planning ------------------------------------------------------------------------------------------

    def _rehearse(self) -> None:
        """Plan the first swings without making them, so that a stride out of reach is refused before anything moves."""
        feet = self._feet.copy()
        while self.steps_done < min(self.task.steps, REHEARSED):
            self._plan(WAITS[:1])
            for phase in self._queue:
                if phase.swing is not None:
                    self._feet[phase.leg, :2] = phase.swing.end[:2]
                    self.steps_done += 1
            self._body = self._queue[-1].body_to
            self._queue.clear()
        self._feet, self._body, self.steps_done = feet, np.zeros(3), 0
        self.margins_n.clear()

    def _plan(self, waits: Array = WAITS) -> None:
        """The next shift and the swings after it; at the end the way back over the middle of the feet."""
        task, left = self.task, self.task.steps - self.steps_done
        if left <= 0:
            self._returning = True
            self._queue.append(self._shift(self._middle()))
            return
        group = [
            LEGS.index(task.order[(self.steps_done + k) % 4])
            for k in range(min(self._groups, left))
        ]
        behind = self._behind_m
        for share in waits:
            self._behind_m = behind + share * task.step_length_m * self._groups / 4
            try:
                self._plan_group(group)
            except InputError:
                if share == waits[-1]:
                    raise
            else:
                return

    def _plan_group(self, group: list[int]) -> None:
        """The next shift and the swings of the legs in `group`; InputError where they are out of reach."""
        task, middle = self.task, self._middle()
        stride = task.step_length_m * self._ahead
        part = stride * self._groups / 4
        # Feet are put down half a stride ahead of their homes, counted from where the body stands.
        centre = self._travelled(middle)
        places = [(leg, self._foothold(leg, centre + 0.5 * stride)) for leg in group]
        away = -self._footholds.home[group].mean(axis=0) * np.array([1.0, 1.0, 0.0])
        if (
            task.gait == "wave"
        ):  # a body that goes on all the time sways across its way, not along it
            away = away - self._ahead * float(self._ahead @ away)
        side = away / np.linalg.norm(away)
        tensions, ropes = self._ropes.wanted_n(self._body), self._ropes.directions(self._body)
        goal, margin = self._footholds.body_goal(
            middle - self._offset, side, self._feet, places, part, tensions, ropes
        )
        self.margins_n.append(margin)
        self._queue.append(self._shift(goal))
        creep = np.zeros(3) if task.gait == "two_phase" else 0.5 * part
        feet = self._feet.copy()
        for leg, place in places:
            self._queue += self._swing_phases(
                leg, feet[leg].copy(), place, goal, goal + creep, feet
            )
            feet[leg] = place

    def _travelled(self, middle: Array) -> Array:
        return np.asarray(self._ahead * float(self._ahead @ middle))

    def _middle(self) -> Array:
        """Where the body belongs over its feet: level with them, and along the way where the plan has it by now."""
        feet, home = self._feet.mean(axis=0), self._footholds.home.mean(axis=0)
        middle = feet - home
        if self.steps_done < self.task.steps:
            way = self.task.step_length_m * (self.steps_done // self._groups) * self._groups / 4
            middle[:2] = ((way - self._behind_m) * self._ahead)[:2]
        return np.asarray(middle)

    def _foothold(self, leg: int, shift: Array) -> Array:
        place = self._footholds.home[leg] + shift
        place[2] = self._feet[leg, 2]
        return np.asarray(place)

    def _shift(self, goal: Array) -> Phase:
        start = self._body.copy()
        shares = np.linspace(0.0, 1.0, WAY_SAMPLES)
        bodies = start + shares[:, None] * (goal - start)
        joints = np.array([self._footholds.joints(self._feet, body) for body in bodies])
        ropes = np.array([self._ropes.lengths_m(body) for body in bodies])
        if not self._ropes.tension_n.any():
            ropes[:] = 0.0
        rest = 0.0 if self.task.period_s is None else 0.5 * self._groups * self.task.period_s
        return Phase(Doing.SHIFT, max(self._pace.shift_s(joints, ropes), rest, 0.3), start, goal)

    def _swing_phases(
        self, leg: int, start: Array, place: Array, body: Array, body_to: Array, feet: Array
    ) -> list[Phase]:
        """Swing, search and seat one leg, with the body going from `body` to `body_to` during the swing."""
        above = place + np.array([0.0, 0.0, self._ground.above_m])
        high = max(float(start[2]), float(above[2])) + self.task.swing_height_m
        swing = Swing(self._legs, leg, start, above, body, body_to, high).timed(self._pace)
        rest = 0.0 if self.task.period_s is None else 0.5 * self.task.period_s - SEAT_S
        swing = swing.slower(max(self._least_s(swing, feet), rest, 0.5) / swing.duration_s)
        return [
            Phase(Doing.UNLOAD, UNLOAD_S, body, body, leg),
            Phase(Doing.SWING, swing.duration_s, body, body_to, leg, swing),
            *self._search_phases(leg, body_to, float(place[2]), 1),
        ]

    def _search_phases(self, leg: int, body: Array, old_m: float, tries: int) -> list[Phase]:
        """Search for the ground and seat the foot."""
        return [
            Phase(Doing.SEARCH, np.inf, body, body, leg, None, old_m, tries),
            Phase(Doing.SEAT, SEAT_S, body, body, leg, None, old_m, tries),
        ]

    def _least_s(self, swing: Swing, feet: Array) -> float:
        """Least time for a swing: its own, or what pump and standing legs need while the body goes on."""
        joints = []
        for share in np.linspace(0.0, 1.0, 2 * WAY_SAMPLES):
            moved = swing.body_from + progress(float(share)) * (swing.body_to - swing.body_from)
            way = feet.copy()
            way[swing.leg] = swing.foot(float(share) * swing.duration_s, moved)
            joints.append(self._footholds.joints(way, moved))
        return max(swing.duration_s, self._pace.swing_s(np.array(joints)))
