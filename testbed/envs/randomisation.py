"""What varies from episode to episode, as data: named sets in randomisation.yaml, or a mapping of
the same form.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from testbed.effects import by_name
from testbed.effects.parameter_spec import ParameterSpec
from testbed.errors import InputError, check_one_of
from testbed.formats.yaml_files import read_yaml
from testbed.machine.names import LEGS, SIDES
from testbed.machine.scale import ROBOCLIMBER, Scale

FILE = Path(__file__).with_name("randomisation.yaml")
FORMAT = "roboclimber-randomisation/1"


@lru_cache(maxsize=1)
def sets() -> dict[str, dict[str, Any]]:
    """All named sets. Raises InputError if the file is not in the format."""
    data = read_yaml(FILE)
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise InputError("is no randomisation file", file=FILE, field="format", allowed=FORMAT)
    return {name: dict(chosen) for name, chosen in data["sets"].items()}


def reset_options(options: Mapping[str, Any]) -> tuple[bool, list[str]]:
    """What a reset is given: whether the machine stays, and further changes `a.b=c`. Raises
    InputError for another option, and for both.
    """
    for option in options:
        check_one_of(option, ("overrides", "same_machine"), "options", "no such option")
    again, further = bool(options.get("same_machine")), options.get("overrides") or ()
    if again and further:
        raise InputError(
            "would have no effect: options.same_machine rules it",
            field="options.overrides",
            value=list(further),
            allowed="one of both",
        )
    return again, [str(change) for change in further]


UNITS = {"kg": "kg", "n": "N", "m": "m", "hz": "Hz"}
"""What the name of a value that grows with the machine ends in, and its unit."""


def named_set(chosen: str | Mapping[str, Any] | None, scale: Scale = ROBOCLIMBER) -> dict[str, Any]:
    """A set by name, for a machine of this size; or a mapping checked to be one, as it is; None is
    the empty set. Raises InputError.
    """
    if chosen is None:
        return {}
    if isinstance(chosen, str):
        check_one_of(chosen, sets(), "randomisation", "no such set")
        return {path: _grown(path, how, scale) for path, how in sets()[chosen].items()}
    if not isinstance(chosen, Mapping):
        raise InputError(
            "cannot be used",
            field="randomisation",
            value=chosen,
            allowed="the name of a set, or a mapping: path -> how it is drawn",
        )
    for path, how in chosen.items():
        _checked(path, how)
    return dict(chosen)


def _grown(path: str, how: Mapping[str, Any], scale: Scale) -> Mapping[str, Any]:
    """How a value of a shipped set is drawn for a machine of this size."""
    times = scale.times(UNITS.get(path.rpartition("_")[2], "1"))
    return {
        name: [times * number for number in numbers] if times != 1.0 else numbers
        for name, numbers in how.items()
    }


def draw_overrides(
    chosen: Mapping[str, Any], rng: np.random.Generator, scale: Scale = ROBOCLIMBER
) -> list[str]:
    """One draw of a set as changes `a.b=c` of a scenario, in the set's order (so the numbers are
    the seed's). Sizes of effects and faults are those of a machine of this size.
    """
    drawn = []
    for path, how in chosen.items():
        if path == "faults":
            events, patches = _faults(how, rng, scale)
            drawn += [f"events={json.dumps(events)}", f"terrain.patches={json.dumps(patches)}"]
            continue
        value = _undeclared(how, rng, scale) if path == "undeclared" else _draw(path, how, rng)
        drawn.append(f"{path}={json.dumps(value)}")
    return drawn


def _draw(path: str, how: Mapping[str, Any], rng: np.random.Generator) -> Any:
    _checked(path, how)
    if "uniform" in how:
        low, high = how["uniform"]
        return float(rng.uniform(low, high))
    if "integers" in how:
        first, last = how["integers"]
        return int(rng.integers(first, last + 1))
    return how["one_of"][int(rng.integers(len(how["one_of"])))]


def _undeclared(
    how: Mapping[str, Any], rng: np.random.Generator, scale: Scale
) -> list[dict[str, Any]]:
    """At most one effect. The same count of random numbers is taken whether there is one or not."""
    _checked("undeclared", how)
    chance, which, where, size = rng.random(4)
    if chance >= how["probability"]:
        return []
    effect = by_name(how["effects"][int(which * len(how["effects"]))])
    first = effect.parameters[0]
    values = {
        parameter.name: _times(parameter, scale) * float(np.mean(parameter.prior))
        for parameter in effect.parameters
        if parameter.default is None
    }
    low, high = first.prior
    values[first.name] = _times(first, scale) * float(low + size * (high - low))
    return [
        {
            "effect": effect.name,
            "at": how["places"][int(where * len(how["places"]))],
            "parameters": values,
        }
    ]


def _times(parameter: ParameterSpec, scale: Scale) -> float:
    return scale.times(parameter.unit.rpartition(" or ")[2])


def _faults(
    how: Mapping[str, Any], rng: np.random.Generator, scale: Scale
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Events and patches of one or two faults; the same count of random numbers is taken for any of
    them.
    """
    _checked("faults", how)
    two = rng.random() < how["two"]
    events: list[dict[str, Any]] = []
    patches: list[dict[str, Any]] = []
    sides = list(rng.permutation(SIDES))
    for number, kinds in enumerate((how["first"], how["second"])):
        kind, side = kinds[int(rng.integers(len(kinds)))], str(sides[number])
        at_s, size, leg = float(rng.uniform(*how["at_s"])), rng.random(), str(rng.choice(LEGS))
        if number == 1 and not two:
            break
        if kind == "cut_rope":
            events.append({"kind": kind, "at_s": at_s, "rope": side})
        elif kind == "set_rope":
            pay_out_m = scale.times("m") * (0.03 + 0.07 * size)
            slipped = {"pay_out_m": pay_out_m, "duration_s": 1.0}
            events.append({"kind": kind, "at_s": at_s, "rope": side, **slipped})
        else:
            patches.append({"foot": leg, "friction": 0.03 + 0.12 * size})
    return events, patches


def _checked(path: str, how: Any) -> None:
    kinds = {
        "undeclared": {"probability", "effects", "places"},
        "faults": {"at_s", "two", "first", "second"},
    }.get(path)
    plain = ({"uniform"}, {"one_of"}, {"integers"})
    if not isinstance(how, Mapping) or (set(how) != kinds if kinds else set(how) not in plain):
        allowed = (
            ", ".join(sorted(kinds))
            if kinds
            else "uniform: [low, high], integers: [first, last] or one_of: [a, b, ..]"
        )
        raise InputError(
            "cannot be drawn from", field=f"randomisation.{path}", value=how, allowed=allowed
        )
