"""Rows of a run by field and by column: the same numbers either way."""

from __future__ import annotations

import numpy as np
import pytest

from testbed.formats.records import Record, part, quantity
from testbed.simulation.rows import Rows


class Inner(Record):
    """A field of a field."""

    force = quantity("N", "on each foot", per=("left", "right"))


class Row(Record):
    """A small row."""

    t = quantity("s", "time")
    foot = part(Inner, "feet")
    angle = quantity("rad", "of a joint")


def table(*times: float) -> np.ndarray:
    """Columns t, two forces, angle."""
    t = np.array(times)
    return np.column_stack([t, 10.0 * t, -10.0 * t, t / 3.0])


@pytest.fixture
def rows() -> Rows:
    rows = Rows(Row)
    rows.add(table(0.0, 0.1))
    rows.add(table(0.2))
    return rows


def test_no_rows_are_an_empty_table() -> None:
    rows = Rows(Row)
    assert len(rows) == 0 and rows.table.shape == (0, 4) and rows["t"].shape == (0,)


def test_blocks_follow_one_another(rows: Rows) -> None:
    assert len(rows) == 3 and rows["t"].tolist() == [0.0, 0.1, 0.2]
    rows.add(table(0.3))
    assert rows.table.shape == (4, 4) and rows["t"][-1] == 0.3


def test_a_field_of_a_field_is_its_columns_side_by_side(rows: Rows) -> None:
    left, right = (name for name in rows.columns if name.endswith(("left", "right")))
    np.testing.assert_array_equal(rows["foot"]["force"], np.column_stack([rows[left], rows[right]]))
    with pytest.raises(KeyError):
        rows["feet"]


def test_rows_after_an_end_are_forgotten_and_those_at_it_kept(rows: Rows) -> None:
    rows.end_at(0.1)
    assert rows["t"].tolist() == [0.0, 0.1]


def test_a_file_holds_time_in_full_and_all_else_to_24_bits(rows: Rows) -> None:
    kept = rows.as_recorded()
    assert kept["t"][1] == 0.1
    assert kept["angle"][1] == float(np.float32(0.1 / 3.0)) != 0.1 / 3.0
