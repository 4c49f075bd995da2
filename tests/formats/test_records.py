"""Named records: their memory, their columns, and that a compiled function sees the same names."""

from __future__ import annotations

import numba
import numpy as np
import pytest

from testbed.formats.records import Record, part, quantity

SIDES = ("left", "right")


class Spring(Record):
    """What a test stretches."""

    length = quantity("m", "length")
    force = quantity("N", "pull at each end", per=SIDES)


class Machine(Record):
    """Records within a record."""

    time = quantity("s", "time")
    springs = part(Spring, "two springs", per=SIDES)
    push = quantity("N", "push", per=(SIDES, ("x", "y")))


class Counter(Record):
    """A whole number."""

    count = quantity("1", "count", kind="i8")


def test_columns_follow_the_declaration_with_unit_and_meaning() -> None:
    assert Machine.column_names() == [
        "time",
        "springs_left_length",
        "springs_left_force_left",
        "springs_left_force_right",
        "springs_right_length",
        "springs_right_force_left",
        "springs_right_force_right",
        "push_left_x",
        "push_left_y",
        "push_right_x",
        "push_right_y",
    ]
    assert [column.unit for column in Spring.columns()] == ["m", "N", "N"]
    assert len(Machine.columns()) == 11 == Machine.dtype.itemsize / 8


def test_a_table_shares_the_memory_of_its_records() -> None:
    records = Machine.zeros(3)
    table = Machine.as_table(records)
    records["push"][1, 0, 1] = 7.0
    assert table[1, Machine.column_names().index("push_left_y")] == 7.0
    with pytest.raises(TypeError, match="Counter"):
        Counter.as_table(Counter.zeros(2))


def test_a_compiled_function_reads_and_writes_by_name() -> None:
    @numba.njit
    def stretch(spring, by):  # type: ignore[no-untyped-def]
        spring.length += by
        spring.force[1] = 2.0 * spring.length

    @numba.njit
    def step(machines):  # type: ignore[no-untyped-def]
        for k in range(2):
            stretch(machines[0].springs[k], 1.0 + k)

    machines = Machine.zeros()
    step(machines)
    np.testing.assert_array_equal(machines["springs"]["length"][0], [1.0, 2.0])
    np.testing.assert_array_equal(machines["springs"]["force"][0], [[0.0, 2.0], [0.0, 4.0]])


def test_no_records_are_an_empty_table_and_back() -> None:
    class Pair(Record):
        left = quantity("m", "left")
        right = quantity("m", "right")

    assert Pair.as_table(Pair.zeros(0)).shape == (0, 2)
    assert Pair.from_table(np.zeros((0, 2))).shape == (0,)
    assert Pair.from_table(np.array([[1.0, 2.0]]))["right"].tolist() == [2.0]
