"""Which gait a task runs, and which layers lie over it: one line a task."""

from __future__ import annotations

from testbed.control.gait import BelievedStart, Gait, Layer, Layered
from testbed.control.gaits.crawl.footholds import Footholds
from testbed.control.gaits.crawl.gait import CrawlGait
from testbed.control.gaits.crawl.pace import Pace
from testbed.control.gaits.crawl.rope_hold import RopeHold
from testbed.control.gaits.hold import Hold
from testbed.control.gaits.own import own_gait
from testbed.control.gaits.sway import SwayGait
from testbed.control.layers.mast import KeepMast
from testbed.control.layers.supervisor import Supervisor
from testbed.scenario.drilling import DrillHole
from testbed.scenario.scenario import Scenario
from testbed.scenario.tasks import Crawl, Program, Sway


def gait_of(scenario: Scenario, start: BelievedStart) -> Gait:
    """The gait of a scenario's task, under the layers that the scenario asks for."""
    task = scenario.task
    gait: Gait
    if isinstance(task, Crawl):
        gait = _crawl(task, start)
    elif isinstance(task, Sway):
        gait = SwayGait(task, start)
    elif isinstance(task, Program):
        gait = own_gait(task.file, start)
    else:
        gait = Hold(start.joints, task, scenario.events)
    layers: list[Layer] = []
    if isinstance(task, DrillHole) and task.keep_mast:
        layers.append(KeepMast(start.legs.feet(start.joints)))
    chosen = scenario.control.distribution
    if chosen != "position_hold":
        from testbed.control.distribution.controllers import controller, distribution

        layers.append(
            distribution(
                start.robot,
                start.rope_directions_in_body,
                controller(chosen, "control.distribution"),
            )
        )
    if scenario.control.supervisor:
        layers.append(Supervisor())
    return Layered(gait, tuple(layers)) if layers else gait


def _crawl(task: Crawl, start: BelievedStart) -> CrawlGait:
    machine = start.robot.machine
    arm_m = float(start.robot.linkage.moment_arm_m(start.joints[0]))
    attachments = start.model.rope_attachments_m
    return CrawlGait(
        task,
        start,
        Footholds(start.model, start.legs, start.joints, machine.ground.friction),
        Pace(machine, arm_m),
        RopeHold(start.anchors_in_body_m, attachments, start.rope_tension_n),
    )
