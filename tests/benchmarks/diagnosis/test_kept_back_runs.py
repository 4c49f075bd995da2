"""Runs kept back one by one: how their rows are summed up, and which folders are refused."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import pytest

from testbed.benchmarks.diagnosis.kept_back_runs import Kept, KeptBackRuns
from testbed.errors import InputError


def _kept(rig: str, run: str, names: tuple[str, ...], diagnosed: float) -> Kept:
    verdict = "effect" if names else "unnamed"
    return Kept(rig, run, verdict, 0.9, names, identified=0.02, diagnosed=diagnosed)


def test_ratios_and_repeats_are_counted_run_by_run(tmp_path: Path) -> None:
    rows = [
        _kept("seal", "1bar", (), 0.01),
        _kept("seal-rerun1", "1bar", (), 0.03),
        _kept("seal-rerun2", "1bar", ("force.spring",), 0.0203),
        _kept("seal", "3bar", (), 0.02),
        _kept("other", "1bar", (), 0.02),
    ]
    found = KeptBackRuns(tmp_path).summarise({str(k): asdict(row) for k, row in enumerate(rows)})
    assert (found["runs"], found["worse_than_identified"]) == (5, 1)
    assert found["largest_ratio"] == pytest.approx(1.5)
    assert found["median_ratio"] == pytest.approx(1.0)
    assert (found["pairs_of_repeats"], found["repeats_named_alike"]) == (3, 1)
    sums, each = KeptBackRuns(tmp_path).tables(found)
    assert sums.rows[-1][1] == "1 of 3" and len(each.rows) == 5


def test_a_folder_without_rigs_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no rig with enough runs"):
        KeptBackRuns(tmp_path).cases()
    with pytest.raises(InputError, match="holds no rig with enough runs"):
        KeptBackRuns(tmp_path / "missing").cases()
