"""How far a task has come: what its gait and its drill say of it, for summary.json."""

from __future__ import annotations

from typing import Any

from testbed.control.gait import Gait, Layered
from testbed.world.drilling.drilling import Drilling


def progress(gait: Gait, drill: Drilling, t: float) -> dict[str, Any]:
    """`done` (True where a task has no end of its own), and how much of what was wanted is made.

    A gait tells by a method `progress(t)`, one of a user's own too: a mapping with `done`.
    """
    while isinstance(gait, Layered):
        gait = gait.gait
    told = getattr(gait, "progress", None)
    parts = [drill.progress(), *([] if told is None else [told(t)])]
    found: dict[str, Any] = {}
    for part in parts:
        found |= part
    return {"done": all(bool(part.get("done", True)) for part in parts)} | {
        name: value for name, value in found.items() if name != "done"
    }
