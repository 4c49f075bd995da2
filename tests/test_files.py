"""Files are there whole or not at all; what cannot be written is named in one line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from testbed.errors import InputError
from testbed.files import make_folder, plain, whole, write_json, write_text


def test_numbers_of_numpy_and_what_is_not_finite() -> None:
    tree = {1: np.float32(0.5), "b": (np.arange(2), np.inf), "c": [float("nan"), True, None, "x"]}
    assert plain(tree) == {"1": 0.5, "b": [[0, 1], None], "c": [None, True, None, "x"]}


def test_json_is_read_back_as_it_was(tmp_path: Path) -> None:
    write_json(tmp_path / "a.json", {"µ": np.array([0.1, np.nan])})
    assert json.loads((tmp_path / "a.json").read_text(encoding="utf-8")) == {"µ": [0.1, None]}


@pytest.mark.parametrize("fault", [KeyboardInterrupt, ValueError])
def test_a_write_that_breaks_off_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, fault: type[BaseException]
) -> None:
    write_text(tmp_path / "a", "old")
    with pytest.raises(fault), whole(tmp_path / "a") as hidden:
        hidden.write_text("half of the n")
        raise fault
    assert [p.name for p in tmp_path.iterdir()] == ["a"] and (tmp_path / "a").read_text() == "old"


def test_where_nothing_can_be_written_one_line_names_the_place(tmp_path: Path) -> None:
    write_text(tmp_path / "file", "")
    with pytest.raises(InputError, match="file/deeper: --out: cannot be written: Not a directory"):
        make_folder(tmp_path / "file" / "deeper")
    with pytest.raises(InputError, match=r"nowhere/a\.txt: cannot be written: No such file"):
        write_text(tmp_path / "nowhere" / "a.txt", "x")


def test_a_folder_is_made_with_its_parents_and_left_empty(tmp_path: Path) -> None:
    assert not list(make_folder(tmp_path / "a" / "b").iterdir())
