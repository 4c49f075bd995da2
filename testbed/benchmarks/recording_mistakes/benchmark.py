"""Every mistake of the table planted into every recording, and what `testbed check` says of each;
and what it says of the recordings as they are.
"""

from __future__ import annotations

import re
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from testbed.benchmarks.harness import Answers, Benchmark, code, digest, wilson
from testbed.benchmarks.recording_mistakes.drawn import drawn_cases, drawn_sample
from testbed.benchmarks.recording_mistakes.sample import Sample, load
from testbed.benchmarks.recording_mistakes.table import OUTCOMES, Mistake, lacks, mistakes
from testbed.errors import InputError
from testbed.estimation.friction.identification import identify_rig
from testbed.recording.axis import Rig, read_recording
from testbed.recording.axis_header import AXIS_RIGS
from testbed.recording.checker.check import check_recording
from testbed.recording.checker.finding import Finding
from testbed.recording.checker.raw import read_raw
from testbed.recording.foot import read_foot
from testbed.recording.robot import read_robot
from testbed.report.page import Table

USES = ("read", "identify", "diagnose")
SAME = 1e-9
"""Share by which numbers in SI may differ that were written in two units."""
SHOWN = 2
"""Complaints that a table shows of one recording."""
FIGURES = re.compile(r"[-+]?\d[\d.e+-]*")


@dataclass(frozen=True)
class Planted:
    """One mistake in one recording.

    `outcome`: one of OUTCOMES; of what is not wrong at all `quiet`, `complains` or `other numbers`.
    `hidden`: what the recording lacks so that physics cannot show it. `said`: the complaints that
    the untouched recording does not have. `used`: what a reader, or an analysis, makes of it:
    `works`, or its refusal or fault.
    """

    group: str
    mistake: str
    outcome: str
    hidden: str | None
    said: tuple[str, ...]
    used: str


@dataclass(frozen=True)
class RecordingMistakes(Benchmark[str]):
    """Every recording below some folders, and every mistake that it can have; without folders those
    of drawn benches, drives and legs.
    """

    name = "recording_mistakes"
    noun = "recordings"
    beside = ("diagnosis", "reference_leg")

    folders: tuple[Path, ...] = ()
    rigs: int = 6
    first_seed: int = 500
    only: tuple[str, ...] = ()
    use: str = "read"

    def cases(self) -> Mapping[str, str]:
        """Every recording. Raises InputError where a folder holds none."""
        if not self.folders:
            return {name: name for name in drawn_cases(self.rigs, self.first_seed)}
        return {str(path): str(path) for folder in self.folders for path in _recordings(folder)}

    def made_from(self, case: str) -> str:
        """The case, its files, and how it is used."""
        files = sorted(path for path in Path(case).glob("*") if path.is_file())
        return digest(repr((case, self.only, self.use)), *map(code, files))

    def work(self, case: str) -> dict[str, Any]:
        """What is said of a recording as it is, and of it with each mistake."""
        sample = load(case) if self.folders else drawn_sample(case)
        with tempfile.TemporaryDirectory() as place:
            sound = sample.write(Path(place) / "sound")
            already = _complaints(sound)
            planted = [
                self._planted(group, mistake, sample, already, Path(place))
                for group, rows in mistakes().items()
                for mistake in rows
                if mistake.applies(sample) and (not self.only or mistake.name in self.only)
            ]
        return {
            "rig": sample.head["rig"],
            "false_complaints": [_line(finding) for finding in already],
            "planted": [asdict(one) for one in planted],
        }

    def _planted(
        self, group: str, mistake: Mistake, sample: Sample, already: Sequence[Finding], place: Path
    ) -> Planted:
        spoilt = sample.with_mistake(mistake.planter())
        folder = spoilt.write(place / "planted")
        known = {_kind(finding) for finding in already}
        new = [finding for finding in _complaints(folder) if _kind(finding) not in known]
        hidden = mistake.hidden_by(sample, spoilt)
        if mistake.sound:
            outcome = "complains" if new else "quiet"
            if not _same_numbers(place / "sound", folder):
                outcome = "other numbers"
        else:
            outcome = mistake.outcome(sample, new)
        used = _used(partial(_use, folder, sample.head["rig"], self.use))
        return Planted(group, mistake.name, outcome, hidden, tuple(map(_line, new)), used)

    def summarise(self, answers: Answers) -> dict[str, Any]:
        """By mistake and by kind of rig, false complaints, and every case that was not named."""
        rows = [
            {"recording": name, "rig": answer["rig"]} | one
            for name, answer in answers.items()
            for one in answer["planted"]
        ]
        wrong = [row for row in rows if row["outcome"] in OUTCOMES]
        shown = [row for row in wrong if row["hidden"] is None]
        sound = [row for row in rows if row["outcome"] not in OUTCOMES]
        complaints = {
            name: answer["false_complaints"]
            for name, answer in answers.items()
            if answer["false_complaints"]
        }
        return {
            "recordings": len(answers),
            "by_rig": dict(Counter(answer["rig"] for answer in answers.values())),
            "planted": len(shown),
            **_counts(shown),
            "shares": {name: count / max(len(shown), 1) for name, count in _counts(shown).items()},
            "rightly": _rightly(shown),
            "hidden": len(wrong) - len(shown),
            "rigs": {
                rig: _counts([row for row in shown if row["rig"] == rig])
                for rig in sorted({row["rig"] for row in shown})
            },
            "mistakes": {
                name: _of_mistake([row for row in wrong if row["mistake"] == name])
                for name in dict.fromkeys(row["mistake"] for row in wrong)
            },
            "declared_as_they_are": dict(Counter(row["outcome"] for row in sound)),
            "recordings_with_complaints": len(complaints),
            "complaints": complaints,
            "faults": [row for row in rows if row["used"].startswith("fault")],
            "not_named": [row for row in shown if row["outcome"] not in OUTCOMES[:2]],
            "units_not_quiet": [row for row in sound if row["outcome"] != "quiet"],
        }

    def tables(self, result: Any) -> Sequence[Table]:
        """The sums, each mistake, what physics cannot show, and each that was not named."""
        heads = ["mistake", "planted", *OUTCOMES, "cannot show", "of these found"]
        return (
            Table("What was planted, and what was said", ["what", "measured"], _sums(result)),
            Table("Each mistake", heads, [_row(n, r) for n, r in result["mistakes"].items()]),
            Table(
                "What physics cannot show",
                ["mistake", "in recordings", "lack", "why"],
                [
                    [name, str(count), lack, lacks()[lack]]
                    for name, row in result["mistakes"].items()
                    for lack, count in row["lacking"].items()
                ],
            ),
            Table(
                "Each that was not named",
                ["recording", "mistake", "outcome", "said"],
                [
                    [_short(row["recording"]), row["mistake"], row["outcome"], _said(row["said"])]
                    for row in result["not_named"] + result["units_not_quiet"]
                ],
            ),
            Table(
                "Complaints about recordings as they are",
                ["recording", "said"],
                [[_short(name), _said(said)] for name, said in result["complaints"].items()],
            ),
        )


