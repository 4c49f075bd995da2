"""Compares a run's summary with what its scenario expects, and tells what the scenario hid from the
model.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from testbed.scenario.events import Bound, Expect
from testbed.scenario.scenario import Scenario, load_scenario


def unmet(expect: Expect, summary: Mapping[str, Any]) -> list[str]:
    """One line for each expectation that the summary does not meet; empty where all are met."""
    lines = []
    if expect.verdict is not None and summary.get("verdict") != expect.verdict:
        lines.append(f"verdict is {summary.get('verdict')!r}, expected {expect.verdict!r}")
    for path, bound in expect.summary.items():
        lines += _broken(path, bound, lookup(summary, path))
    return lines


def lookup(tree: Any, path: str) -> Any:
    """The value at a dotted path, None where there is none; a number counts a list's entries."""
    for key in path.split("."):
        if isinstance(tree, Mapping):
            tree = tree.get(key)
        elif isinstance(tree, (list, tuple)) and key.isdigit() and int(key) < len(tree):
            tree = tree[int(key)]
        else:
            return None
    return tree


def _broken(path: str, bound: Bound, value: Any) -> list[str]:
    if bound.equals is not None:
        return [] if value == bound.equals else [f"{path} is {value!r}, expected {bound.equals!r}"]
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return [f"{path} is {value!r}, expected a number"]
    lines = []
    if bound.min is not None and not value >= bound.min:
        lines.append(f"{path} is {value:g}, expected at least {bound.min:g}")
    if bound.max is not None and not value <= bound.max:
        lines.append(f"{path} is {value:g}, expected at most {bound.max:g}")
    return lines


def hidden_effects(scenario: Scenario) -> str:
    """What a scenario hides from the model, for a result that is set beside it: "effect at place,
    ..." or "nothing".
    """
    return (
        ", ".join(
            f"{hidden_.effect} at {hidden_.at.replace('_', ' ')}" for hidden_ in scenario.undeclared
        )
        or "nothing"
    )


def hidden_numbers(scenario: Scenario) -> list[dict[str, Any]]:
    """The same with name, place and parameters apart."""
    return [
        {"name": hidden_.effect, "place": hidden_.at, "parameters": dict(hidden_.parameters)}
        for hidden_ in scenario.undeclared
    ]


def elsewhere(scenario: Scenario, name: str, seed: int) -> Scenario:
    """Scenario `name` with the machine of another one and the effects that it hides."""
    machine = scenario.machine.model_dump(mode="json", exclude_none=True)
    hidden = [one.model_dump(mode="json") for one in scenario.undeclared]
    overrides = [f"undeclared={json.dumps(hidden)}"]
    overrides += [f"machine.{key}={json.dumps(value)}" for key, value in machine.items()]
    return load_scenario(name, overrides, seed)
