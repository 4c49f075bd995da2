"""The motion that would part two hypotheses: each of a small catalogue is rehearsed on the machine
as it is believed, and the evidence that it may be expected to bring is what it is chosen by.

Nothing is known of the second recording but what the first one says: see expected_evidence.py.
Where none of the catalogue promises enough to part the two, no motion is chosen, and what would
tell them apart is said in words: some pairs no motion on the feet can part, as a spring and a
cushion that begins beyond the end of its cylinder.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from testbed.diagnosis.robot.diagnose import AMBIGUOUS, RobotDiagnosis
from testbed.diagnosis.robot.expected_evidence import ExpectedEvidence
from testbed.diagnosis.robot.groups import Balances
from testbed.diagnosis.robot.hypotheses import Ledger
from testbed.diagnosis.robot.probabilities import (
    NO_NAME,
    Names,
    calibration,
    likeliest_nameless,
)
from testbed.diagnosis.robot.unexplained import is_unexplained
from testbed.effects import by_name, kind_of
from testbed.errors import InputError

FILE = Path(__file__).with_name("motions.yaml")
CLOSE = 0.3
"""Two sets whose probabilities differ by less cannot be distinguished."""


@dataclass(frozen=True)
class Motion:
    """One of the catalogue: what a scenario says otherwise."""

    name: str
    text: str
    task: Mapping[str, Any]
    events: tuple[Mapping[str, Any], ...]

    def overrides(self) -> list[str]:
        """As `load_scenario` takes them."""
        import json

        return [f"task={json.dumps(self.task)}", f"events={json.dumps(self.events)}"]


@cache
def motions() -> tuple[Motion, ...]:
    """The catalogue, `motions.yaml`."""
    import yaml

    found: dict[str, Any] = yaml.safe_load(FILE.read_text(encoding="utf-8"))
    return tuple(
        Motion(name, row["text"], row["task"], tuple(row.get("events", ())))
        for name, row in found.items()
    )


def motion_named(name: str) -> Motion:
    """The motion of that name. Raises InputError with the names there are."""
    for motion in motions():
        if motion.name == name:
            return motion
    allowed = ", ".join(motion.name for motion in motions())
    raise InputError("no motion has that name", value=name, allowed=allowed)


def parted_sets(found: RobotDiagnosis) -> tuple[Names, Names] | None:
    """The rivals of a diagnosis as sets of effects that a motion can be rehearsed with: what no
    name covers is the likeliest of all that have none, for a motion that shows a name's effect
    need not part it from that.
    """
    two = rivals(found.verdict.hypotheses)
    if two is None:
        return None
    nameless = likeliest_nameless(found.signs, calibration())
    one, other = (nameless if names == NO_NAME else names for names in two)
    return one, other


def rivals(hypotheses: tuple[tuple[Names, float], ...]) -> tuple[Names, Names] | None:
    """The two likeliest sets of (names, probability), best first, if indistinguishable."""
    if len(hypotheses) < 2 or hypotheses[0][1] - hypotheses[1][1] >= CLOSE:
        return None
    return hypotheses[0][0], hypotheses[1][0]


def promises(
    first: Ledger, two: tuple[Names, Names], rehearsals: Mapping[str, Balances]
) -> dict[str, float]:
    """Motion -> how much evidence it may be expected to bring between two sets of effects; `first`:
    of the recording that could not part them, `rehearsals`: of the believed machine's motions.
    """
    expected = ExpectedEvidence(first, two)
    return {name: expected.gain(rehearsed) for name, rehearsed in rehearsals.items()}


def parting(promised: Mapping[str, float]) -> list[str]:
    """The motions that promise to part the two, the best first: a gap that is smaller leaves two
    names ambiguous with each other, however it falls out.
    """
    least = AMBIGUOUS / float(calibration()["share"])
    enough = [name for name, gap in promised.items() if gap >= least]
    return sorted(enough, key=promised.__getitem__, reverse=True)


def instead_of_a_motion(two: tuple[Names, Names]) -> str:
    """What would tell two sets apart that no motion of the catalogue parts, in words."""
    one, other = two
    first = tuple(name for name in one if name not in other)
    second = tuple(name for name in other if name not in one)
    said = list(dict.fromkeys(_what_tells((first, second))))
    return "; ".join(["no motion of the catalogue parts them", *said])


def _what_tells(apart: tuple[Names, Names]) -> Iterator[str]:
    """What is known of names that are in one of two sets alone: what tells them from each other,
    and what shows each of them alone.
    """
    listed = tuple([n for n in names if not is_unexplained(n)] for names in apart)
    for own, others in (listed, listed[::-1]):
        for name in own:
            alike = by_name(kind_of(name)).alike
            yield from (alike[kind_of(other)] for other in others if kind_of(other) in alike)
    for name in (*listed[0], *listed[1]):
        motion = by_name(kind_of(name)).telling_motion
        if motion:
            yield f"{name} by itself: {motion}"
