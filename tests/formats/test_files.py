"""Files are there whole or not at all; what cannot be written is named in one line."""

from __future__ import annotations

import json
import os
import stat
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from testbed.errors import InputError
from testbed.formats.files import (
    Lines,
    check_file,
    make_folder,
    plain,
    whole,
    write_json,
    write_text,
)


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


def test_what_is_no_regular_file_is_not_replaced_by_one(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.txt")
    (tmp_path / "folder").mkdir()
    for name in ("pipe.txt", "folder"):
        with pytest.raises(InputError, match=f"{name}: is no regular file"):
            write_text(tmp_path / name, "x")
        with pytest.raises(InputError, match=f"{name}: --out: is no regular file"):
            check_file(tmp_path / name)
    assert stat.S_ISFIFO((tmp_path / "pipe.txt").stat().st_mode)
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["folder", "pipe.txt"]


def test_an_empty_name_is_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match="names no file"):
        write_text("", "x")
    with pytest.raises(InputError, match="--suggest: names no file"):
        check_file("", field="--suggest")
    assert not list(tmp_path.iterdir())


def test_the_place_of_a_file_is_checked_without_a_trace(tmp_path: Path) -> None:
    write_text(tmp_path / "a.csv", "old")
    assert check_file(str(tmp_path / "a.csv"), (".csv", ".parquet")) == tmp_path / "a.csv"
    with pytest.raises(InputError, match=r"a\.txt: --out: unknown ending \(allowed: \.csv\)"):
        check_file(tmp_path / "a.txt", (".csv",))
    with pytest.raises(InputError, match="its folder does not exist"):
        check_file(tmp_path / "nowhere" / "a.csv", within=tmp_path / "later")
    check_file(tmp_path / "later" / "a.csv", within=tmp_path / "later")
    assert [p.name for p in tmp_path.iterdir()] == ["a.csv"] and (
        tmp_path / "a.csv"
    ).read_text() == "old"


def test_lines_grow_whole_and_a_cut_one_stays_alone(tmp_path: Path) -> None:
    path = tmp_path / "lines"
    for text in ("one", "two"):
        with closing(Lines(path)) as lines:
            lines.add(text)
    path.write_text(path.read_text()[:-2])
    with closing(Lines(path)) as lines:
        lines.add("three")
    assert path.read_text() == "one\ntw\nthree\n"


def test_a_line_that_the_disk_does_not_take_is_one_line_of_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        Lines(tmp_path)
    with closing(Lines(Path("/dev/full"))) as lines, pytest.raises(InputError, match="No space"):
        lines.add("text")
