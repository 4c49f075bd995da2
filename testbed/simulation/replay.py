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
from testbed.control.gait import BelievedStart, Gait, Measured, rows_of
from testbed.control.gaits.table import checked_gait
from testbed.formats.arrays import Array, Columns, Flags
from testbed.formats.records import SET
from testbed.formats.sockets import user_code
from testbed.robot.robot import Robot
from testbed.scenario.machines import machines_of
from testbed.scenario.scenario import Scenario, load_scenario
from testbed.simulation.runs import read_run
from testbed.world.ground.terrain import anchors_in_world

TICK_S = 0.01
"""A gait is asked this often, live and here."""


@dataclass(frozen=True)
class Commands:
    """What a gait ordered tick by tick; the fields of Command, stacked."""

    row: NDArray[np.intp]
    """(n,) which row of the recording each tick saw."""
    t: Array
    """(n,) beginning of the tick, s."""
    joints: Array
    """(n, 12) set points at the end of the tick, rad and m."""
    rope_rates_m_s: Array
    """(n, 2)"""
    stance: Flags
    """(n, 4)"""
    hold_drill: Flags
    """(n,)"""


def rows_at_ticks(rows: NDArray[Any]) -> NDArray[np.intp]:
    """Which of recorded rows (n, DataRow), evenly spaced at 100 Hz or more, a tick sees."""
    step_s = float(np.median(np.diff(rows["t"])))
    ticks = rows["t"] / TICK_S
    return np.flatnonzero(np.abs(ticks - np.round(ticks)) * TICK_S < 0.5 * step_s)


def replay(gait: Gait, rows: NDArray[Any]) -> Commands:
    """Ask a gait at every tick of recorded rows (n, DataRow)."""
    seen = rows_at_ticks(rows)
    given = [
        gait.command(float(rows["t"][row]), TICK_S, Measured(rows[row : row + 1])) for row in seen
    ]
    return Commands(
        row=seen,
        t=rows["t"][seen],
        joints=np.array([command.joints for command in given]),
        rope_rates_m_s=np.array([command.rope_rates_m_s for command in given]),
        stance=np.array([command.stance for command in given]),
        hold_drill=np.array([command.hold_drill for command in given]),
    )


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
    statics = Statics(start.robot.model, start.robot.machine, start.ropes_in_body)
    seen, given = rows_at_ticks(rows), []
    with user_code():
        for row in seen:
            now = statics.balance(Measured(rows[row : row + 1]), rows["carrying"][row] > SET)
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
        rope_strokes=scenario.ropes.strokes,
    )
