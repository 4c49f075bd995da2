"""The crawl: shift the body, swing a leg, search the ground by the force estimate, load the foot,
repeat.

Positions of feet and body are given in the path frame, which is parallel to the slope and has its
origin where the body frame was at the start. This file executes the phases in order. The rest of
the gait is elsewhere: the next phases (walk_plan.py) and their style (style.py), where feet and
body may go (footholds.py), speed (pace.py), swing and ground search (swing.py), knowledge of the
ground (known_ground.py), keeping the body level (posture.py), ropes (rope_hold.py, strokes.py).
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
from testbed.control.gaits.crawl.style import SEAT_S, STYLES
from testbed.control.gaits.crawl.swing import IN_THE_AIR, Activity, BodyWay, GroundSearch, Phase
from testbed.control.gaits.crawl.walk_plan import Stride, WalkPlan
from testbed.errors import InputError
from testbed.formats.arrays import Array, Flags
from testbed.machine.names import LEGS, ROTATION, VERTICAL
from testbed.robot.model import attitude_gravity
from testbed.scenario.tasks import Crawl

UNLOADED_SHARE = 0.3
"""A foot counts as off the ground below this share of the load that indicates touchdown (E)."""
SEATED_SHARE = 0.8
"""A foot that carries less than this share of its touchdown load after seating has not met the
ground (E).
"""
SEARCHES = 3
"""Most searches of a foot that has not met the ground (E)."""
LAST_SEAT = 4.0
"""Longest duration of the last seating, in units of the usual one (E)."""
EARLY_TOUCH_SHARE = 0.6
"""Share of a swing from which on ground contact is possible; until then the foot's load in the air
is learnt (E).
"""
SUPPLY_LOW_SHARE = 5.5 / 9.0
"""The body stops below this share of the pressure at which the supply is ready (E)."""
SUPPLY_FULL_SHARE = 7.0 / 9.0
"""The body moves at full speed above this share of it (E)."""

LAG_FREE, LAG_MOST = 0.02, 0.06
"""A swing slows down if its leg lags by more than the first value and waits at the second: m of the
radial joint, rad of the rotation of a leg of about a metre (E).
"""
EASE_S = 0.1
"""Time in which the body starts and stops, if the strokes of the ropes are planned, s (E)."""
PATIENCE_S, CREEPS = 3.0, 0.1
"""A swing that has waited for so long, s, continues at this share of its speed: the foot may hang
below a step of the rock, above which it has to rise (E).
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
        self._legs, self._footholds = start.legs, footholds
        self._strokes = strokes
        self._ready_pa = start.robot.machine.power_unit.ready_pressure_pa
        self._feet = footholds.home.copy()
        self._body, self._joints = np.zeros(3), start.joints
        total = float(start.load_n.sum())
        offset = np.zeros(3)
        offset[:2] = start.load_n @ self._feet[:, :2] / total - self._feet[:, :2].mean(axis=0)
        self._lightness = min(total / footholds.weight_n, 1.0)
        share = STYLES[task.gait].trimmed(self._lightness)
        if share > 0.0 and ropes.tension_n.any():
            ropes, back_m = ropes.trimmed(share * offset[:2], self._feet, total)
            offset[:2] -= back_m
        self._ropes = ropes
        machine = start.robot.machine
        self._scale = machine.scale
        self._ground = GroundSearch(total, self._lightness, task.ground_steps_m, self._scale)
        self._plan = WalkPlan(task, footholds, pace, ropes, self._ground, offset)
        if self._plan.manner.strokes:
            self._plan.room_m = strokes.reserve_m
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
        """(3) velocity of the body's set points in the last tick, m/s."""
        self._speed_m_s, self._since_way_s = np.zeros(3), 0.0
        """(3) the same when the current motion of the body began, and the time since then, s."""
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
        """Distance of the body's set point in the direction of travel, m."""
        return float(self._plan.ahead @ self._body)

    @property
    def margins_n(self) -> list[float]:
        """Planned wrench margin of every group of swings, N."""
        return self._plan.margins_n

    @property
    def moved_m(self) -> Array:
        """(3) displacement of the body's set point, path frame, m."""
        return self._body.copy()

    @property
    def between(self) -> bool:
        """Whether no motion is under way and all feet are meant to stand."""
        swinging = self._queue and self._queue[0].doing in (
            Activity.SWING,
            Activity.SEARCH,
            Activity.SEAT,
        )
        return self._phase is None and not swinging

    def end_walk(self) -> int:
        """Finish the swings that have begun, then move the body over its feet; returns the number
        of swings that are left out.
        """
        begun = sum(phase.doing is Activity.SEAT for phase in self._queue)
        if self._phase is not None and self._phase.doing is Activity.SEAT:
            begun += 1
        left = max(self.task.steps - self.steps_done - begun, 0)
        self.task = self.task.model_copy(update={"steps": self.task.steps - left})
        self._plan.follow(self.task)
        return left

    def progress(self, t: float) -> dict[str, Any]:
        """Progress of the walk, by name."""
        del t
        steps = {"steps_made": self.steps_done, "steps_wanted": self.task.steps}
        return {"done": self.done, **steps, "way_m": self.way_m}

    @property
    def between_groups(self) -> bool:
        """Whether the next group of swings is still to be planned."""
        return self._phase is None and not self._queue

    def choose(self, stride: Stride, haste: float) -> None:
        """Choose the stride and the haste (see Pace) of the next group of swings. If the stride is
        out of reach, that of the task is used instead.
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
        """(2) rates of the ropes, m/s, for a body whose set point was `before` (3) dt s ago."""
        ropes, tension, strokes = self._ropes, measured.rope_tension, self._strokes
        if not self._plan.manner.strokes:
            return ropes.rates_m_s(self._body, before, dt, tension)
        owed_n = -strokes.owed_m * strokes.stiffness_ea_n / ropes.lengths_m(self._body)
        rates = ropes.rates_m_s(self._body, before, dt, tension, owed_n)
        strokes.follow(rates, tension, measured.supply_pressure, dt)
        return rates

    def _begun(self, measured: Measured) -> Levelling:
        """The levelling of the body, created at the first tick, when the attitude is known."""
        if self._levelling is None:
            roll, pitch, _ = measured.attitude
            self._footholds.stand_under(attitude_gravity(float(roll), float(pitch)))
            self._levelling = Levelling(measured.attitude, self._lightness, self._scale)
            self._levelling.stand_on(self._feet)
        return self._levelling

    def _go(self, dt: float, measured: Measured, stance: Flags, levelling: Levelling) -> None:
        """Advance the walk by dt s: begin the next phase if one is over, move body and foot, and
        clear `stance` of a swinging leg.
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
            # Renew the strokes now: in the next shift, the legs would have to wait for it.
            self._strokes.renew(self._plan.shifts_m(self._way.end - self._body))
        if phase.way is not None:
            self._way, self._way_clock, self._since_way_s = phase.way, 0.0, 0.0
            if self._plan.manner.strokes:  # the last way may not quite be over
                self._speed_m_s = self._went_m_s
                self._way = replace(phase.way, start=self._body + self._run_out_m())
        if phase.swing is not None:
            # Foot and body may not be exactly where the plan has them.
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
        """Share of its planned speed that ropes and pump allow the body, 0 to 1."""
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
        """(3) distance, m, that the body still covers with the speed it had when its current motion
        began; that speed decays while the new one rises.
        """
        within_s = self._way.ramp * self._way.duration_s
        left = max(1.0 - self._since_way_s / within_s, 0.0)
        return 0.5 * within_s * left * left * self._speed_m_s

    def _keeping_up(self, dt: float, measured: Measured) -> float:
        """Share of its planned speed that the lag of its leg allows a swing, 0 to 1."""
        assert self._phase is not None
        across = slice(ROTATION[self._phase.leg], VERTICAL[self._phase.leg])
        lag = float(np.abs(self._joints[across] - measured.position[across]).max())
        share = min(max((LAG_MOST - lag) / (LAG_MOST - LAG_FREE), 0.0), 1.0)
        self._waited_s = self._waited_s + dt if share == 0.0 else 0.0
        return CREEPS if self._waited_s > PATIENCE_S else share

    def _is_over(self, phase: Phase, share: float, dt: float, measured: Measured) -> bool:
        """Move the foot of the phase by dt s; returns whether the phase is complete."""
        load_n = float(measured.load[phase.leg])
        if phase.doing is Activity.UNLOAD:
            self._feet[phase.leg, 2] += self._scale.speed * self._plan.manner.unload_m_s * dt
            return share >= 1.0 or load_n < UNLOADED_SHARE * self._ground.touch_n
        if phase.doing is Activity.SWING:
            return self._swing(phase, share, dt, measured)
        if phase.doing is Activity.SEARCH:
            return self._search(phase, dt, measured)
        if phase.doing is Activity.SEAT:
            return share >= 1.0 and self._seated(phase, load_n)
        lead_s = self._plan.manner.lead_s if self._queue else 0.0
        return self._way_clock >= self._way.duration_s - lead_s

    def _seated(self, phase: Phase, load_n: float) -> bool:
        """Whether seating is over: the foot carries load, or has to search again, or its time is
        up.
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
        """Move the swinging foot; true at the end of the swing or at an early touchdown."""
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
        # The search continues at its own speed without a stop, which would reverse the friction.
        height = float(self._feet[leg, 2])
        speed_m_s = self._ground.speed_m_s(height, phase.ground, self._plan.search)
        slow = before - height < speed_m_s * dt
        return share >= 1.0 or (share > phase.swing.arrival and slow)

    def _search(self, phase: Phase, dt: float, measured: Measured) -> bool:
        """Lower the foot; true once its load rises or the search has reached its end."""
        leg, ground = phase.leg, self._ground
        height = float(self._feet[leg, 2])
        self._feet[leg, 2] -= ground.speed_m_s(height, phase.ground, self._plan.search) * dt
        met = ground.met(float(measured.load[leg]), self._clock, dt)
        if met or self._feet[leg, 2] <= ground.lowest_m(phase.ground):
            return self._touch(leg, measured)
        return False

    def _touch(self, leg: int, measured: Measured) -> bool:
        """Keep the foot where the encoders see it, and drop the rest of this leg's swing."""
        if self._queue and self._queue[0].leg == leg and self._queue[0].doing is Activity.SEARCH:
            self._queue.pop(0)
        seen = self._legs.feet(measured.position - self._footholds.nought)
        self._feet[leg] = self._body + seen[leg]
        return True
