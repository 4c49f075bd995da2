"""A walking machine for tests, without a world: it follows its set points perfectly."""

from __future__ import annotations

import math

import numpy as np
from shipped import believed_robot, shipped_robot

from testbed.control.gait import BelievedStart, Measured
from testbed.control.gaits.crawl.gait import CrawlGait
from testbed.control.gaits.table import gait_of
from testbed.scenario.scenario import Scenario, load_scenario

TICK = 0.01
LEGS = shipped_robot().legs
START = np.tile([0.0, 0.17, 0.25], 4) + np.radians([5.0, 0, 0, -5.0, 0, 0, -5.0, 0, 0, 5.0, 0, 0])
ANCHORS = np.array([[30.0, 5.0, 0.1], [30.0, -5.0, 0.1]])
LOADS = np.full(4, 7000.0)
TENSION = np.full(2, 13300.0)


def scenario(*changes: str) -> Scenario:
    return load_scenario("crawl_slope_45", list(changes))


def believed_start(scenario: Scenario, joints: np.ndarray = START) -> BelievedStart:
    return BelievedStart(
        joints=joints,
        load_n=LOADS,
        rope_tension_n=TENSION,
        rope_directions_in_body=ANCHORS / 30.0,
        anchors_in_body_m=ANCHORS,
        robot=believed_robot(scenario),
        rope_strokes=scenario.ropes.strokes,
    )


def crawl(*changes: str) -> CrawlGait:
    spec = scenario(*changes)
    made = gait_of(spec, believed_start(spec))
    assert isinstance(made, CrawlGait)
    return made


def at_the_start() -> Measured:
    return Measured.of(
        position=START,
        load=LOADS,
        contact=1.0,
        rope_tension=TENSION,
        attitude=[0.0, -math.radians(45.0), 0.0],
        supply_pressure=9.0e6,
    )


def step(
    made: CrawlGait, seen: Measured, t: float, loads: np.ndarray | None = None
) -> tuple[Measured, np.ndarray, np.ndarray]:
    """What is measured after a tick in which the feet feel `loads` (4); the command's joints and
    stance.

    Without loads, feet in stance feel LOADS and the others nothing.
    """
    command = made.command(t, TICK, seen)
    seen = seen.but(
        position=command.joints,
        load=np.where(command.stance, LOADS, 0.0) if loads is None else loads,
        rope_tension=made._ropes.wanted_n(made._body),
    )
    return seen, command.joints, command.stance
