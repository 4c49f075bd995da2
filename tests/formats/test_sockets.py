"""A user's class comes in by one door, is checked against its socket, and answers for its own
errors.
"""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any, Protocol

import pytest

from testbed.errors import InputError, UserCodeError
from testbed.formats.sockets import is_user_class, load_class, load_object, user_code


class Doubler(Protocol):
    """The socket of these tests."""

    def double(self, value: float, times: int) -> float:
        """Twice the value, so many times."""
        ...


GOOD = "class Mine:\n    def double(self, value, times):\n        return value * 2**times\n"


def _file(folder: Path, text: str, name: str = "mine.py") -> Path:
    file = folder / name
    file.write_text(text)
    return file


def test_a_name_with_a_file_and_a_class_is_the_users() -> None:
    assert is_user_class("mine.py:Mine") and is_user_class("C:/a b/mine.py:Mine")
    assert not any(is_user_class(name) for name in ("qp", "mine.py", "mine.npz:Mine", "mine:Mine"))


def test_a_class_that_fits_is_loaded_anew_each_time(tmp_path: Path) -> None:
    file = _file(tmp_path, GOOD)
    assert load_class(f"{file}:Mine", Doubler, field="x")().double(3.0, 2) == 12.0
    _file(tmp_path, GOOD.replace("2**", "3**"))
    assert load_object(f"{file}:Mine", Doubler, field="x").double(3.0, 2) == 27.0


def test_a_relative_file_is_looked_for_in_the_folders_in_their_order(tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    first.mkdir(), second.mkdir()
    _file(second, GOOD)
    found = load_class("mine.py:Mine", Doubler, field="x", folders=(first, second))
    assert found().double(1.0, 1) == 2.0
    _file(first, GOOD.replace("2**", "5**"))
    found = load_class("mine.py:Mine", Doubler, field="x", folders=(first, second))
    assert found().double(1.0, 1) == 5.0


def test_what_lies_beside_the_file_can_be_imported_and_dataclasses_work(tmp_path: Path) -> None:
    _file(tmp_path, "FACTOR = 7.0\n", "beside_the_mine.py")
    text = (
        "from __future__ import annotations\nfrom dataclasses import dataclass\n"
        "from beside_the_mine import FACTOR\n@dataclass\nclass Mine:\n    factor: float = FACTOR\n"
        "    def double(self, value, times):\n        return self.factor\n"
    )
    made = load_object(f"{_file(tmp_path, text)}:Mine", Doubler, field="x")
    assert made.double(0.0, 0) == 7.0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (GOOD.replace("Mine", "Yours"), "--thing = 'Mine': has no such class .allowed: Yours"),
        ("Mine = 3\n", "has no such class .allowed: a class of this file, which has none"),
        ("class Mine: ...\n", r"has no method double .allowed: a class with double\(self, value"),
        (GOOD.replace(", times", ", times, more"), r"double takes other arguments: .*'more'"),
        (
            GOOD.replace(", times", ""),
            r"takes other arguments.*allowed: double\(self, value, times",
        ),
    ],
)
def test_a_class_that_does_not_fit_is_refused(tmp_path: Path, text: str, said: str) -> None:
    file = _file(tmp_path, text)
    with pytest.raises(InputError, match=said) as raised:
        load_class(f"{file}:Mine", Doubler, field="--thing")
    assert str(file) in str(raised.value) and not isinstance(raised.value, UserCodeError)


def test_no_such_file_and_no_such_form_are_refused() -> None:
    with pytest.raises(
        InputError, match=r"nowhere\.py: --thing = 'nowhere\.py:Mine': no such file"
    ):
        load_class("nowhere.py:Mine", Doubler, field="--thing")
    with pytest.raises(InputError, match=r"allowed: FILE\.py:Class"):
        load_class("mine:Mine", Doubler, field="--thing")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("\n1 / 0\n", "line 2 of your own file raised ZeroDivisionError: division by zero"),
        ("def broken(:\n", "line 1 of your own file raised SyntaxError: invalid syntax"),
        (
            "import no_such_thing\n",
            "line 1 .* ModuleNotFoundError: No module named 'no_such_thing'",
        ),
        ("import sys\nsys.exit(3)\n", "line 2 of your own file raised SystemExit: 3"),
    ],
)
def test_what_a_file_raises_while_it_is_imported_is_its_own(
    tmp_path: Path, text: str, said: str
) -> None:
    file = _file(tmp_path, text)
    with pytest.raises(UserCodeError, match=said) as raised:
        load_class(f"{file}:Mine", Doubler, field="x")
    assert str(file) in str(raised.value)


def test_what_it_raises_when_it_runs_is_its_own_and_crosses_to_another_process(
    tmp_path: Path,
) -> None:
    file = _file(tmp_path, GOOD.replace("return value", "return [][times] + value"))
    made: Any = load_object(f"{file}:Mine", Doubler, field="x")
    with (
        pytest.raises(UserCodeError, match=r"line 3 .* IndexError: list index") as raised,
        user_code(),
    ):
        made.double(1.0, 2)
    again = pickle.loads(pickle.dumps(raised.value))
    assert type(again) is UserCodeError and str(again) == str(raised.value) and again.line == 3


def test_what_is_not_theirs_is_left_alone() -> None:
    with pytest.raises(ZeroDivisionError), user_code():
        _ = 1 / 0
    with pytest.raises(InputError, match=r"^bad$"), user_code():
        raise InputError("bad")
