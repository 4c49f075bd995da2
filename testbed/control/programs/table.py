"""Which program of set points a task runs: one line a task."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.control.programs.crawl import CrawlProgram
from testbed.control.programs.footholds import Footholds
from testbed.control.programs.mast import KeepMast
from testbed.control.programs.pace import Pace
from testbed.control.programs.references import Hold, Program
from testbed.control.programs.rope_hold import RopeHold
from testbed.control.programs.supervisor import Supervisor
from testbed.control.programs.sway import SwayProgram
from testbed.robot.robot import Robot
from testbed.scenario.drilling import DrillHole
from testbed.scenario.scenario import Scenario
from testbed.scenario.tasks import Crawl, Sway

Array = NDArray[np.float64]


def program_of(
    scenario: Scenario,
    belief: Robot,
    start: Array,
    rope_tension_n: Array,
    rope_directions_in_body: Array,
    anchors_in_body: Array,
    loads_n: Array,
) -> Program:
    """The program of a scenario's task.

    `belief`: the robot as control knows it; start posture (12), ropes (2; 2, 3; 2, 3) and feet's loads (4).
    """
    program = _program_of(
        scenario, belief, start, rope_tension_n, rope_directions_in_body, anchors_in_body, loads_n
    )
    return Supervisor(program) if scenario.control.supervisor else program


def _program_of(
    scenario: Scenario,
    belief: Robot,
    start: Array,
    rope_tension_n: Array,
    rope_directions_in_body: Array,
    anchors_in_body: Array,
    loads_n: Array,
) -> Program:
    program: Program
    if isinstance(scenario.task, Crawl):
        program = _crawl(belief, scenario.task, start, rope_tension_n, anchors_in_body, loads_n)
    elif isinstance(scenario.task, Sway):
        program = SwayProgram(scenario.task, belief.legs, start, rope_directions_in_body)
    else:
        program = Hold(start, scenario.task, scenario.events)
    if isinstance(scenario.task, DrillHole) and scenario.task.keep_mast:
        program = KeepMast(program, belief.legs.feet(start))
    if scenario.control.distribution == "position_hold":
        return program
    from testbed.control.distribution.controllers import controller, distributed

    return distributed(
        belief, program, rope_directions_in_body, controller(scenario.control.distribution)
    )


def _crawl(
    belief: Robot,
    task: Crawl,
    start: Array,
    rope_tension_n: Array,
    anchors_in_body: Array,
    loads_n: Array,
) -> CrawlProgram:
    machine, model, legs = belief.machine, belief.model, belief.legs
    arm = float(belief.linkage.moment_arm_m(start[0]))
    return CrawlProgram(
        task,
        start,
        legs,
        Footholds(model, legs, start, machine.ground.friction),
        Pace(machine, arm),
        RopeHold(anchors_in_body, model.rope_attachments_m, rope_tension_n),
        loads_n,
    )
