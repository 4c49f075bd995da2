"""Which gait a task runs, and which layers lie over it: one line a task."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from testbed.control.distribution.distribution import Controller
from testbed.control.gait import BelievedStart, Command, Gait, Layer, Layered, Measured
from testbed.control.gaits.chain import Chain
from testbed.control.gaits.commission import CommissionGait
from testbed.control.gaits.crawl.footholds import Footholds
from testbed.control.gaits.crawl.gait import CrawlGait
from testbed.control.gaits.crawl.pace import Pace
from testbed.control.gaits.crawl.rope_hold import RopeHold
from testbed.control.gaits.crawl.strokes import Strokes
from testbed.control.gaits.standing import Hold, SwayGait
from testbed.control.layers import KeepMast, Supervisor
from testbed.errors import InputError
from testbed.formats.sockets import load_object
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.robot.traction import traction_parameters
from testbed.scenario.drilling import DrillHole
from testbed.scenario.events import Event, LiftFoot, SetRope, Stop, Turn
from testbed.scenario.scenario import Scenario
from testbed.scenario.tasks import Chain as TaskChain
from testbed.scenario.tasks import Commission, Crawl, Program, Sway

# A gait of the user's own: made from the start, and its commands looked at before they are
# followed.

SHAPES = {"joints": AXES, "joint_rates": AXES, "rope_rates_m_s": SIDES, "stance": LEGS}
"""What each array of a command has one number for."""


def checked_gait(
    gait: str | type[Any] | Gait, start: BelievedStart, field: str = "task.file"
) -> Gait:
    """A gait of the user's own: `FILE.py:Class` or a class, made from the start, or one that is
    made already.

    Raises InputError where it does not fit.
    """
    if isinstance(gait, str):
        return OwnGait(load_object(gait, Gait, start, field=field), gait)
    made: Gait = gait(start) if isinstance(gait, type) else gait
    return OwnGait(made, type(made).__name__)


class OwnGait:
    """A user's gait whose commands are looked at before they are followed. A Gait."""

    def __init__(self, gait: Gait, name: str) -> None:
        self._gait, self._name = gait, name
        self._last: object = None

    def command(self, t: float, dt: float, measured: Measured) -> Command:
        """See Gait. Raises InputError for what is no command of finite numbers."""
        command = self._gait.command(t, dt, measured)
        if command is not self._last:
            self._check(command)
            self._last = command
        return command

    def progress(self, t: float) -> Any:
        """What the user's gait says of its own progress; nothing where it says nothing."""
        told = getattr(self._gait, "progress", None)
        return {} if told is None else dict(told(t))

    def _check(self, command: object) -> None:
        if not isinstance(command, Command):
            raise self._refused("command", type(command).__name__, "a Command")
        for name, members in SHAPES.items():
            values = getattr(command, name)
            if values is None:
                continue
            if values.shape != (len(members),):
                raise self._refused(name, values.shape, f"({len(members)},)")
            if not np.isfinite(values).all():
                raise self._refused(name, values.tolist(), "finite numbers")

    def _refused(self, field: str, value: object, allowed: str) -> InputError:
        said = "returned a command that cannot be followed"
        return InputError(said, file=self._name, field=field, value=value, allowed=allowed)


@dataclass(frozen=True)
class OwnParts:
    """What a caller brings along instead of what the scenario names: a class, an object,
    `FILE.py:Class`, or None.
    """

    gait: str | type[Any] | Gait | None = None
    """Made from the BelievedStart."""
    controller: str | type[Any] | Controller | None = None
    """Made from nothing; a shipped one by its name too."""


NOTHING_OWN = OwnParts()


def gait_of(scenario: Scenario, start: BelievedStart, own: OwnParts = NOTHING_OWN) -> Gait:
    """The gait of a scenario's task or the caller's own, under the layers that the scenario asks
    for.
    """
    task = scenario.task
    gait: Gait
    chosen = own.controller or scenario.control.distribution
    shared = chosen != "position_hold"
    if own.gait is not None:
        _refuse_orders(scenario.events)
        gait = _with_mast(task, checked_gait(own.gait, start, field="gait"), start)
    elif needs_chain(scenario):
        tasks = task.tasks if isinstance(task, TaskChain) else (task,)
        gait = Chain(tasks, scenario.events, start, lambda part, here: _one(part, (), here, shared))
    else:
        gait = _one(task, scenario.events, start, shared)
    layers: list[Layer] = []
    if shared:
        from testbed.control.distribution.controllers import controller, distribution

        field = "control.distribution" if own.controller is None else "controller"
        planner = controller(chosen, field)
        layers.append(distribution(start.robot, start.ropes_in_body, planner))
    if scenario.control.supervisor:
        layers.append(Supervisor())
    return Layered(gait, tuple(layers)) if layers else gait


def _refuse_orders(events: tuple[Event, ...]) -> None:
    """Refuse events that a gait carries out where it is the caller's own, which knows nothing of
    them.
    """
    for number, event in enumerate(events):
        if isinstance(event, LiftFoot | SetRope | Stop | Turn):
            raise InputError(
                "is what a gait of your own does itself",
                field=f"events.{number}",
                value=event.kind,
                allowed="a scenario without it",
            )


def needs_chain(scenario: Scenario) -> bool:
    """Whether a scenario's motion is more than one gait from its start to its end."""
    task = scenario.task
    walks_on = isinstance(task, Crawl) and bool(task.waypoints_m)
    return (
        isinstance(task, TaskChain)
        or walks_on
        or any(isinstance(event, Stop | Turn) for event in scenario.events)
    )


def _one(task: Any, events: tuple[Event, ...], start: BelievedStart, shared: bool) -> Gait:
    """The gait of one task, with the layers that belong to it; shared: see RopeHold."""
    gait: Gait
    if isinstance(task, Crawl):
        gait = _crawl(task, start, shared)
    elif isinstance(task, Commission):
        gait = CommissionGait(task, start)
    elif isinstance(task, Sway):
        gait = SwayGait(task, start)
    elif isinstance(task, Program):
        gait = checked_gait(task.file, start)
    else:
        gait = Hold(start.joints, task, events, start.model.limits, start.robot.machine.scale)
    return _with_mast(task, gait, start)


def _with_mast(task: Any, gait: Gait, start: BelievedStart) -> Gait:
    """The gait under a layer that keeps the mast upright, where its task asks for that."""
    if isinstance(task, DrillHole) and task.keep_mast:
        return Layered(gait, (KeepMast(start.legs.feet(start.joints)),))
    return gait


def _crawl(task: Crawl, start: BelievedStart, shared: bool) -> CrawlGait:
    machine = start.robot.machine
    attachments = start.model.rope_attachments_m
    return CrawlGait(
        task,
        start,
        Footholds(start.model, start.legs, start.joints, machine.ground.friction),
        Pace(machine, start.robot.linkages.gain_arms(start.joints)),
        RopeHold(start.anchors_in_body_m, attachments, start.rope_tension_n, machine.scale, shared),
        Strokes(
            traction_parameters(machine, strokes=start.rope_strokes, roped=start.rope_strokes),
            machine.rope.stiffness_ea_n,
            machine.scale,
        ),
    )