def _recordings(folder: Path) -> list[Path]:
    """Every recording below a folder, or it itself."""
    found = sorted(path.parent for path in folder.rglob("recording.yaml"))
    if not found:
        raise InputError("holds no recording", file=folder, allowed="folders with recording.yaml")
    return found


def _complaints(folder: Path) -> list[Finding]:
    return [f for f in check_recording(folder).findings if f.severity != "note"]


def _kind(finding: Finding) -> tuple[str, str]:
    """What is said, without its figures."""
    return finding.channel, FIGURES.sub("#", finding.what)


def _line(finding: Finding) -> str:
    return f"{finding.severity} {finding.channel}: {finding.what} ({finding.evidence})"


def _same_numbers(one: Path, other: Path) -> bool:
    first, second = read_raw(one), read_raw(other)
    pairs = [(first.time_s, second.time_s)]
    pairs += [(values, second.series[name]) for name, values in first.series.items()]
    return all(
        np.allclose(a, b, rtol=SAME, atol=SAME * float(np.max(np.abs(a))), equal_nan=True)
        for a, b in pairs
    )


def _use(folder: Path, rig: str, use: str) -> None:
    """Read a recording, and identify or diagnose the axis that it is of, if asked to."""
    if rig not in AXIS_RIGS:
        _ = read_robot(folder) if rig == "robot" else read_foot(folder)
        return
    recording = read_recording(folder)
    whole = Rig(folder.name, folder, (recording,), (recording,))
    if use == "identify":
        identify_rig(whole)
    elif use == "diagnose":
        from testbed.diagnosis.leg.diagnose import diagnose

        diagnose(whole)


def _used(use: Callable[[], None]) -> str:
    try:
        use()
    except InputError as error:
        return f"refused: {error.field or ''} {' '.join(error.problem.split())}"
    except Exception as error:  # a fault of ours, which is what is looked for
        return f"fault: {type(error).__name__}: {error}"
    return "works"


def _counts(rows: Sequence[Mapping[str, Any]]) -> dict[str, int]:
    found = Counter(row["outcome"] for row in rows)
    return {outcome: found[outcome] for outcome in OUTCOMES}


def _rightly(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """How many name the right channel and kind, first or among others, with its 95 % interval."""
    hits = sum(row["outcome"] in OUTCOMES[:2] for row in rows)
    low, high = wilson(hits, len(rows)) or (0.0, 1.0)
    return {"count": hits, "share": hits / max(len(rows), 1), "low95": low, "high95": high}


def _of_mistake(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    shown = [row for row in rows if row["hidden"] is None]
    hidden = [row for row in rows if row["hidden"] is not None]
    return {
        "planted": len(shown),
        **_counts(shown),
        "hidden": len(hidden),
        "hidden_and_found": sum(row["outcome"] != "missed" for row in hidden),
        "lacking": dict(Counter(row["hidden"] for row in hidden)),
    }


def _sums(result: Mapping[str, Any]) -> list[list[str]]:
    of = result["planted"]
    kinds = ", ".join(f"{count} {rig}" for rig, count in result["by_rig"].items())
    units = ", ".join(f"{count} {what}" for what, count in result["declared_as_they_are"].items())
    return [
        ["recordings", f"{result['recordings']} ({kinds})"],
        ["mistakes planted that a recording can show; that it cannot", f"{of}; {result['hidden']}"],
        *([f"... {outcome}", _share(result[outcome], of)] for outcome in OUTCOMES),
        ["units declared as they are", units or "none"],
        ["recordings as they are that are complained about", str(len(result["complaints"]))],
        ["faults on reading or using them", str(len(result["faults"]))],
    ]


def _share(count: int, of: int) -> str:
    return f"{count} ({100 * count / of:.1f} %)" if of else "0"


def _row(name: str, row: Mapping[str, Any]) -> list[str]:
    counts = [row["planted"], *(row[outcome] for outcome in OUTCOMES)]
    return [name, *map(str, counts), str(row["hidden"]), str(row["hidden_and_found"])]


def _short(recording: str) -> str:
    return "/".join(Path(recording).parts[-3:])


def _said(lines: Sequence[str]) -> str:
    more = f"; and {len(lines) - SHOWN} more" if len(lines) > SHOWN else ""
    return ("; ".join(lines[:SHOWN]) or "nothing") + more
