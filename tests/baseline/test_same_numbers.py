"""A rebuild leaves the numbers alone: ten runs against what they were when they were recorded."""

from __future__ import annotations

from pathlib import Path

import baseline_runs
import numpy as np
import pytest

RANGE_SHARE = 1e-9
"""Readings agree within this share of their column's range, until one of them rounds the other
way.
"""
FIGURE_SHARE = 1e-3
PARTED_SHARE = 0.05
"""Figures agree within the first share, or within the second where readings part on the way: feet
that touch and slide carry the last bit in which processors differ on.
"""
SURELY_ROWS = 5
"""So many first rows agree in any case: no encoder or converter rounds differently before."""


def _first_difference(
    name: str, before: dict[str, np.ndarray], now: dict[str, np.ndarray]
) -> tuple[int, str]:
    """The first row in which a column differs by more than RANGE_SHARE of its range, and that
    column.
    """
    first, culprit = len(next(iter(before.values()))), ""
    for column, old in before.items():
        new = now[column]
        assert new.shape == old.shape, (
            f"{name}: {column} has {len(new)} rows where {len(old)} were recorded"
        )
        scale = max(float(np.ptp(old)), float(np.abs(old).max()), 1e-12)
        apart = np.flatnonzero(np.abs(new - old) > RANGE_SHARE * scale)
        if apart.size and apart[0] < first:
            first, culprit = int(apart[0]), column
    return first, culprit


@pytest.mark.slow
@pytest.mark.parametrize("name", baseline_runs.RUNS)
def test_a_run_gives_the_numbers_it_gave(name: str, tmp_path: Path) -> None:
    before, now = baseline_runs.load(name), baseline_runs.make(name, tmp_path)
    assert set(before.columns) <= set(now.columns), "a column is gone"
    first, culprit = _first_difference(name, before.columns, now.columns)
    assert first >= SURELY_ROWS, f"{culprit} differs from row {first} on"
    assert now.verdict == before.verdict
    parts = first < len(next(iter(before.columns.values())))
    share = PARTED_SHARE if parts else FIGURE_SHARE
    for figure, value in before.figures.items():
        assert now.figures[figure] == pytest.approx(value, rel=share), figure
