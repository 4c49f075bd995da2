"""Numbers that are declared wrongly: how what comes of them is called and counted."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path

import pytest

from testbed.benchmarks.diagnosis import declared_numbers
from testbed.benchmarks.diagnosis.bench_rigs import make_bench
from testbed.benchmarks.diagnosis.declared_numbers import (
    CONTRADICTED,
    KEPT,
    MOVED,
    OFF,
    UNSAID,
    Declared,
    DeclaredNumbers,
)
from testbed.errors import InputError
from testbed.estimation.friction.identification import identify_rig
from testbed.recording.axis import Rig

CYLINDER = 501


@pytest.fixture(scope="module")
def rows() -> dict[float, Declared]:
    """What comes of the bore of a drawn cylinder, by how much it is declared too large."""
    rig, _ = make_bench(CYLINDER)
    assert rig.kind == "cylinder"
    place = f"bench {CYLINDER}"
    return {row.off: row for row in DeclaredNumbers().work((place, "bore_m"))}


@pytest.mark.slow
def test_a_bore_within_its_tolerance_moves_and_one_beyond_is_contradicted(
    rows: dict[float, Declared],
) -> None:
    assert rows.keys() == set(OFF)
    assert {rows[off].outcome for off in (0.05, -0.05)} == {MOVED}
    assert {rows[off].outcome for off in (0.2, -0.2)} == {CONTRADICTED}
    assert all(row.tolerances <= 3.0 + 1e-9 for row in rows.values())
    assert rows[0.05].ratio is not None and rows[0.05].ratio < 1.0


@pytest.mark.slow
def test_a_declared_number_that_is_right_costs_nothing(rows: dict[float, Declared]) -> None:
    assert rows[0.0].outcome == KEPT and rows[0.0].ratio == pytest.approx(1.0)


def test_a_number_that_moves_without_being_told_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    def silent(rig: Rig) -> object:
        return replace(identify_rig(rig), used=())

    monkeypatch.setattr(declared_numbers, "identify_rig", silent)
    rig, _ = make_bench(CYLINDER)
    row = declared_numbers._declared(rig, "bore_m", rig.known.bore_m or 0.0, 0.05)
    assert row.outcome == UNSAID


def test_sums_are_by_kind_and_size() -> None:
    each = [
        Declared("a", "cylinder", "bore_m", 0.01, MOVED, 0.5, 0.02, 0.01),
        Declared("a", "cylinder", "bore_m", -0.01, KEPT, 0.0, 0.01, 0.01),
        Declared("b", "drive", "moving_mass_kg", 0.2, CONTRADICTED, 3.0),
    ]
    found = DeclaredNumbers().summarise({"all": [asdict(one) for one in each]})
    small = found["by_kind"]["cylinder"]["0.01"]
    assert (small[MOVED], small[KEPT], small["worse"]) == (1, 1, 1)
    assert small["largest_ratio"] == pytest.approx(2.0)
    assert found["by_kind"]["drive"]["0.2"]["largest_ratio"] is None
    assert (found["numbers"], found["rigs"]) == (2, {"cylinder": 1, "drive": 1})
    sums, rows = DeclaredNumbers().tables(found)
    assert len(sums.rows) == 8 and len(rows.rows) == 3


def test_folders_without_rigs_and_rigs_without_numbers_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no rig"):
        DeclaredNumbers((tmp_path,)).cases()
    with pytest.raises(InputError, match="declare none of these numbers"):
        DeclaredNumbers((tmp_path,)).summarise({"x bore_m": []})
