"""What became of a task: one that has no end of its own is done where the run came to its end."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from testbed.world.summary import progress


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
