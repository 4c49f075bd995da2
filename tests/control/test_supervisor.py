"""The supervisor stops the drill on a lost foot, lowers one foot at a time and slowly, and lets go
again.
"""

from __future__ import annotations

import numpy as np
import pytest

from testbed.control.gait import Command, Measured
from testbed.control.layers import CALM_S, LOWER_M_S, LOWEST_M, PATIENCE_S, Supervisor
from testbed.machine.names import VERTICAL
from testbed.scenario.tasks import Drill, Push
from testbed.world.drilling.drilling import FADE_S, DrillHold, DrillProgram

DT = 0.01


HELD = Command(np.full(12, 0.25))


def _run(supervisor: Supervisor, seconds: float, *contact: float) -> Command:
    """The last command over HELD while the detector says `contact` (4)."""
    for _ in range(round(seconds / DT)):
        command = supervisor.over(HELD, 0.0, DT, Measured.of(contact=contact))
    return command


def _vertical(command: Command) -> np.ndarray:
    return command.joints[list(VERTICAL)]


def test_while_all_feet_carry_nothing_is_changed() -> None:
    command = _run(Supervisor(), 1.0, 1, 1, 1, 1)
    assert command is HELD


def test_a_lost_foot_stops_the_drill_at_once_and_until_all_have_carried_for_a_while() -> None:
    program = Supervisor()
    _run(program, 0.1, 1, 1, 1, 1)
    assert _run(program, DT, 1, 0, 1, 1).hold_drill and program.stops == 1
    assert _run(program, CALM_S - 2 * DT, 1, 1, 1, 1).hold_drill
    assert not _run(program, 3 * DT, 1, 1, 1, 1).hold_drill


def test_a_foot_that_stays_lost_is_lowered_alone_and_slowly_and_no_farther_than_allowed() -> None:
    program = Supervisor()
    _run(program, 0.1, 1, 1, 1, 1)
    _run(program, 0.05, 1, 0, 1, 1)
    command = _run(program, 1.0, 1, 0, 0, 1)
    lowered = _vertical(command) - 0.25
    assert lowered[1] == pytest.approx(LOWER_M_S * (1.05 - PATIENCE_S), abs=2 * LOWER_M_S * DT)
    assert lowered[[0, 2, 3]] == pytest.approx(0.0)
    assert _vertical(_run(program, 30.0, 1, 0, 1, 1))[1] - 0.25 == pytest.approx(LOWEST_M)


def test_a_foot_that_has_not_carried_yet_is_not_lost() -> None:
    program = Supervisor()
    assert not _run(program, 1.0, 0, 0, 0, 0).hold_drill and program.stops == 0


def test_a_drill_that_is_held_fades_stands_still_and_resumes() -> None:
    task = Drill(
        kind="drill",
        start_s=0.0,
        ramp_s=0.0,
        phases=(Push(kind="push", duration_s=1.0, feed_n=4000.0),),
    )
    drill, hold, t = DrillProgram(task), DrillHold(), 0.0
    feed = []
    for k in range(300):
        hold.update(drill, t, DT, 50 <= k < 200)
        feed.append(drill.loads.feed)
        t += DT
    gone = 50 + round(FADE_S / DT)
    assert feed[49] == 4000.0 and np.all(np.diff(feed[49:gone]) < 0.0) and not any(feed[gone:200])
    assert drill.ordered.thrust == drill.loads.feed
    worked_s = DT * sum(f > 0.0 for f in feed)
    assert worked_s == pytest.approx(1.0, abs=3 * DT)  # the phase lasts 1 s of its own time
