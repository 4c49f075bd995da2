"""From evidence to a distribution over sets of names.

Each hypothesis has ln of a Bayes factor against a sound machine (hypotheses.py), which is exact for
the linear model and its noise; neither is exact for the machine. So evidence counts by a share of
itself, and a price stands against every step away from a sound machine:

    score(none) = 0
    score(set) = share (ln B - sound) - price(size)
    score(no name) = share' (ln B - sound) - price(unnamed)

and probabilities go as exp(score). `sound` is what sound machines reach, for each kind of effect of
the set: some signatures look like what the model itself is wrong about, others like nothing. An
effect's law is another than its signature to the letter: a second effect must explain more than a
share `form` of what the first explains, and what errors of any course at its places explain beyond
a set counts against it (`rest`). Errors of any course in time fit what is wrong with the
model itself, too: their evidence counts by less (share'). Sets that hold what no name covers, or a
tolerance of any workshop far beyond its size, count as `unnamed`. The numbers are in
`calibration.yaml`; `testbed lab fit-robot-diagnosis` fits them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from testbed.diagnosis.robot.hypotheses import Hypothesis
from testbed.diagnosis.robot.unexplained import UNNAMED, is_unexplained
from testbed.effects import by_name, kind_of, place_of

FILE = Path(__file__).with_name("calibration.yaml")
Names = tuple[str, ...]
NO_NAME: Names = (UNNAMED,)


@dataclass(frozen=True)
class RobotSigns:
    """What was tried on one recording: (names, ln of the Bayes factor against a sound machine)."""

    sets: tuple[tuple[Names, float], ...]

    @classmethod
    def of(cls, hypotheses: list[Hypothesis]) -> RobotSigns:
        """The signs of a finished search."""
        return cls(tuple((h.names, round(h.log_factor, 3)) for h in hypotheses))

    def as_json(self) -> list[Any]:
        """Plain lists."""
        return [[list(names), factor] for names, factor in self.sets]

    @classmethod
    def from_json(cls, rows: list[Any]) -> RobotSigns:
        """The signs that `as_json` wrote."""
        return cls(tuple((tuple(names), float(factor)) for names, factor in rows))


def distribution(signs: RobotSigns, numbers: Mapping[str, Any]) -> dict[Names, float]:
    """Probability of every set of names, () for a sound machine and NO_NAME; they add up to 1."""
    scores: dict[Names, list[float]] = {(): [0.0]}
    alone = {names[0]: factor for names, factor in signs.sets if len(names) == 1}
    for names, factor in signs.sets:
        unnamed = not has_names(names)
        price = numbers["two" if len(names) == 2 else "unnamed" if unnamed else "one"]
        if unnamed:
            price += numbers["unnamed"] - numbers["one"] if len(names) == 2 else 0.0
        else:
            price += numbers["rest"] * _left_at_its_places(names, factor, alone)
        bends = any(is_unexplained(name) for name in names)
        share = numbers["share_unnamed" if bends else "share"]
        above = factor - sum(numbers["sound"].get(kind_of(name), 0.0) for name in names)
        if len(names) == 2:
            above -= numbers["form"] * max(0.0, *(alone.get(name, 0.0) for name in names))
        scores.setdefault(NO_NAME if unnamed else names, []).append(share * above - price)
    top = max(max(row) for row in scores.values())
    weights = {names: sum(math.exp(score - top) for score in row) for names, row in scores.items()}
    total = sum(weights.values())
    return {names: weight / total for names, weight in weights.items()}


def _left_at_its_places(names: Names, factor: float, alone: Mapping[str, float]) -> float:
    """By how much errors of any course at the places of a set explain more than the set does."""
    places = {place_of(name) for name in names}
    most = max(
        (f for n, f in alone.items() if is_unexplained(n) and place_of(n) in places), default=0.0
    )
    return max(most - max(factor, 0.0), 0.0)


def has_names(names: Names) -> bool:
    """Whether every effect of a set is one that a model may lack: not unexplained, no tolerance of
    any workshop.
    """
    return not any(is_unexplained(n) or by_name(kind_of(n)).is_tolerance for n in names)


@cache
def calibration() -> Mapping[str, Any]:
    """The numbers that are shipped."""
    import yaml

    found: Mapping[str, Any] = yaml.safe_load(FILE.read_text(encoding="utf-8"))
    return found
