"""A table of numbers is read whole, whatever its first megabyte looks like."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from testbed.formats.table import in_one_block, read_columns, write_columns

ROWS = 300_000


@pytest.fixture
def large(tmp_path: Path) -> Path:
    """A CSV of more than two megabytes: whole numbers at first, then halves, then a cell that is
    not there.
    """
    path = tmp_path / "large.csv"
    lines = [f"{row},{row % 7 if row < ROWS // 2 else 0.5}" for row in range(ROWS)]
    lines[-1] = f"{ROWS - 1},"
    path.write_text("t,F\n" + "\n".join(lines) + "\n")
    assert path.stat().st_size > 2 << 20
    return path


def test_numbers_that_are_whole_for_a_megabyte_may_go_on_with_halves(large: Path) -> None:
    read = read_columns(large, {"t": "time", "F": "force"}, large)
    np.testing.assert_array_equal(read["t"], np.arange(ROWS))
    assert read["F"][ROWS // 2] == 0.5 and np.isnan(read["F"][-1])


def test_a_table_is_read_in_one_go_by_one_thread(large: Path) -> None:
    options = in_one_block(large.stat().st_size)
    assert not options.use_threads and options.block_size > large.stat().st_size
    assert in_one_block(2**40).block_size == 2**31 - 1, "the most that there is"


def test_a_table_comes_back_as_it_was_written(tmp_path: Path) -> None:
    columns = {"t": np.arange(5) / 3.0, "F": np.array([1e-300, -0.0, 7.0, np.pi, 1e300])}
    for ending in ("csv", "parquet"):
        path = tmp_path / f"table.{ending}"
        write_columns(path, columns)
        read = read_columns(path, {"t": "time", "F": "force"}, path)
        for name, values in columns.items():
            np.testing.assert_array_equal(read[name], values)
