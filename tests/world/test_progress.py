"""What became of a task: one that has no end of its own is done where the run came to its end."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from testbed.control.gait import Measured
from testbed.control.gaits.standing import Hold
from testbed.scenario.tasks import Raise
from testbed.world.summary import progress

LIMITS = np.tile([[-0.5, 0.5], [0.0, 0.5], [0.0, 0.5]], (4, 1))
"""Of the joints, (12, 2), rad or m."""


def told(gait: dict[str, Any] | None, drill: dict[str, Any], to_its_end: bool) -> dict[str, Any]:
    mine: Any = SimpleNamespace() if gait is None else SimpleNamespace(progress=lambda _: gait)
    theirs: Any = SimpleNamespace(progress=lambda: drill)
    return progress(mine, theirs, 1.0, to_its_end)


@pytest.mark.parametrize("to_its_end", [True, False])
def test_a_stand_is_done_where_the_run_came_to_its_end(to_its_end: bool) -> None:
    assert told(None, {}, to_its_end) == {"done": to_its_end}
    assert told(None, {"phase": "hammer"}, to_its_end) == {"done": to_its_end, "phase": "hammer"}


def test_a_task_that_says_itself_when_it_is_done_is_believed() -> None:
    assert told({"done": True, "steps_made": 4}, {}, False) == {"done": True, "steps_made": 4}
    assert told({"done": True}, {"done": False}, True) == {"done": False}


@pytest.mark.parametrize("reached_m", [0.25, 0.347, 0.349])
def test_a_raise_is_done_when_the_pistons_are_there(reached_m: float) -> None:
    """Not when they have been told to be: a machine without pressure stays where it is."""
    start = np.tile([0.0, 0.2, 0.25], 4)
    task = Raise(kind="raise", start_s=0.0, to_m=0.35, step_m=0.05, every_s=2.0)
    gait = Hold(start, task, (), LIMITS)
    gait.command(60.0, 0.01, Measured.of(position=np.tile([0.0, 0.2, reached_m], 4)))
    assert gait.progress(60.0) == {
        "done": reached_m > 0.348,
        "raised_to_m": pytest.approx(reached_m),
        "raised_wanted_m": 0.35,
    }
    gait.command(0.1, 0.01, Measured.of(position=np.tile([0.0, 0.2, 0.35], 4)))
    assert not gait.progress(0.1)["done"], "it has not been told to go there yet"


def test_a_raise_shortens_no_leg_that_is_longer_already() -> None:
    """On uneven ground legs start at lengths of their own."""
    start = np.tile([0.0, 0.2, 0.25], 4)
    start[2] = 0.4
    task = Raise(kind="raise", start_s=0.0, to_m=0.35, step_m=0.05, every_s=2.0)
    wanted = Hold(start, task, (), LIMITS).command(60.0, 0.01, Measured.of()).joints[2::3]
    assert wanted == pytest.approx([0.4, 0.35, 0.35, 0.35])
