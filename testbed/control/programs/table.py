"""Which program of set points a task runs: one line a task."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.control.believed_model import believed_model
from testbed.control.programs.crawl import CrawlProgram
from testbed.control.programs.footholds import Footholds
from testbed.control.programs.mast import KeepMast
from testbed.control.programs.pace import Pace
from testbed.control.programs.references import Hold, Program
from testbed.control.programs.rope_hold import RopeHold
from testbed.control.programs.supervisor import Supervisor
from testbed.control.programs.sway import SwayProgram
from testbed.machine.provenance import roboclimber
from testbed.robot.kinematics import LegKinematics
from testbed.robot.linkage import RotationLinkage
from testbed.scenario.drilling import DrillHole
from testbed.scenario.scenario import Scenario
from testbed.scenario.tasks import Crawl, Sway

Array = NDArray[np.float64]


def program_of(
    scenario: Scenario,
    start: Array,
    rope_tension_n: Array,
    rope_directions_in_body: Array,
    anchors_in_body: Array,
    loads_n: Array,
) -> Program:
    """The program of a scenario's task, from the start posture (12), ropes (2; 2, 3; 2, 3) and feet's loads (4)."""
    program = _program_of(
        scenario, start, rope_tension_n, rope_directions_in_body, anchors_in_body, loads_n
    )
    return Supervisor(program) if scenario.control.supervisor else program


def _program_of(
    scenario: Scenario,
    start: Array,
    rope_tension_n: Array,
    rope_directions_in_body: Array,
    anchors_in_body: Array,
    loads_n: Array,
) -> Program:
    program: Program
    if isinstance(scenario.task, Crawl):
        program = _crawl(scenario, scenario.task, start, rope_tension_n, anchors_in_body, loads_n)
    elif isinstance(scenario.task, Sway):
        program = SwayProgram(scenario.task, start, rope_directions_in_body)
    else:
        program = Hold(start, scenario.task, scenario.events)
    if isinstance(scenario.task, DrillHole) and scenario.task.keep_mast:
        program = KeepMast(program, LegKinematics.from_parameters(roboclimber()).feet(start))
    if scenario.control.distribution == "position_hold":
        return program
    from testbed.control.distribution.controllers import controller, distributed

    return distributed(
        scenario, program, rope_directions_in_body, controller(scenario.control.distribution)
    )


def _crawl(
    scenario: Scenario,
    task: Crawl,
    start: Array,
    rope_tension_n: Array,
    anchors_in_body: Array,
    loads_n: Array,
) -> CrawlProgram:
    parameters = roboclimber().replaced(scenario.model.parameters)
    model, legs = believed_model(scenario), LegKinematics.from_parameters(parameters)
    arm = float(RotationLinkage.from_parameters(parameters).moment_arm_m(start[0]))
    return CrawlProgram(
        task,
        start,
        legs,
        Footholds(model, legs, start, parameters["ground"]["friction"]),
        Pace(parameters, arm),
        RopeHold(anchors_in_body, model.rope_attachments_m, rope_tension_n),
        loads_n,
    )
