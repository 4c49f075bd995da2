"""What each number of the early warning is worth: it and its neighbours judged on scenes that are
kept.

    testbed lab warning-numbers OUT --split tuning

reads the scenes that `testbed contact-loss --out OUT` left and prints precision and share warned of
in time for the rule as it is, without plan and orders, on the true load, and with one number at a
time lower and higher. The numbers were set by a random search and such tables, on the tuning split
alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from testbed.benchmarks.contact_loss.recordings import Tape, facts_of, read_tape
from testbed.benchmarks.contact_loss.scenes import SETTLE_S, Scene, draw
from testbed.benchmarks.contact_loss.score import NEAR_SHARE, Reference
from testbed.benchmarks.contact_loss.warning import (
    added_up,
    looked_at,
    means,
    outcome,
    planned_thrust,
)
from testbed.benchmarks.contact_loss.warning_rule import NUMBERS, NUMBERS_ON_TRUTH, STEP_S
from testbed.errors import InputError
from testbed.formats.records import SET

CHANGES = (0.8, 1.25)
GONE_CHANGES_N = (-150.0, 150.0)
"""Factors on a number; what the load of a foot that is gone is changed by, as it may be nothing."""


class Kept:
    """One scene with what the warning looks at."""

    def __init__(self, scene: Scene, tape: Tape) -> None:
        late = tape.time_s >= SETTLE_S
        meant = tape.samples["row"]["carrying"][late] > SET
        self.off = Reference.of(tape.normal_n[late], meant, tape.time_s[late], tape.rule)
        own = np.asarray(tape.samples["row"]["estimate"]["own"])
        self.carrying = means(np.asarray(tape.samples["row"]["carrying"]), tape.dt_s)
        self.loads = {"own": means(own, tape.dt_s), "true": means(tape.normal_n, tape.dt_s)}
        self.near_n = NEAR_SHARE * tape.rule.nominal_load_n
        self.plan = planned_thrust(draw(scene).scenario.task, len(self.loads["true"]), STEP_S)

    def outcome(
        self, kind: str, numbers: Mapping[str, float], planned: bool = True
    ) -> dict[str, Any]:
        """See warning.outcome."""
        seen = looked_at(self.loads[kind])
        if planned:
            seen = looked_at(self.loads[kind], self.plan, self.carrying)
        return outcome(self.off, seen, self.loads["true"], self.near_n, numbers)


def kept_scenes(out: Path, split: str) -> list[Kept]:
    """Scenes of a split without a supervisor. Raises InputError where there is none."""
    places = sorted((out / "scenes").glob(f"{split}-*"))
    chosen = [place for place in places if (place / "truth.parquet").is_file()]
    found = [
        Kept(Scene(**facts_of(place)["scene"]), read_tape(place))
        for place in chosen
        if facts_of(place)["scene"]["kind"] != "supervised"
        and facts_of(place)["simulated_s"] > SETTLE_S
    ]
    if not found:
        raise InputError("holds no scenes", file=out, field="--split", value=split)
    return found


def line(name: str, outcomes: Sequence[dict[str, Any]]) -> str:
    """One row of the table."""
    found = added_up(outcomes)
    right, in_time = found["precision"], found["warned_100_ms_ahead"]
    shares = ["   –" if value is None else f"{value:.3f}" for value in (right, in_time)]
    return f"{name:32s} {shares[0]} of {found['warnings']:4d} right   {shares[1]} of {found['gradual_losses']:3d} in time"


def neighbours() -> list[tuple[str, dict[str, float]]]:
    """The rule's numbers with one at a time changed."""
    found = []
    for name, number in NUMBERS.items():
        changed = [number * factor for factor in CHANGES]
        if name == "gone":
            changed = [number + change for change in GONE_CHANGES_N]
        for value in changed if name != "step" else []:
            found.append((f"{name} = {value:.4g}", {**NUMBERS, name: value}))
    return found


def report(out: Path, split: str) -> Iterator[str]:
    """The table's rows for the scenes that `testbed contact-loss --out OUT` left, one by one.

    Raises InputError where there are none.
    """
    scenes = kept_scenes(out, split)
    yield line("as it is", [s.outcome("own", NUMBERS) for s in scenes])
    yield line(
        "without plan and orders",
        [s.outcome("own", NUMBERS, planned=False) for s in scenes],
    )
    yield line("on the true load", [s.outcome("true", NUMBERS_ON_TRUTH) for s in scenes])
    for name, numbers in neighbours():
        yield line(name, [s.outcome("own", numbers) for s in scenes])
