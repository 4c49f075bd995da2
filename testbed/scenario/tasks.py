"""What the robot is to do: the tasks of a scenario, and what drilling consists of."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, field_validator, model_validator

from testbed.formats.checked import Checked, NameOrClass, Pair, Sequence, Triple, impossible
from testbed.scenario.drilling import DrillHole
from testbed.scenario.events import Leg

WIDEST_SWAY_M, FASTEST_SWAY_S = 0.2, 2.0
"""Amplitude that the legs reach, and time for once to and fro that the cylinders keep up with."""

NEAREST_M = 0.01
"""Two waypoints that are nearer to each other are the same place."""


class Stand(Checked):
    """Hold the start posture."""

    kind: Literal["stand"] = "stand"
    for_s: float | None = Field(default=None, gt=0)
    """how long, in a chain of tasks [s]; null: to the end"""


class Raise(Checked):
    """Raise the body in steps of the four vertical joints (the paper's figure 5)."""

    kind: Literal["raise"]
    start_s: float = Field(default=2.0, ge=0)
    """time of the first step [s]"""
    to_m: float = Field(default=0.35, gt=0, le=10)
    """extension of the vertical joints at the end, at most their stroke [m]"""
    step_m: float = Field(default=0.05, gt=0, le=10)
    """height of one step [m]"""
    every_s: float = Field(default=5.0, gt=0)
    """time between steps [s]"""
    speed_m_s: float = Field(default=0.02, gt=0, le=0.5)
    """speed of the set point within a step [m/s]"""


class Sway(Checked):
    """Move the body over standing feet, slowly to and fro: every cylinder moves in both directions
    under load.
    """

    kind: Literal["sway"]
    start_s: float = Field(default=1.0, ge=0)
    """time at which the body begins to move [s]"""
    amplitude_m: Triple | None = None
    """way of the body to either side: forward, left, away from the slope [m]; null: 0.06, 0.05,
    0.05, on a machine of another size as much more or less
    """
    period_s: Triple = (11.0, 9.0, 7.0)
    """time for once to and fro, in the same order; at least 2 [s]"""

    for_s: float | None = Field(default=None, gt=0)
    """how long, in a chain of tasks [s]; null: to the end"""

    @field_validator("amplitude_m")
    @classmethod
    def _small(cls, value: tuple[float, float, float] | None) -> tuple[float, float, float] | None:
        if value is not None and any(not 0 <= amplitude <= WIDEST_SWAY_M for amplitude in value):
            raise impossible("reaches beyond the legs", f"0 to {WIDEST_SWAY_M:g} m")
        return value

    @field_validator("period_s")
    @classmethod
    def _slow(cls, value: tuple[float, float, float]) -> tuple[float, float, float]:
        if any(period < FASTEST_SWAY_S for period in value):
            raise impossible("is faster than the cylinders", f"at least {FASTEST_SWAY_S:g} s")
        return value


class Push(Checked):
    """Press the bit on the rock without blows."""

    kind: Literal["push"]
    duration_s: float = Field(gt=0)
    """length of the phase [s]"""
    feed_n: float = Field(default=4000.0, ge=0, le=30000)
    """feed force into the ground; its reaction lifts the body [N]"""
    torque_nm: float = Field(default=300.0, ge=0, le=5000)
    """torque on the rod; its reaction turns the body about -z [N m]"""


class Hammer(Checked):
    """Drill with blows of a down-the-hole hammer."""

    kind: Literal["hammer"]
    duration_s: float = Field(gt=0)
    """length of the phase [s]"""
    feed_n: float = Field(default=5500.0, ge=0, le=30000)
    """mean feed force into the ground [N]"""
    torque_nm: float = Field(default=500.0, ge=0, le=5000)
    """torque on the rod [N m]"""
    blow_hz: float = Field(default=30.0, gt=0, le=100)
    """blows a second [Hz]"""
    blow_n: float = Field(default=1500.0, ge=0, le=50000)
    """peak of the blow's reaction on the body, above the feed [N]"""
    penetration_m_s: float = Field(default=0.005, ge=0, le=0.2)
    """rate at which the hole deepens [m/s]"""


class RodChange(Checked):
    """Take a rod from the store and add it to the string: its weight moves from the store to the
    hole.
    """

    kind: Literal["rod_change"]
    duration_s: float = Field(gt=0)
    """length of the phase [s]"""
    rod_kg: float = Field(default=10.2, ge=0, le=400)
    """mass that moves from the store to the drill axis [kg]"""


class PullOut(Checked):
    """Pull the string out of the hole: its reaction presses the body on the slope."""

    kind: Literal["pull_out"]
    duration_s: float = Field(gt=0)
    """length of the phase [s]"""
    pull_n: float = Field(default=8000.0, ge=0, le=60000)
    """pull on the string, away from the ground [N]"""


class Rest(Checked):
    """The bit hangs free: no force but the string's weight."""

    kind: Literal["rest"]
    duration_s: float = Field(gt=0)
    """length of the phase [s]"""


DrillPhase = Annotated[Push | Hammer | RodChange | PullOut | Rest, Field(discriminator="kind")]


class Drill(Checked):
    """Hold the start posture and drill through the phases one after the other."""

    kind: Literal["drill"]
    start_s: float = Field(default=5.0, ge=0)
    """time at which the first phase begins [s]"""
    ramp_s: float = Field(default=0.3, ge=0, le=10)
    """time in which forces rise and fall at the edges of a phase [s]"""
    repeat: bool = False
    """begin again with the first phase after the last one"""
    phases: Annotated[tuple[DrillPhase, ...], Sequence] = Field(
        default=(Hammer(kind="hammer", duration_s=30.0),), min_length=1
    )
    """phases in order"""


class Crawl(Checked):
    """Walk over the slope on the ropes, one leg swinging at a time."""

    kind: Literal["crawl"]
    gait: Literal["flowing", "brisk", "two_phase", "wave"] = "flowing"
    """flowing: both legs of a side swing one after the other while the body goes on, and in between
    it moves to the other side; brisk: the same with less margin on gentle slopes and less waiting;
    two_phase: as flowing, but the body moves on four feet only; wave: the body sways for every
    swing
    """
    start_s: float = Field(default=4.0, ge=0)
    """time of the first motion [s]"""
    steps: int = Field(default=4, ge=1, le=1000)
    """number of leg swings"""
    step_length_m: float = Field(default=0.1, gt=0, le=5)
    """way of the body in a cycle of four swings: how far a foot moves [m]"""
    heading_deg: float = Field(default=0.0, ge=-180, le=180)
    """direction of travel, from straight up the slope to the left [deg]"""
    swing_height_m: float = Field(default=0.08, gt=0, le=4)
    """how high a foot is lifted [m]"""
    ground_steps_m: float = Field(default=0.0, ge=0, le=0.3)
    """largest step of the ground between footholds to be reckoned with: feet are lifted that much
    higher and the search for the ground begins and ends that much sooner and deeper [m]
    """
    period_s: float | None = Field(default=None, gt=0)
    """least time for one swing, shift of the body included; null: as fast as the joints' speeds and
    the pump's flow allow [s]
    """
    order: Annotated[tuple[Leg, ...], Sequence] = ("rr", "fr", "rl", "fl")
    """order of the swinging legs"""

    waypoints_m: Annotated[tuple[Pair, ...], Sequence] = Field(default=(), max_length=100)
    """places that the body walks to, one after the other: up the slope and to the left, from where
    the walk begins; they rule steps and heading, and step_length_m is the longest stride [m]
    """

    @model_validator(mode="after")
    def _waypoints_rule(self) -> Crawl:
        if not self.waypoints_m:
            return self
        for name in ("steps", "heading_deg"):
            if getattr(self, name) != Crawl.model_fields[name].default:
                raise impossible(f"{name} beside waypoints_m, which rule it", "one of both")
        places = ((0.0, 0.0), *self.waypoints_m)
        if any(math.dist(one, other) < NEAREST_M for one, other in pairwise(places)):
            raise impossible("waypoints_m: two of them are the same place", "at least 0.01 m apart")
        return self

    @field_validator("order")
    @classmethod
    def _each_leg_once(cls, order: tuple[str, ...]) -> tuple[str, ...]:
        if sorted(order) != ["fl", "fr", "rl", "rr"]:
            raise impossible("must name each leg once", "an order of fl, fr, rl, rr")
        return order


class Program(Checked):
    """Move by a gait of your own."""

    kind: Literal["program"]
    file: Annotated[str, NameOrClass()]
    """its class; a relative file is looked for beside the scenario file, then in the working folder

    """


class Commission(Checked):
    """Move so that the robot can weigh and calibrate itself: each foot in the air, the body up,
    down and to the sides.
    """

    kind: Literal["commission"]
    start_s: float = Field(default=2.0, ge=0)
    """time of the first motion [s]"""


One = Annotated[
    Commission | Stand | Raise | Sway | Drill | DrillHole | Crawl | Program,
    Field(discriminator="kind"),
]


def _one(value: Any) -> Any:
    """A task of a chain; a word alone is one with nothing changed."""
    return {"kind": value} if isinstance(value, str) else value


class Chain(Checked):
    """Tasks one after the other, each from where the last one ended; their times count from their
    beginning.

    A scenario may say `tasks: [crawl, drill_hole]` for it.
    """

    kind: Literal["chain"]
    tasks: Annotated[tuple[Annotated[One, BeforeValidator(_one)], ...], Sequence] = Field(
        min_length=2, max_length=100
    )
    """the tasks in their order"""

    @model_validator(mode="after")
    def _each_has_an_end(self) -> Chain:
        drills = [task for task in self.tasks if isinstance(task, Drill | DrillHole)]
        if len(drills) > 1:
            raise impossible(
                "tasks: drills twice; the store holds the rods of one hole", "one drill"
            )
        for index, task in enumerate(self.tasks[:-1]):
            if isinstance(task, Stand | Sway) and task.for_s is None:
                raise impossible(f"tasks.{index}: {task.kind} has no end", "for_s, how long")
            if isinstance(task, Drill) and task.repeat:
                raise impossible(f"tasks.{index}: repeats without end", "repeat: false")
        if isinstance(self.tasks[-1], Stand | Sway) and self.tasks[-1].for_s is not None:
            raise impossible("tasks: the last one goes on to the end", "no for_s in it")
        return self

    @property
    def drilling(self) -> Drill | DrillHole | None:
        """The task among them that drills."""
        return next((task for task in self.tasks if isinstance(task, Drill | DrillHole)), None)


Task = Annotated[
    Commission | Stand | Raise | Sway | Drill | DrillHole | Crawl | Program | Chain,
    Field(discriminator="kind"),
]
