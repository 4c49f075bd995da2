"""Rigs with several runs, each of which is kept back in turn: is what a diagnosis of the others
returns worth more on it than what `identify` makes of them, and are repeats of a rig given the same
names?
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from testbed.benchmarks.diagnosis.measured_rigs import estimate_error
from testbed.benchmarks.harness import Answers, Benchmark, code, digest
from testbed.errors import InputError
from testbed.recording.axis import Recording, Rig, read_rig
from testbed.report.page import Table

FEWEST = 3
"""Runs of a rig of which one can be kept back and the others still differ."""
WORSE = 1.02
"""Error relative to that of the identified model from which a diagnosis did harm."""
REPEAT = re.compile(r"-(?:rerun|repeat)\d+$")
"""What the name of a repeat ends in; before it stands the name of the rig that it repeats."""


@dataclass(frozen=True)
class Kept:
    """One run kept back: verdict and names of a diagnosis of the other runs, and the relative error
    of the estimated force on it, as identified and as diagnosed.
    """

    rig: str
    run: str
    verdict: str
    probability: float
    names: tuple[str, ...]
    identified: float
    diagnosed: float

    @property
    def ratio(self) -> float:
        """Error as diagnosed over that as identified."""
        return self.diagnosed / self.identified

    @property
    def said(self) -> tuple[str, ...]:
        """The names, or the verdict where there are none."""
        return self.names or (self.verdict,)


@dataclass(frozen=True)
class KeptBackRuns(Benchmark[tuple[str, str]]):
    """Every rig below a folder, every run of it kept back once."""

    name = "kept_back_runs"
    noun = "runs"

    folder: Path

    def cases(self) -> Mapping[str, tuple[str, str]]:
        """Rig and run. Raises InputError where no rig has enough runs."""
        rigs = _rigs(self.folder)
        found = {
            f"{rig.name} {run.name}": (rig.name, run.name)
            for rig in rigs
            if len(_runs(rig)) >= FEWEST
            for run in _runs(rig)
        }
        if not found:
            raise InputError(
                "holds no rig with enough runs",
                file=self.folder,
                allowed=f"folders with identify/ and verify/, {FEWEST} runs each at least",
            )
        return found

    def made_from(self, case: tuple[str, str]) -> str:
        """The case, and the recordings of its rig."""
        files = sorted(path for path in (self.folder / case[0]).rglob("*") if path.is_file())
        return digest(repr(case), *map(code, files))

    def work(self, case: tuple[str, str]) -> Kept:
        """Diagnose all runs of a rig but one; judge on that."""
        from testbed.diagnosis.leg.diagnose import diagnose

        rig = read_rig(self.folder / case[0])
        (back,) = (run for run in _runs(rig) if run.name == case[1])
        others = tuple(run for run in _runs(rig) if run.name != case[1])
        found = diagnose(replace(rig, identify=others, verify=(back,)))
        return Kept(
            rig.name,
            back.name,
            found.verdict.kind,
            found.verdict.hypotheses[0][1],
            tuple(entry.name for entry in found.entries),
            estimate_error(back, found.models["identify"]),
            estimate_error(back, found.models["after"]),
        )

    def summarise(self, answers: Answers) -> dict[str, Any]:
        """What all runs say together, and each."""
        found = [Kept(**row | {"names": tuple(row["names"])}) for row in answers.values()]
        ratios = np.array([kept.ratio for kept in found])
        alike = _alike(found)
        return {
            "runs": len(found),
            "worse_than_identified": int(np.sum(ratios > WORSE)),
            "largest_ratio": float(ratios.max()),
            "median_ratio": float(np.median(ratios)),
            "pairs_of_repeats": len(alike),
            "repeats_named_alike": sum(alike),
            "cases": [asdict(kept) | {"ratio": kept.ratio} for kept in found],
        }

    def tables(self, result: Any) -> Sequence[Table]:
        """The sums, and every run."""
        pairs = result["pairs_of_repeats"]
        sums = [
            ["runs kept back", str(result["runs"])],
            [
                f"error over {WORSE} of the identified model's; the largest",
                f"{result['worse_than_identified']}; {result['largest_ratio']:.2f}",
            ],
            ["median of that ratio", f"{result['median_ratio']:.2f}"],
            [
                "pairs of repeats that are given the same names",
                f"{result['repeats_named_alike']} of {pairs}" if pairs else "no repeats",
            ],
        ]
        rows = [
            [
                case["rig"],
                case["run"],
                ", ".join(case["names"]) or case["verdict"],
                f"{case['probability']:.2f}",
                f"{100 * case['identified']:.2f}",
                f"{100 * case['diagnosed']:.2f}",
                f"{case['ratio']:.2f}",
            ]
            for case in result["cases"]
        ]
        heads = ["rig", "kept back", "said", "sure", "identified, %", "diagnosed, %", "ratio"]
        return (
            Table("Each run kept back in turn", ["what", "measured"], sums),
            Table("Force error relative to the force", heads, rows),
        )


def _rigs(folder: Path) -> list[Rig]:
    paths = sorted(folder.iterdir()) if folder.is_dir() else []
    return [read_rig(path) for path in paths if (path / "identify").is_dir()]


def _runs(rig: Rig) -> tuple[Recording, ...]:
    return (*rig.identify, *rig.verify)


def _alike(found: Sequence[Kept]) -> list[bool]:
    """For each pair of repeats of one rig with the same run kept back: whether the same is said."""
    groups: dict[tuple[str, str], list[Kept]] = {}
    for kept in found:
        groups.setdefault((REPEAT.sub("", kept.rig), kept.run), []).append(kept)
    pairs = (pair for group in groups.values() for pair in itertools.combinations(group, 2))
    return [set(one.said) == set(other.said) for one, other in pairs]
