"""What contact_loss.json holds of the result: what a reader or a page quotes, and no more."""

from __future__ import annotations

from typing import Any

from testbed.benchmarks.contact_loss.summary import COMMISSIONED

Tree = dict[str, Any]
IN_CLASS = ("losses", "recall", "false_alarms_per_hour", "false_flight_s_per_hour")
"""What contact_loss.json says of a load class."""


def published(result: Tree) -> Tree:
    """What contact_loss.json holds: of all detectors their marks and by load class the few that
    count, of the best one its losses by kind; no curves, which the page draws.
    """
    found = result | {
        "detectors": [_published(entry) for entry in result["detectors"]],
        "warning": {k: v for k, v in result["warning"].items() if k != "curve"},
    }
    if result.get(COMMISSIONED) is not None:
        found[COMMISSIONED] = published(result[COMMISSIONED])
    return found


def _published(entry: Tree) -> Tree:
    left_out = {"curve", "trade", "by_class", "at_floor_budget"} | (
        set() if entry["best"] else {"by"}
    )
    found = {word: value for word, value in entry.items() if word not in left_out}
    budget = entry["at_floor_budget"]
    at_budget = None if budget is None else _in_short(budget) | {"threshold": budget["threshold"]}
    return found | _in_short(entry) | {"at_floor_budget": at_budget}


def _in_short(marks: Tree) -> Tree:
    """Marks by load class, and over all."""
    kept = {word: marks[word] for word in IN_CLASS}
    classes = marks["by_class"].items()
    return kept | {"by_class": {word: {k: m[k] for k in IN_CLASS} for word, m in classes}}
