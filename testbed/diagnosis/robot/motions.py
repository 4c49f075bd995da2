"""The motion that would part two hypotheses: each of a small catalogue is rehearsed on the machine
as it is believed, and the evidence that it may be expected to bring is what it is chosen by.

Nothing is known of the second recording but what the first one says: were hypothesis A true with
the numbers it has there, a motion's balances would miss A's columns times them. What A's evidence
would then be above B's, and B's above A's were B true: the mean of the two is what the motion
promises.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot.groups import Balances
from testbed.diagnosis.robot.hypotheses import Hypothesis, Ledger
from testbed.diagnosis.robot.probabilities import (
    NO_NAME,
    Names,
    calibration,
    likeliest_nameless,
)
from testbed.errors import InputError

if TYPE_CHECKING:
    from testbed.diagnosis.robot.diagnose import RobotDiagnosis

Array = npt.NDArray[np.float64]
FILE = Path(__file__).with_name("motions.yaml")
CLOSE = 0.3
"""Two sets whose probabilities differ by less cannot be told apart."""


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
    """The two likeliest sets of (names, probability), best first, if they cannot be told apart."""
    if len(hypotheses) < 2 or hypotheses[0][1] - hypotheses[1][1] >= CLOSE:
        return None
    return hypotheses[0][0], hypotheses[1][0]


def promises(
    first: Ledger, two: tuple[Names, Names], rehearsals: Mapping[str, Ledger]
) -> dict[str, float]:
    """Motion -> how much evidence it may be expected to bring between two sets of effects; `first`:
    of the recording that could not part them, `rehearsals`: of the believed machine's motions.
    """
    one, other = (first.hypothesis(names) for names in two)
    numbers = parted(first.balances, one) | parted(first.balances, other)

    def above(rehearsed: Ledger, true: Names, false: Names) -> float:
        there = rehearsed.were(true, _as_rehearsed(rehearsed.balances, true, numbers))
        return there.hypothesis(true).log_factor - there.hypothesis(false).log_factor

    ways = ((one.names, other.names), (other.names, one.names))
    return {
        name: 0.5 * sum(above(rehearsed, true, false) for true, false in ways)
        for name, rehearsed in rehearsals.items()
    }


def parted(balances: Balances, hypothesis: Hypothesis) -> dict[str, Array]:
    """Name -> its numbers in a hypothesis."""
    out, first = {}, 0
    for name in hypothesis.names:
        last = first + len(balances.candidates[name].signature)
        out[name] = hypothesis.mean[first:last]
        first = last
    return out


def _as_rehearsed(balances: Balances, names: Names, numbers: Mapping[str, Array]) -> Array:
    """The numbers of a set, one's after the other's; of a course in time, which is another each
    time, as many as a rehearsal has.
    """
    out = [np.zeros(0)]
    for name in names:
        size = len(balances.candidates[name].signature)
        own = numbers[name][:size]
        out.append(np.pad(own, (0, size - len(own))))
    return np.concatenate(out)
