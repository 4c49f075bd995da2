"""Named errors: one line each, whatever they carry, here and in another process."""

from __future__ import annotations

import errno
import pickle
from pathlib import Path

import pytest

from testbed.errors import InputError, SimulationFault, UserCodeError, disk_refusal, naming


def test_the_line_names_file_field_value_and_what_is_allowed() -> None:
    error = InputError(
        "is out of range", file="a.yaml", field="task.feed_n", value=-1.0, allowed="at least 0"
    )
    assert str(error) == "a.yaml: task.feed_n = -1.0: is out of range (allowed: at least 0)"


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ({}, "is wrong"),
        ({"file": "a.yaml"}, "a.yaml: is wrong"),
        ({"field": "seed"}, "seed: is wrong"),
        ({"value": 3}, "3: is wrong"),
        ({"allowed": "1"}, "is wrong (allowed: 1)"),
    ],
)
def test_what_is_not_known_is_left_out(given: dict[str, object], line: str) -> None:
    assert str(InputError("is wrong", **given)) == line  # type: ignore[arg-type]


def test_a_path_is_said_as_it_was_given() -> None:
    error = InputError("would have no effect", field="--out", value=Path("x.html"))
    assert str(error) == "--out = 'x.html': would have no effect"


def test_line_ends_and_long_values_make_no_second_line_and_no_endless_one() -> None:
    error = InputError("is\nwrong", field="text", value="x" * 10_000, allowed="less\n\n of it")
    assert "\n" not in str(error) and len(str(error)) < 150
    assert "..." in str(error) and error.value == "x" * 10_000


def test_an_error_without_a_file_gets_the_one_that_is_being_read() -> None:
    with (
        pytest.raises(InputError, match=r"^run/data\.parquet: t: stands still$"),
        naming("run/data.parquet"),
    ):
        raise InputError("stands still", field="t")


def test_an_error_that_names_its_file_keeps_it() -> None:
    with pytest.raises(InputError, match=r"^other\.yaml: is missing$"), naming("run/data.parquet"):
        raise InputError("is missing", file="other.yaml")


def test_what_a_users_file_raised_says_file_line_and_kind_and_crosses_processes() -> None:
    error = UserCodeError("mine.py", 7, ZeroDivisionError("division by zero"))
    line = "mine.py: line 7 of your own file raised ZeroDivisionError: division by zero"
    assert str(error) == line
    again = pickle.loads(pickle.dumps(error))
    assert isinstance(again, UserCodeError) and (str(again), again.line) == (line, 7)


def test_what_was_raised_without_words_is_said_to_be() -> None:
    assert str(UserCodeError("mine.py", 1, KeyError())).endswith("KeyError: no message")


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS])
def test_a_disk_that_takes_no_more_is_bad_input_with_its_place(number: int) -> None:
    error = disk_refusal(OSError(number, "full", "runs/a"))
    assert error is not None and str(error) == "runs/a: cannot be written: full"


@pytest.mark.parametrize(
    "other", [OSError(errno.ENOENT, "no such file"), ValueError("no"), SimulationFault("nan")]
)
def test_any_other_error_is_another_matter(other: Exception) -> None:
    assert disk_refusal(other) is None
