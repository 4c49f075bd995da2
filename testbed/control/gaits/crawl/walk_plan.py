"""What a walk does next: the body's next shift and the swings after it, within reach and within the
machine's speed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from testbed.control.gaits.crawl.footholds import Footholds, Swings
from testbed.control.gaits.crawl.known_ground import ExpectedGround, KnownGround
from testbed.control.gaits.crawl.pace import Pace, progress
from testbed.control.gaits.crawl.rope_hold import RopeHold
from testbed.control.gaits.crawl.style import SEAT_S, STYLES, UNHURRIED, GaitStyle
from testbed.control.gaits.crawl.swing import (
    Activity,
    BodyWay,
    GroundSearch,
    Haste,
    Phase,
    Swing,
)
from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.machine.names import LEGS
from testbed.scenario.tasks import Crawl

UNLOAD_S = 1.0
"""Longest time in which a foot is taken off the ground (E)."""
SHORTEST_SHIFT_S = 0.3
"""No shift of the body is quicker (E)."""
SHORTEST_SWING_S = 0.5
"""No swing is quicker (E)."""
WAY_SAMPLES = 20
"""A way is sampled at so many points to find what it asks of valves, pump and ropes."""
OVER_THE_LOAD = (1.0, 0.75, 0.5, 0.25, 0.0)
"""Shares of the way from the feet's middle to over the load; the first that is within reach and
holds is taken.
"""
PAYING_CREEP = 2.0 / 3.0
"""Share of its usual way that the body makes while legs swing, where shifts pay out more rope than
a device can without going over (E).
"""
FREELY = np.full(2, np.inf)
"""Of ropes that can be paid out as far as one likes."""
WAITS = np.linspace(0.0, 1.0, 5)
"""Where the next swings are out of reach, the body falls behind its plan by the first of these
shares of its next way that brings them within reach: on rock a foot does not always stand where it
was meant to."""
REHEARSED = 8
"""Swings that are planned before the first one is made."""


@dataclass(frozen=True)
class Stride:
    """What a group of swings is to be."""

    length_m: float
    """Way of a foot: of the body in a cycle of four swings."""
    swing_height_m: float
    """How high a foot is lifted."""


@dataclass(frozen=True)
class _BodyPlan:
    """What a group of swings asks of feet and body."""

    places: list[tuple[int, Array]]
    """Legs and their next footholds (3)."""
    goal: Array
    """(3) where the body shifts to before the first swing."""
    creep: Array
    """(3) the body's way while legs swing."""
    margin_n: float
    """Planned wrench margin."""
    reached_m: float
    """How far along its way that brings the body."""


