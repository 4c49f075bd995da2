"""Walking: shift the body, swing a leg, seek the ground by the force estimate, let the foot carry,
and again.

Feet and body are reckoned in the path frame: parallel to the slope, where the body frame stood at
the start. What comes next is planned in walk_plan.py, in the manner of style.py; where feet and
body may go in footholds.py, how fast in pace.py, how a leg swings and its foot finds the ground in
swing.py, what is known of that ground in known_ground.py, how standing feet keep the body level in
posture.py, what the ropes do in rope_hold.py and strokes.py; this file is the order of events.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from testbed.control.gait import BelievedStart, Command, Measured
from testbed.control.gaits.crawl.footholds import Footholds
from testbed.control.gaits.crawl.pace import Pace
from testbed.control.gaits.crawl.posture import Levelling, explained
from testbed.control.gaits.crawl.rope_hold import RopeHold
from testbed.control.gaits.crawl.strokes import Strokes
from testbed.control.gaits.crawl.style import SEAT_S
from testbed.control.gaits.crawl.swing import IN_THE_AIR, Activity, BodyWay, GroundSearch, Phase
from testbed.control.gaits.crawl.walk_plan import Stride, WalkPlan
from testbed.errors import InputError
from testbed.formats.arrays import Array, Flags
from testbed.machine.names import LEGS, ROTATION, VERTICAL
from testbed.robot.model import attitude_gravity
from testbed.scenario.tasks import Crawl

UNLOADED_SHARE = 0.3
"""A foot is off the ground when it carries less than this share of the load that would tell its
touch (E).
"""
SEATED_SHARE = 0.8
"""A seated foot carries this share of the load that told its touch; one that does not has met
nothing (E).
"""
SEARCHES = 3
"""A foot that has met nothing searches on, so many times in all (E)."""
LAST_SEAT = 4.0
"""The last time a foot is seated for up to so many times the usual (E)."""
EARLY_TOUCH_SHARE = 0.6
"""From this share of a swing on the foot may meet ground; before, its load in the air is learnt
(E).
"""
SUPPLY_LOW_SHARE = 5.5 / 9.0
"""The body stands still below this share of the pressure at which the supply stands ready (E)."""
SUPPLY_FULL_SHARE = 7.0 / 9.0
"""The body moves at full speed above this share of it (E)."""

LAG_FREE, LAG_MOST = 0.02, 0.06
"""A swing slows down when its leg lags by the first of these, and waits for it at the second: m of
radial joint, rad of a leg of about a metre (E).
"""
EASE_S = 0.1
"""Where strokes are reckoned with, the body sets off and comes to rest within this time (E)."""
PATIENCE_S, CREEPS = 3.0, 0.1
"""A swing that has waited for so long goes on at this share of its speed: what holds the foot may
be a step of the rock beside it, which it has to rise above (E).
"""


class CrawlGait:
    """Set points of a walk. A Gait."""

    def __init__(
        self,
        task: Crawl,
        start: BelievedStart,
        footholds: Footholds,
        pace: Pace,
        ropes: RopeHold,
        strokes: Strokes,
    ) -> None:
        """Raises InputError for a stride that is out of reach, before anything moves."""
        self.task = task
        self._legs, self._footholds, self._ropes = start.legs, footholds, ropes
        self._strokes = strokes
        self._ready_pa = start.robot.machine.power_unit.ready_pressure_pa
        self._feet = footholds.home.copy()
        self._body, self._joints = np.zeros(3), start.joints
        total = float(start.load_n.sum())
        offset = np.zeros(3)
        offset[:2] = start.load_n @ self._feet[:, :2] / total - self._feet[:, :2].mean(axis=0)
        self._lightness = min(total / footholds.weight_n, 1.0)
        machine = start.robot.machine
        self._scale = machine.scale
        self._ground = GroundSearch(total, self._lightness, task.ground_steps_m, self._scale)
        self._plan = WalkPlan(task, footholds, pace, ropes, self._ground, offset)
        self._levelling: Levelling | None = None
        self._queue: list[Phase] = []
        self._phase: Phase | None = None
        self._clock = self._way_clock = 0.0
        self._seated_s = np.inf
        self._waited_s = 0.0
        """Since a foot last began to be seated."""
        self._way = BodyWay(self._body, self._body, 1.0)
        self._ready = 1.0
        self._went_m_s = np.zeros(3)
        """(3) speed of the body's set points in the last tick."""
        self._speed_m_s, self._since_way_s = np.zeros(3), 0.0
        """(3) the same when the last way began, and how long ago that was."""
        self._wanted: Stride | None = None
        self.steps_done = 0
        self.groups = 0
        """Groups of swings begun so far."""
        self.done = self._returning = False
        try:
            self._plan.rehearse()
        except InputError as error:

            def rehearse(other: Crawl, aside: float) -> None:
                pulls, off = ropes.turned(aside), offset * np.array([1.0, aside, 1.0])
                drawn_m = pulls.draws_aside_m(self._feet, total)
                if abs(drawn_m) > abs(off[1]):  # feet that were at their limit show less of it
                    off[1] = drawn_m
                WalkPlan(other, footholds, pace, pulls, self._ground, off).rehearse()

            raise explained(error, task, start, rehearse) from error

    @property
    def way_m(self) -> float:
        """How far the body has gone in the direction of travel, by its set points."""
        return float(self._plan.ahead @ self._body)

    @property
    def margins_n(self) -> list[float]:
        """Planned wrench margin of every group of swings, N."""
        return self._plan.margins_n

    @property
    def moved_m(self) -> Array:
        """(3) how far the body has gone by its set points, path frame."""
        return self._body.copy()

    @property
    def between(self) -> bool:
        """Whether one motion is over and the next has not begun, with all feet meant to stand."""
        swinging = self._queue and self._queue[0].doing in (
            Activity.SWING,
            Activity.SEARCH,
            Activity.SEAT,
        )
        return self._phase is None and not swinging

    def end_walk(self) -> int:
        """Make no more swings than are begun, then bring the body over its feet; returns how many
        are left.
        """
        begun = sum(phase.doing is Activity.SEAT for phase in self._queue)
        if self._phase is not None and self._phase.doing is Activity.SEAT:
            begun += 1
        left = max(self.task.steps - self.steps_done - begun, 0)
        self.task = self.task.model_copy(update={"steps": self.task.steps - left})
        self._plan.follow(self.task)
        return left

    def progress(self, t: float) -> dict[str, Any]:
        """What of the walk is made."""
        del t
        steps = {"steps_made": self.steps_done, "steps_wanted": self.task.steps}
        return {"done": self.done, **steps, "way_m": self.way_m}

    @property
    def between_groups(self) -> bool:
        """Whether the next group of swings is still to be planned."""
        return self._phase is None and not self._queue

    def choose(self, stride: Stride, haste: float) -> None:
        """Let the next group of swings be `stride`, made with `haste` (see Pace). One that is out
        of reach is not made: the group is then that of the task.
        """
        self._wanted = stride
        self._plan.haste = haste

    def command(self, t: float, dt: float, measured: Measured) -> Command:
        """See Gait."""
        levelling, before = self._begun(measured), self._body
        stance = np.ones(len(LEGS), dtype=bool)
        if t >= self.task.start_s and not self.done:
            self._go(dt, measured, stance, levelling)
        at_it = self._phase is not None and self._phase.doing is Activity.SEAT
        seating = at_it or self._seated_s < SEAT_S
        levelling.correct(self._feet, self._body, stance, measured, seating, dt)
        self._joints = self._footholds.joints(self._feet, self._body)
        self._went_m_s = (self._body - before) / dt
        return Command(
            joints=self._joints,
            rope_rates_m_s=self._rope_rates_m_s(before, dt, measured),
            stance=stance,
        )

    def _rope_rates_m_s(self, before: Array, dt: float, measured: Measured) -> Array:
        """(2) what the ropes are told, the body having been at `before` (3) dt s ago."""
        ropes, tension, strokes = self._ropes, measured.rope_tension, self._strokes
        if not self._plan.manner.strokes:
            return ropes.rates_m_s(self._body, before, dt, tension)
        owed_n = -strokes.owed_m * strokes.stiffness_ea_n / ropes.lengths_m(self._body)
        rates = ropes.rates_m_s(self._body, before, dt, tension, owed_n)
        strokes.follow(rates, tension, measured.supply_pressure, dt)
        return rates

    def _begun(self, measured: Measured) -> Levelling:
        """What keeps the body level; made at the first tick, when the attitude is known."""
        if self._levelling is None:
            roll, pitch, _ = measured.attitude
            self._footholds.stand_under(attitude_gravity(float(roll), float(pitch)))
            self._levelling = Levelling(measured.attitude, self._lightness, self._scale)
            self._levelling.stand_on(self._feet)
        return self._levelling

    def _go(self, dt: float, measured: Measured, stance: Flags, levelling: Levelling) -> None:
        """Go on by dt s: begin the next phase where one is over, move body and foot, take swinging
        legs off `stance`.
        """
        phase = self._phase
        if phase is None:
            phase = self._phase = self._next_phase()
            levelling.stand_on(self._feet)
        self._clock += dt * (
            self._keeping_up(dt, measured) if phase.doing is Activity.SWING else 1.0
        )
        if self._way_clock < self._way.duration_s:
            self._way_clock += dt * self._readiness(dt, measured)
        self._since_way_s += dt
        self._body = self._way.at(self._way_clock) - self._run_out_m()
        share = self._clock / phase.duration_s
        self._seated_s += dt
        if phase.doing in IN_THE_AIR:
            stance[phase.leg] = False
        if self._is_over(phase, share, dt, measured):
            self._phase = None
            self.done = self._returning and not self._queue

    def _next_phase(self) -> Phase:
        if not self._queue:
            self._queue = self._next_group()
            self.groups += 1
            self._returning = self.steps_done >= self.task.steps
        phase, self._clock = self._queue.pop(0), 0.0
        if phase.doing is Activity.SEAT:
            self._seated_s = 0.0
        last = all(other.swing is None for other in self._queue[1:])
        if phase.doing is Activity.UNLOAD and last and self._plan.manner.strokes:
            # Better now than in the next shift, for which the legs would have to wait.
            shift = self._plan.shifts_m(self._way.end - self._body)
            if not self._strokes.last(shift):
                self._strokes.renew()
        if phase.way is not None:
            self._way, self._way_clock, self._since_way_s = phase.way, 0.0, 0.0
            if self._plan.manner.strokes:  # the last way may not quite be over
                self._speed_m_s = self._went_m_s
                self._way = replace(phase.way, start=self._body + self._run_out_m())
        if phase.swing is not None:
            # Foot and body may not be quite where they were meant to be.
            then = self._way.at(self._way_clock + phase.duration_s)
            here = {"start": self._feet[phase.leg].copy(), "body_from": self._body}
            phase.swing = self._plan.timed(replace(phase.swing, body_to=then, **here), self._feet)
            phase.duration_s = phase.swing.duration_s
        return phase

    def _next_group(self) -> list[Phase]:
        """The phases of the next group of swings."""
        own = Stride(self.task.step_length_m, self.task.swing_height_m)
        if self._wanted is not None and self._wanted != self._plan.stride:
            self._plan.choose(self._wanted, self.steps_done)
        try:
            return self._plan.next_phases(self._feet, self._body, self.steps_done)
        except InputError:
            if self._plan.stride == own:
                raise
            self._plan.choose(own, self.steps_done)
            return self._plan.next_phases(self._feet, self._body, self.steps_done)

    def _readiness(self, dt: float, measured: Measured) -> float:
        """0 to 1: how fast the body may move for the ropes' and the pump's sake."""
        share = measured.supply_pressure / self._ready_pa
        supply = (share - SUPPLY_LOW_SHARE) / (SUPPLY_FULL_SHARE - SUPPLY_LOW_SHARE)
        in_the_air = self._phase is not None and self._phase.doing in IN_THE_AIR
        part = self._plan.manner.three_feet if in_the_air else 1.0
        ropes = self._ropes.readiness(self._body, measured.rope_tension, part)
        ready = min(ropes, max(supply, 0.0))
        if not self._plan.manner.strokes:
            return ready
        ready, most = min(ready, self._strokes.readiness()), dt / EASE_S
        self._ready = min(max(ready, self._ready - most), self._ready + most)
        return self._ready

    def _run_out_m(self) -> Array:
        """(3) how far the body still has to go for the speed that it had when its way began, which
        runs out as the new one rises.
        """
        within_s = self._way.ramp * self._way.duration_s
        left = max(1.0 - self._since_way_s / within_s, 0.0)
        return 0.5 * within_s * left * left * self._speed_m_s

    def _keeping_up(self, dt: float, measured: Measured) -> float:
        """0 to 1: how fast a swing may go on for its leg's sake."""
        assert self._phase is not None
        across = slice(ROTATION[self._phase.leg], VERTICAL[self._phase.leg])
        lag = float(np.abs(self._joints[across] - measured.position[across]).max())
        share = min(max((LAG_MOST - lag) / (LAG_MOST - LAG_FREE), 0.0), 1.0)
        self._waited_s = self._waited_s + dt if share == 0.0 else 0.0
        return CREEPS if self._waited_s > PATIENCE_S else share

    def _is_over(self, phase: Phase, share: float, dt: float, measured: Measured) -> bool:
        """Move the phase's foot by dt s; whether the phase has done what it is there for."""
        load_n = float(measured.load[phase.leg])
        if phase.doing is Activity.UNLOAD:
            self._feet[phase.leg, 2] += self._scale.speed * self._plan.manner.unload_m_s * dt
            return share >= 1.0 or load_n < UNLOADED_SHARE * self._ground.touch_n
        if phase.doing is Activity.SWING:
            return self._swing(phase, share, dt, measured)
        if phase.doing is Activity.SEARCH:
            return self._search(phase, dt, measured)
        if phase.doing is Activity.SEAT:
            return share >= 1.0 and self._seated(phase, share, load_n)
        lead_s = self._plan.manner.lead_s if self._queue else 0.0
        return self._way_clock >= self._way.duration_s - lead_s

    def _seated(self, phase: Phase, share: float, load_n: float) -> bool:
        """True where a seat is over: the foot carries, or is to search on, or has been given time
        enough.
        """
        if load_n < SEATED_SHARE * self._ground.touch_n:
            lowest = self._ground.lowest_m(phase.ground)
            if phase.tries < SEARCHES and self._feet[phase.leg, 2] > lowest:
                self._queue[:0] = self._plan.search_phases(phase.leg, phase.ground, phase.tries + 1)
                self._ground.begin(load_n)
                return True
            if self._clock < LAST_SEAT * SEAT_S:
                return False
        elif self._plan.manner.prints:
            self._plan.known.stood(self._feet[phase.leg])
        self.steps_done += 1
        return True

    def _swing(self, phase: Phase, share: float, dt: float, measured: Measured) -> bool:
        """Carry the foot over; true at its end, or where ground comes before it is sought."""
        assert phase.swing is not None
        leg, before = phase.leg, float(self._feet[phase.leg, 2])
        load_n = float(measured.load[leg])
        left_s = phase.swing.duration_s - self._clock
        then = self._way.at(self._way_clock + left_s)
        self._feet[leg] = phase.swing.foot(self._clock, self._body, then)
        if share <= EARLY_TOUCH_SHARE:
            self._ground.begin(load_n)
        elif self._ground.met(load_n, 0.0, dt):
            return self._touch(leg, measured)
        # The search takes over at its own speed: a foot that stopped and set off again would turn
        # its friction over.
        height = float(self._feet[leg, 2])
        speed_m_s = self._ground.speed_m_s(height, phase.ground, self._plan.search)
        slow = before - height < speed_m_s * dt
        return share >= 1.0 or (share > phase.swing.arrival and slow)

    def _search(self, phase: Phase, dt: float, measured: Measured) -> bool:
        """Lower the foot until its load rises, or as far as the search goes."""
        leg, ground = phase.leg, self._ground
        height = float(self._feet[leg, 2])
        self._feet[leg, 2] -= ground.speed_m_s(height, phase.ground, self._plan.search) * dt
        met = ground.met(float(measured.load[leg]), self._clock, dt)
        if met or self._feet[leg, 2] <= ground.lowest_m(phase.ground):
            return self._touch(leg, measured)
        return False

    def _touch(self, leg: int, measured: Measured) -> bool:
        """The foot stays where the encoders see it; what is left of this leg's swing is not needed
        any more.
        """
        if self._queue and self._queue[0].leg == leg and self._queue[0].doing is Activity.SEARCH:
            self._queue.pop(0)
        seen = self._legs.feet(measured.position - self._footholds.nought)
        self._feet[leg] = self._body + seen[leg]
        return True
