"""Which program of set points a task runs: one line a task."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.control.crawl import CrawlProgram
from testbed.control.mast import KeepMast
from testbed.control.references import Hold, Program
from testbed.control.sway import SwayProgram
from testbed.parameters.scenario import Scenario
from testbed.parameters.scenario_drilling import DrillHole
from testbed.parameters.scenario_tasks import Crawl, Sway

Array = NDArray[np.float64]


def program_of(
    scenario: Scenario,
    start: Array,
    rope_tension_n: Array,
    rope_directions_in_body: Array,
    feet_in_body: Array,
    loads_n: Array,
) -> Program:
    """The program of a scenario's task, from the start posture (12), ropes (2; 2, 3), feet (4, 3) and loads (4)."""
    program: Program
    if isinstance(scenario.task, Crawl):
        pressure = loads_n @ feet_in_body[:, :2] / loads_n.sum()
        program = CrawlProgram(scenario.task, start, rope_tension_n, rope_directions_in_body, pressure)
    elif isinstance(scenario.task, Sway):
        program = SwayProgram(scenario.task, start, rope_directions_in_body)
    else:
        program = Hold(start, scenario.task, scenario.events)
    if isinstance(scenario.task, DrillHole) and scenario.task.keep_mast:
        program = KeepMast(program, feet_in_body)
    if scenario.control.distribution == "position_hold":
        return program
    from testbed.control.controllers import controller, distributed

    return distributed(scenario, program, rope_directions_in_body, controller(scenario.control.distribution))