class WalkPlan:
    """Plans a walk group of swings by group of swings. Feet (4, 3) and body (3): path frame, m."""

    def __init__(
        self,
        task: Crawl,
        footholds: Footholds,
        pace: Pace,
        ropes: RopeHold,
        ground: GroundSearch,
        offset: Array,
    ) -> None:
        """Offset (3): how far the feet's common load lies off their middle at the start, m."""
        self._task, self._footholds, self._pace = task, footholds, pace
        self._ropes, self._ground, self._offset = ropes, ground, offset
        self.known = KnownGround(task.ground_steps_m)
        """Where feet have stood."""
        heading = np.radians(task.heading_deg)
        self.ahead = np.array([np.cos(heading), np.sin(heading), 0.0])
        """(3) unit vector of the direction of travel."""
        self._group_size = 1 if task.gait == "wave" else 2
        self._style = STYLES[task.gait]
        self.haste = 1.0
        """What somebody wants of it beyond the gait's own; see Pace."""
        self._behind_m = self._reached_m = 0.0
        """How far the body is behind its plan, and how far along its way the last group brings it.
        """
        self._creep_share = 1.0
        """Share of its usual way while legs swing that spares the ropes' devices."""
        self.room_m: Array = FREELY
        """(2) rope that each traction device can pay out before it has to go over, m."""
        self.stride = Stride(task.step_length_m, task.swing_height_m)
        """What the next group of swings is to be."""
        self._way_before, self._steps_before = 0.0, 0
        """Planned way of the body, m, after so many swings, since when the stride is the same."""
        self.margins_n: list[float] = []
        """Planned wrench margin of every group of swings, N."""

    def follow(self, task: Crawl) -> None:
        """Go on by a task that differs in its number of steps."""
        self._task = task

    def rehearse(self) -> None:
        """Plan the first swings without making them: InputError where a stride is out of reach."""
        feet, body, steps_done = self._footholds.home.copy(), np.zeros(3), 0
        while steps_done < min(self._task.steps, REHEARSED):
            phases = self.next_phases(feet, body, steps_done, WAITS[:1])
            for phase in phases:
                if phase.swing is not None:
                    feet[phase.leg, :2] = phase.swing.end[:2]
                    steps_done += 1
                if phase.way is not None:
                    body = phase.way.end
        self.margins_n.clear()
        self._reached_m, self._creep_share = 0.0, 1.0

    def choose(self, stride: Stride, steps_done: int) -> None:
        """Let the groups after `steps_done` swings be `stride`."""
        self._way_before = self._way_m(steps_done)
        self._steps_before, self.stride = steps_done, stride

    def _way_m(self, steps_done: int) -> float:
        """Where the plan has the body along its way after so many swings."""
        size = self._group_size
        groups = steps_done // size - self._steps_before // size
        return self._way_before + self.stride.length_m * groups * size / len(LEGS)

    def next_phases(
        self, feet: Array, body: Array, steps_done: int, waits: Array = WAITS
    ) -> list[Phase]:
        """The next shift and the swings after it; when all steps are done the way back over the
        middle of the feet.
        """
        self._pace.haste = self.manner.haste * self.haste
        task, left = self._task, self._task.steps - steps_done
        middle = self._middle(feet, steps_done)
        if left <= 0:
            return [self._shift(feet, body, middle)]
        group = [
            LEGS.index(task.order[(steps_done + index) % len(LEGS)])
            for index in range(min(self._group_size, left))
        ]
        behind = self._behind_m
        for share in waits:
            self._behind_m = behind + share * self.stride.length_m * self._group_size / len(LEGS)
            try:
                return self._group(group, feet, body, self._middle(feet, steps_done))
            except InputError:
                if share == waits[-1]:
                    self._behind_m = behind
                    raise
        raise AssertionError("the last wait returns or raises")

    def search_phases(self, leg: int, ground: ExpectedGround, tries: int) -> list[Phase]:
        """Search for the ground and seat the foot."""
        return [
            Phase(Activity.SEARCH, np.inf, leg, ground=ground, tries=tries),
            Phase(Activity.SEAT, self.manner.seat_s, leg, ground=ground, tries=tries),
        ]

    def _group(self, group: list[int], feet: Array, body: Array, middle: Array) -> list[Phase]:
        """The next shift and the swings of the legs in `group`; InputError where they are out of
        reach.
        """
        plan = self._body_plan(group, feet, body, middle)
        self.margins_n.append(plan.margin_n)
        self._reached_m = plan.reached_m
        self._spare_the_ropes(body, plan.goal)
        phases = [self._shift(feet, body, plan.goal)]
        feet, each = feet.copy(), plan.creep / len(group)
        for index, (leg, place) in enumerate(plan.places):
            phases += self._swing_phases(leg, place, plan.goal + index * each, each, feet)
            feet[leg] = place
        if plan.creep.any():
            sets_off = 2 if self.manner.lead_s > 0.0 else 1
            over = plan.goal + plan.creep
            phases[sets_off].way = self._way(feet, plan.goal, over, self.manner.creep_ease)
        return phases

    def _body_plan(self, group: list[int], feet: Array, body: Array, middle: Array) -> _BodyPlan:
        """Where the legs in `group` step and where the body goes; InputError where that is out of
        reach.
        """
        size, stride_m = len(group), self.stride.length_m
        part_m = stride_m * self._group_size / len(LEGS)
        creep_m = self.creep * part_m
        # Feet are put down half a stride ahead of their homes, counted from where the body stands
        # in the middle of its way over them.
        along_m = float(self.ahead @ middle)
        aheads_m = [
            along_m + 0.5 * stride_m + creep_m * ((index + 0.5) / size - 0.5)
            for index in range(size)
        ]
        places = [
            (leg, self._foothold(leg, feet, ahead_m * self.ahead))
            for leg, ahead_m in zip(group, aheads_m, strict=True)
        ]
        reached_m = along_m + 0.5 * creep_m
        start_m = max(along_m - 0.5 * creep_m, min(self._reached_m, reached_m))
        further = (along_m + part_m - 0.5 * creep_m - start_m) * self.ahead
        creep = (reached_m - start_m) * self.ahead
        start = middle + (start_m - along_m) * self.ahead
        tensions, directions = self._ropes.wanted_n(body), self._ropes.directions(body)
        swings = Swings(self._side(group), feet, places, further, creep, tensions, directions)
        goal, margin_n = self._goal(start, swings)
        return _BodyPlan(places, goal, creep, margin_n, reached_m)

    def _spare_the_ropes(self, body: Array, goal: Array) -> None:
        """Let more of the body's way be made in shifts from now on if the one to `goal` (3) pays a
        rope out further than its device can: a shift that goes further up the slope pays out less.
        """
        paid_m = self._ropes.lengths_m(goal) - self._ropes.lengths_m(body)
        if (paid_m > self.room_m).any():
            self._creep_share = PAYING_CREEP

    @property
    def manner(self) -> GaitStyle:
        """What the gait is like on this slope: on a steep one nobody is in a hurry."""
        return self._style if self._gentle > 0.0 else UNHURRIED

    @property
    def creep(self) -> float:
        """Share of its way that the body makes while legs swing."""
        usual = self._style.creep * (self._gentle if self._style.flows else 1.0)
        return self._creep_share * usual

    def shifts_m(self, left: Array) -> float:
        """How far the body goes along its way until the next shift is over, `left` (3) included."""
        part_m = self.stride.length_m * self._group_size / len(LEGS)
        return float(self.ahead @ left) + (1.0 - self.creep) * part_m

    @property
    def enough(self) -> float:
        """Share of the usual margin that is enough."""
        return 1.0 - (1.0 - self._style.enough(self._footholds.lightness)) * self._gentle

    @property
    def search(self) -> Haste:
        """How fast the ground is sought: near it, the less so the steeper the slope."""
        haste = self.manner.search
        return replace(haste, near=1.0 + (haste.near - 1.0) * self._gentle)

    @property
    def _gentle(self) -> float:
        """0 on a steep slope to 1 on a gentle one."""
        steep, gentle = self._style.steep, self._style.gentle
        share = (self._footholds.lightness - steep) / (gentle - steep)
        return min(max(share, 0.0), 1.0)

    def _goal(self, middle: Array, swings: Swings) -> tuple[Array, float]:
        """Where the body goes for the next swings, and its margin, N.

        It goes over its load, which ropes to one side draw off the feet's middle; where that is out
        of reach, as much nearer as the ranges ask for. Raises InputError where it is out of reach
        even over the middle, or where the feet that stay could not hold the machine then.
        """
        refused: InputError | None = None
        least = -np.inf
        for share in OVER_THE_LOAD:
            try:
                then = middle - share * self._offset
                goal, margin = self._footholds.body_goal(then, swings, self.enough)
            except InputError as error:
                refused = refused or error
                continue
            if margin > 0.0 or share == 1.0:
                return goal, margin
            least = max(least, margin)
        assert refused is not None
        if least == -np.inf:
            raise refused
        aside = 1e3 * float(np.hypot(*self._offset[:2]))
        raise InputError(
            f"the ropes draw the load {aside:.0f} mm off the middle of the feet, further than the body can shift, and "
            "three feet would not hold it",
            field="ropes.azimuth_deg",
            allowed="ropes nearer to straight up, or legs nearer to the middle of their ranges",
        )

    def _side(self, group: list[int]) -> Array:
        """(3) unit vector away from the legs that are to swing."""
        away = -self._footholds.home[group].mean(axis=0) * np.array([1.0, 1.0, 0.0])
        if self._task.gait == "wave":
            # A body that goes on all the time sways across its way, not along it.
            away = away - self.ahead * float(self.ahead @ away)
        return np.asarray(away / np.linalg.norm(away))

    def _middle(self, feet: Array, steps_done: int) -> Array:
        """Where the body belongs over its feet: level with them, and along the way where the plan
        has it by now.
        """
        middle = feet.mean(axis=0) - self._footholds.home.mean(axis=0)
        if steps_done < self._task.steps:
            middle[:2] = ((self._way_m(steps_done) - self._behind_m) * self.ahead)[:2]
        return np.asarray(middle)

    def _foothold(self, leg: int, feet: Array, shift: Array) -> Array:
        place = self._footholds.home[leg] + shift
        place[2] = feet[leg, 2]
        return np.asarray(place)

    def _shift(self, feet: Array, start: Array, goal: Array) -> Phase:
        period = self._task.period_s
        rest = 0.0 if period is None else 0.5 * self._group_size * period
        way = self._way(feet, start, goal, 1.0, max(rest, SHORTEST_SHIFT_S))
        return Phase(Activity.SHIFT, way.duration_s, way=way)

    def _way(
        self, feet: Array, start: Array, goal: Array, ease: float, least_s: float = 0.0
    ) -> BodyWay:
        """A way of the body over standing feet in `ease` times the least time that it takes."""
        shares = np.linspace(0.0, 1.0, WAY_SAMPLES)
        bodies = start + shares[:, None] * (goal - start)
        joints = np.array([self._footholds.joints(feet, body) for body in bodies])
        ropes = np.array([self._ropes.lengths_m(body) for body in bodies])
        if not self._ropes.tension_n.any():
            ropes[:] = 0.0
        ramp = self.manner.ramp
        duration_s = max(ease * self._pace.shift_s(joints, ropes, ramp), least_s)
        return BodyWay(start.copy(), goal, duration_s, ramp)

    def _swing_phases(
        self, leg: int, place: Array, body: Array, creep: Array, feet: Array
    ) -> list[Phase]:
        """Swing, search and seat one leg, with the body going on from `body` by `creep`
        meanwhile.
        """
        start = feet[leg].copy()
        ground = self.known.expected(place, self.ahead, self.stride.length_m)
        manner, lift_m = self.manner, self.stride.swing_height_m
        first_m = self._ground.first_m(ground, manner.search_from)
        above = np.array([place[0], place[1], first_m])
        high = self._ground.high_m(float(start[2]), ground, lift_m, manner.lifts_over_steps)
        legs = self._footholds.legs
        clear, ramp = manner.clear, manner.swing_ramp
        way = Swing(legs, leg, start, above, body, body + creep, high, clear, ramp)
        swing = self.timed(way, feet)
        return [
            Phase(Activity.UNLOAD, UNLOAD_S, leg),
            Phase(Activity.SWING, swing.duration_s, leg, swing=swing, ground=ground),
            *self.search_phases(leg, ground, 1),
        ]

    def timed(self, swing: Swing, feet: Array) -> Swing:
        """The same way in the time that it needs, over standing feet (4, 3)."""
        swing = swing.timed(self._pace)
        period = self._task.period_s
        rest = 0.0 if period is None else 0.5 * period - SEAT_S
        least = max(self._least_s(swing, feet), rest, SHORTEST_SWING_S)
        return swing.slower(least / swing.duration_s)

    def _least_s(self, swing: Swing, feet: Array) -> float:
        """Least time for a swing: its own, or what pump and standing legs need while the body goes
        on.
        """
        joints = []
        for share in np.linspace(0.0, 1.0, 2 * WAY_SAMPLES):
            moved = swing.body_from + progress(float(share)) * (swing.body_to - swing.body_from)
            way = feet.copy()
            way[swing.leg] = swing.foot(float(share) * swing.duration_s, moved)
            joints.append(self._footholds.joints(way, moved))
        return max(swing.duration_s, self._pace.swing_s(np.array(joints)))
