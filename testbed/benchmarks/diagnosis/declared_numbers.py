"""Declared numbers that are wrong: a rig's bore, rod and mass are declared otherwise than they are,
one at a time, and `identify` says what it made of each.

A declared number is a prior. So it may stay, or move within its tolerance and be told; where the
data contradict it that is said. What must never happen is that it moves unsaid, or that moving it
costs accuracy on recordings that were kept back.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from testbed.benchmarks.diagnosis.bench_rigs import make_bench
from testbed.benchmarks.diagnosis.measured_rigs import drive_error, estimate_error
from testbed.benchmarks.harness import Answers, Benchmark, code, digest
from testbed.benchmarks.reference_leg.rigs import make_rig
from testbed.errors import InputError
from testbed.estimation.friction.identification import Identification, identify_rig
from testbed.recording.axis import Recording, Rig, read_rig
from testbed.recording.known import Known
from testbed.report.page import Table

NUMBERS = ("bore_m", "rod_m", "moving_mass_kg")
OFF = (0.0, 0.01, -0.01, 0.05, -0.05, 0.2, -0.2)
"""Shares by which a number is declared too large."""
HELD = 1.0e-6
"""Tolerance of a number that may not move."""
SAME = 1.0e-6
"""Share by which a number differs that has not moved."""
WORSE = 1.02
"""Error relative to that with the declared number held from which moving it did harm."""
KEPT, MOVED, CONTRADICTED, UNSAID, REFUSED = OUTCOMES = (
    "kept",
    "moved and told",
    "contradicted",
    "moved unsaid",
    "refused",
)


@dataclass(frozen=True)
class Declared:
    """One number of one rig, declared too large by the share `off`. `tolerances`: by how many of
    its own it moved. `error`: relative force error on what was kept back; `held`: the same were the
    number not to move; null where the rig has none, or is refused.
    """

    rig: str
    kind: str
    number: str
    off: float
    outcome: str
    tolerances: float = 0.0
    error: float | None = None
    held: float | None = None

    @property
    def ratio(self) -> float | None:
        """Error over that with the number held."""
        return self.error / self.held if self.error is not None and self.held else None


@dataclass(frozen=True)
class DeclaredNumbers(Benchmark[tuple[str, str]]):
    """Every rig below some folders, and every number that it declares; without folders drawn
    benches, drives and legs.
    """

    name = "declared_numbers"
    noun = "numbers"
    beside = ("reference_leg",)

    folders: tuple[Path, ...] = ()
    rigs: int = 4
    first_seed: int = 500

    def cases(self) -> Mapping[str, tuple[str, str]]:
        """Rig and number. Raises InputError where a folder holds no rig."""
        places = [str(path) for folder in self.folders for path in _rigs(folder)]
        places = places or [f"{kind} {seed}" for kind in ("bench", "leg") for seed in self._seeds()]
        return {f"{place} {number}": (place, number) for place in places for number in NUMBERS}

    def _seeds(self) -> range:
        return range(self.first_seed, self.first_seed + self.rigs)

    def made_from(self, case: tuple[str, str]) -> str:
        """The case, and the recordings of its rig."""
        files = sorted(path for path in Path(case[0]).rglob("*") if path.is_file())
        return digest(repr(case), *map(code, files))

    def work(self, case: tuple[str, str]) -> list[Declared]:
        """What comes of the number, declared as it is and otherwise; nothing where it is not
        declared.
        """
        place, number = case
        rig = read_rig(place) if self.folders else _drawn(place)
        right = getattr(rig.known, number)
        return [] if not right else [_declared(rig, number, right, off) for off in OFF]

    def summarise(self, answers: Answers) -> dict[str, Any]:
        """By kind of rig and size of the error, and each."""
        found = [Declared(**row) for rows in answers.values() for row in rows]
        if not found:
            raise InputError("declare none of these numbers", allowed=", ".join(NUMBERS))
        kinds = sorted({one.kind for one in found})
        sizes = sorted({abs(off) for off in OFF})
        return {
            "rigs": dict(Counter(kind for kind, _ in {(one.kind, one.rig) for one in found})),
            "numbers": len({(one.rig, one.number) for one in found}),
            "all": _sums(found),
            "by_kind": {
                kind: {
                    f"{size:g}": _sums([o for o in found if o.kind == kind and abs(o.off) == size])
                    for size in sizes
                }
                for kind in kinds
            },
            "each": [asdict(one) for one in found],
        }

    def tables(self, result: Any) -> Sequence[Table]:
        """The sums by kind and size, and each number."""
        sums = [
            [kind, f"{100 * float(size):g} %", *_row(row)]
            for kind, sizes in result["by_kind"].items()
            for size, row in sizes.items()
        ]
        heads = ["rig", "off by", "declared", *OUTCOMES, "largest ratio", f"over {WORSE}"]
        each = [_each(Declared(**row)) for row in result["each"]]
        of_each = ["rig", "number", "off by", "outcome", "tolerances moved", "error", "if held"]
        return (
            Table("What identify makes of declared numbers", heads, sums),
            Table("Each number", of_each, each),
        )


def _rigs(folder: Path) -> list[Path]:
    """Every folder below this one, or it itself, that has identify/."""
    found = sorted(path.parent for path in folder.rglob("identify") if path.is_dir())
    if not found:
        raise InputError("holds no rig", file=folder, allowed="folders with identify/ and verify/")
    return found


def _drawn(place: str) -> Rig:
    """The sound rig of a kind and a seed."""
    kind, seed = place.split()
    rig, _ = make_bench(int(seed)) if kind == "bench" else make_rig(int(seed), "clean")
    return rig


def _declared(rig: Rig, number: str, right: float, off: float) -> Declared:
    """What `identify` makes of the number where it is declared too large by the share `off`."""
    declared = right * (1.0 + off)
    row = Declared(rig.name, rig.kind, number, off, REFUSED)
    try:
        wrong = rig.known.model_validate(rig.known.model_dump() | {number: declared})
        found = identify_rig(_knowing(rig, wrong))
        tight = wrong.model_copy(update={"tolerances": wrong.tolerances | {number: HELD}})
        held = identify_rig(_knowing(rig, tight))
    except (InputError, ValueError):
        return row
    used = {one.name: one for one in found.used if one.declared is not None}
    told = used.get(number)
    tolerances = told.tolerances_off if told is not None and told.tolerances_off else 0.0
    outcome = MOVED if told is not None else UNSAID
    if abs(getattr(found.model.known, number) / declared - 1.0) < SAME:
        outcome = KEPT
    elif told is not None and told.at_bound:
        outcome = CONTRADICTED
    error, if_held = _error(rig.verify, found), _error(rig.verify, held)
    return replace(row, outcome=outcome, tolerances=tolerances, error=error, held=if_held)


def _knowing(rig: Rig, known: Known) -> Rig:
    """The rig with other declared numbers."""
    return replace(
        rig,
        identify=tuple(_declaring(recording, known) for recording in rig.identify),
        verify=tuple(_declaring(recording, known) for recording in rig.verify),
    )


def _declaring(recording: Recording, known: Known) -> Recording:
    """The recording with other declared numbers."""
    return replace(recording, header=recording.header.model_copy(update={"known": known}))


def _error(recordings: Sequence[Recording], found: Identification) -> float | None:
    """Root mean square over recordings that were kept back of the relative error of the force."""
    errors = list(_errors(recordings, found))
    return float(np.sqrt(np.mean(np.square(errors)))) if errors else None


def _errors(recordings: Sequence[Recording], found: Identification) -> Iterator[float]:
    for recording in recordings:
        if recording.rig == "drive":
            yield drive_error(recording, found.model)
        elif not recording.is_free:
            yield estimate_error(recording, found.model)


def _sums(found: Sequence[Declared]) -> dict[str, Any]:
    counts = Counter(one.outcome for one in found)
    ratios = [one.ratio for one in found if one.ratio is not None]
    return {
        "declared": len(found),
        **{outcome: counts[outcome] for outcome in OUTCOMES},
        "largest_ratio": max(ratios, default=None),
        "worse": sum(ratio > WORSE for ratio in ratios),
    }


def _row(row: Mapping[str, Any]) -> list[str]:
    largest = row["largest_ratio"]
    counts = [str(row[name]) for name in ("declared", *OUTCOMES)]
    return [*counts, "" if largest is None else f"{largest:.3f}", str(row["worse"])]


def _each(one: Declared) -> list[str]:
    errors = ["" if e is None else f"{100 * e:.2f} %" for e in (one.error, one.held)]
    off, moved = f"{100 * one.off:+g} %", f"{one.tolerances:.2f}"
    return [one.rig, one.number, off, one.outcome, moved, *errors]
