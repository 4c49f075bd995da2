"""Fields of a scenario that another of its fields puts out of use.

One that is given beside it would change nothing and is refused. A file's own fields are not, where
only a change from outside (`--set ropes.enabled=false`) puts them out of use: they become what they
are by default.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from testbed.errors import InputError

if TYPE_CHECKING:
    from testbed.scenario.scenario import Scenario


@dataclass(frozen=True)
class Rule:
    """Fields that do nothing unless another one, `ruler`, is as `allowed` says."""

    fields: str
    """Pattern of their dotted paths."""
    ruler: str
    allowed: str
    holds: Callable[[Scenario], bool]
    """Whether they do nothing in a scenario."""


NUMBERS = r"hydraulics\.parameters\."
RULES = (
    Rule(r"ropes\.(?!enabled$)\w+", "ropes.enabled", "true", lambda s: not s.ropes.enabled),
    Rule(r"ropes\.share", "ropes.tension_n", "null", lambda s: s.ropes.tension_n is not None),
    Rule(r"control\.dither_hz", "control.dither_m", "> 0", lambda s: s.control.dither_m == 0.0),
    Rule(r"control\.thrust_reserve", "task", "one that drills", lambda s: s.drilling is None),
    Rule(r"terrain\.settle_s", "terrain.plastic_n_m", "> 0", lambda s: not s.terrain.loose),
    Rule(
        r"terrain\.(hurst|roughness_seed)",
        "terrain.roughness_m",
        "> 0",
        lambda s: s.terrain.roughness_m == 0.0,
    ),
    Rule(
        r"terrain\.cell_m",
        "terrain.kind",
        "heightfield or elevation",
        lambda s: s.terrain.kind not in ("heightfield", "elevation"),
    ),
    Rule(
        rf"{NUMBERS}(axes\.\w+\.|\w+_)cylinder\.(coulomb|static|stribeck|viscous)_\w+",
        "hydraulics.without",
        "a list without friction",
        lambda s: "friction" in s.hydraulics.without,
    ),
    Rule(
        rf"{NUMBERS}(axes\.\w+\.)?sensor\.pressure_(noise|resolution)_pa",
        "sensors.without",
        "a list without pressure",
        lambda s: "pressure" in s.sensors.without,
    ),
    Rule(
        rf"{NUMBERS}traction\.(stroke_m|seat_m|clamp_s|return_speed_m_s)",
        "ropes.strokes",
        "true",
        lambda s: not s.ropes.strokes,
    ),
)


def put_out_of_use(
    scenario: Scenario, given: Mapping[str, object], changes: Collection[str], file: Path
) -> list[str]:
    """The fields of a file that changes from outside put out of use.

    given: dotted paths of all fields and numbers that are given, with their values; changes: paths
    of what is changed from outside. Raises InputError for a field that was given beside what puts
    it out of use.
    """
    found = []
    for path, rule in _idle(scenario, given):
        if _told(path, changes) or not _told(rule.ruler, changes):
            raise InputError(
                f"would have no effect: {rule.ruler} rules it",
                file=file,
                field=path,
                value=given[path],
                allowed=f"it where {rule.ruler} is {rule.allowed}",
            )
        found.append(path)
    return found


def _idle(scenario: Scenario, given: Mapping[str, object]) -> Iterator[tuple[str, Rule]]:
    """Fields that do nothing, with what rules them; one that has its default value does no harm."""
    for path, value in given.items():
        for rule in RULES:
            if re.fullmatch(rule.fields, path) and rule.holds(scenario):
                section, _, field = path.partition(".")
                known = type(getattr(scenario, section)).model_fields
                if field not in known or value != known[field].default:
                    yield path, rule
                    break


def _told(path: str, changes: Collection[str]) -> bool:
    """Whether one of the changes is of this field, or of a group that holds it."""
    return any(path == change or path.startswith(f"{change}.") for change in changes)
