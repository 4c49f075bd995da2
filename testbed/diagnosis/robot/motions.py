"""The motion that would part two hypotheses: each of a small catalogue is rehearsed on the machine
as it is believed, and chosen by the chance that it tells them apart.

Nothing is known of the second recording but what the first one says: see expected_evidence.py.
Where none of the catalogue promises enough to part the two, no motion is chosen, and what would
tell them apart is said in words: some pairs no motion on the feet can part, as a spring that rests
at the end of its cylinder and a cushion that begins there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

from testbed.diagnosis.robot.diagnose import PLACE_IN_DOUBT, RobotDiagnosis
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
from testbed.effects import by_name, kind_of, place_of
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
    leg: str = ""
    """The one that moves, of a motion that shows its own effects alone."""

    def shows_any_of(self, names: Iterable[str]) -> bool:
        """Whether it is made to show one of these effects."""
        places = (place_of(name) or "" for name in names)
        return not self.leg or any(place.partition("_")[0] == self.leg for place in places)

    def overrides(self) -> list[str]:
        """As `load_scenario` takes them."""
        import json

        return [f"task={json.dumps(self.task)}", f"events={json.dumps(self.events)}"]

    def ways(self) -> Iterator[Motion]:
        """The motion, and where it is a sway the same ever less far: how far legs reach differs
        from stance to stance.
        """
        yield self
        if "amplitude_m" in self.task:
            for share in LESS_FAR:
                amplitude = [round(share * way, 3) for way in self.task["amplitude_m"]]
                yield replace(self, task={**self.task, "amplitude_m": amplitude})


LESS_FAR = (0.85, 0.7, 0.55)
"""Shares of a sway that are tried where a leg does not reach further."""
Made = TypeVar("Made")


def made(motion: Motion, make: Callable[[list[str]], Made]) -> tuple[Motion, Made]:
    """What `make` makes of a motion's overrides, as far as the legs reach, and how far that is.
    Raises InputError where it refuses all of its ways.
    """
    refused = InputError("cannot be made from here", value=motion.name)
    for way in motion.ways():
        try:
            return way, make(way.overrides())
        except InputError as error:
            refused = error
    raise refused


@cache
def motions() -> tuple[Motion, ...]:
    """The catalogue, `motions.yaml`."""
    import yaml

    found: dict[str, Any] = yaml.safe_load(FILE.read_text(encoding="utf-8"))
    return tuple(
        Motion(name, row["text"], row["task"], tuple(row.get("events", ())), row.get("leg", ""))
        for name, row in found.items()
    )


def motions_for(parted: Iterable[Names]) -> tuple[Motion, ...]:
    """Those of the catalogue that are made to show one of the effects of these sets."""
    names = {name for one in parted for name in one}
    return tuple(motion for motion in motions() if motion.shows_any_of(names))


def motion_named(name: str) -> Motion:
    """The motion of that name. Raises InputError with the names there are."""
    for motion in motions():
        if motion.name == name:
            return motion
    allowed = ", ".join(motion.name for motion in motions())
    raise InputError("no motion has that name", value=name, allowed=allowed)


def parted_sets(found: RobotDiagnosis) -> dict[Names, float]:
    """The sets of effects that a motion is to part, with their probabilities, the likeliest first;
    none where the diagnosis has decided. Beside the two that it cannot decide between these are
    the next ones of at least LIKELY, at most MOST in all.

    What no name covers is one of them where it is of the two: the likeliest of all sets that have
    none, for a motion that shows a name's effect need not part it from that.
    """
    hypotheses = found.verdict.hypotheses
    two = undecided(found)
    if two is None:
        return {}
    more = [names for names, p in hypotheses[2:] if p >= LIKELY and names != NO_NAME]
    chances = dict(hypotheses)
    nameless = likeliest_nameless(found.signs, calibration())
    return {
        nameless if names == NO_NAME else names: chances[names] for names in (*two, *more)[:MOST]
    }


LIKELY, MOST = 0.05, 4
"""Least probability of a set beside the two likeliest that a motion is to part as well, and so many
sets at most.
"""


def undecided(found: RobotDiagnosis) -> tuple[Names, Names] | None:
    """The two likeliest sets of a diagnosis, best first, where it cannot decide between them, or
    where the place of what it names is not sure enough for forces to be corrected; else None.
    """
    hypotheses = found.verdict.hypotheses
    if found.not_believed == PLACE_IN_DOUBT and len(hypotheses) > 1:
        return hypotheses[0][0], hypotheses[1][0]
    return rivals(hypotheses)


def rivals(hypotheses: tuple[tuple[Names, float], ...]) -> tuple[Names, Names] | None:
    """The two likeliest sets of (names, probability), best first, if indistinguishable."""
    if len(hypotheses) < 2 or hypotheses[0][1] - hypotheses[1][1] >= CLOSE:
        return None
    return hypotheses[0][0], hypotheses[1][0]


def promises(
    first: Ledger, parted: Mapping[Names, float], rehearsals: Mapping[str, Balances]
) -> dict[str, float]:
    """Motion -> the chance that with it the true one of these sets of effects is said; `parted`:
    the sets with their probabilities, `first`: of the recording, or recordings, that could not part
    them, `rehearsals`: of the believed machine's motions.
    """
    expected = ExpectedEvidence(first, parted)
    return {name: expected.chance(rehearsed) for name, rehearsed in rehearsals.items()}


def parting(promised: Mapping[str, float], parted: Mapping[Names, float]) -> list[str]:
    """The motions that promise to part these sets, the best first: those with which the true one is
    said by WORTH more often than if the likeliest were said without any.
    """
    already = max(parted.values(), default=0.0) / (sum(parted.values()) or 1.0)
    enough = [name for name, chance in promised.items() if chance >= already + WORTH]
    return sorted(enough, key=promised.__getitem__, reverse=True)


WORTH = 0.1
"""Least gain of the chance that the true set is said for which a motion is made (E)."""


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
