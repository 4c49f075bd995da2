"""A run's recording handed to a gait or a controller again: what it would have ordered, seeing what
was seen.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.control.distribution.controllers import controller
from testbed.control.distribution.distribution import Controller, checked_plan
from testbed.control.distribution.statics import Statics
from testbed.control.gait import BelievedStart
from testbed.control.gaits.own import checked_gait
from testbed.control.measured import Measured, rows_of
from testbed.control.replay import Commands, replay, rows_at_ticks
from testbed.formats.arrays import Array, Flags
from testbed.formats.records import SET
from testbed.formats.sockets import user_code
from testbed.robot.robot import Robot
from testbed.scenario.machines import machines_of
from testbed.scenario.scenario import Scenario, load_scenario
from testbed.simulation.runs import Columns, read_run
from testbed.world.ground.terrain import anchors_in_world


def replay_gait(name: str, folder: str | Path) -> tuple[Commands, Columns]:
    """The commands of a gait `FILE.py:Class` over the run in `folder`, and the recorded columns.

    Raises InputError where there is no run or no such gait.
    """
    run = read_run(folder, truth=False)
    rows = rows_of(run.data)
    start = recorded_start(load_scenario(run.folder / "scenario.yaml"), Measured(rows[:1]))
    return replay(checked_gait(name, start, field="gait"), rows), run.data


@dataclass(frozen=True)
class Plans:
    """What a controller planned tick by tick."""

    row: NDArray[np.intp]
    """(n,) which row of the recording each tick saw."""
    forces: Array
    """(n, 14) wanted forces in the order of Statics' unknowns, N."""
    feasible: Flags
    """(n,) whether it found any."""


def replay_controller(
    name: str | type[Any] | Controller, folder: str | Path
) -> tuple[Plans, Columns]:
    """The plans of a controller (a shipped name, `FILE.py:Class`, a class or an object) over the
    run in `folder`, and the recorded columns.

    Raises InputError where there is no run or no such controller, or where it answers no plan.
    """
    chosen, run = controller(name), read_run(folder, truth=False)
    rows = rows_of(run.data)
    start = recorded_start(load_scenario(run.folder / "scenario.yaml"), Measured(rows[:1]))
    statics = Statics(start.robot.model, start.robot.machine, start.rope_directions_in_body)
    seen, given = rows_at_ticks(rows), []
    with user_code():
        for row in seen:
            now = statics.look(Measured(rows[row : row + 1]), rows["carrying"][row] > SET)
            given.append(checked_plan(chosen.plan(now), chosen))
    forces = np.array([plan.forces for plan in given])
    return Plans(seen, forces, np.array([plan.feasible for plan in given])), run.data


def recorded_start(scenario: Scenario, first: Measured) -> BelievedStart:
    """The start of a run as its first row has it; `joints` are encoder readings then, not set
    points.
    """
    height = scenario.ropes.attachment_height_m
    robot = Robot.of(machines_of(scenario).belief, scenario.carried_kg, height)
    above = -float(robot.legs.feet(first.position)[:, 2].mean())
    anchors = anchors_in_world(scenario.ropes, np.eye(3)) - np.array([0.0, 0.0, above])
    ways = anchors - robot.model.rope_attachments_m
    return BelievedStart(
        robot=robot,
        joints=first.position,
        load_n=first.own["z"],
        rope_tension_n=first.rope_tension,
        rope_directions_in_body=ways / np.linalg.norm(ways, axis=1)[:, None],
        anchors_in_body_m=anchors,
    )
