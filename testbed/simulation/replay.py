"""A run's recording handed to a gait again: what it would have ordered, seeing what was seen."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from testbed.control.gait import BelievedStart
from testbed.control.gaits.own import checked_gait
from testbed.control.measured import Measured, rows_of
from testbed.control.replay import Commands, replay
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
