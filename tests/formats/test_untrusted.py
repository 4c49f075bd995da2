"""Tables, grids and JSON of unknown origin: what would run code, never end or fill the memory is
refused at once.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import testbed
from testbed.errors import InputError
from testbed.formats import table
from testbed.formats.files import read_json
from testbed.formats.table import open_series, read_columns
from testbed.scenario.elevation import read_elevation

PACKAGE = Path(testbed.__file__).parent


class Evil:
    """Makes a folder where it is unpickled."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[Any, tuple[str]]:
        return os.mkdir, (str(self.mark),)


@pytest.mark.parametrize("text", ["[" * 200_000, "[1]", "{", '{"a": NaN', ""])
def test_json_that_is_no_object_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(InputError, match=r"a\.json: "):
        read_json(tmp_path / "a.json")


def test_a_parquet_file_that_stands_for_more_than_fits_is_refused_unread(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(table, "MOST_VALUES", 1999)
    path = tmp_path / "data.parquet"
    pq.write_table(pa.table({"t": np.zeros(1000), "x": np.zeros(1000)}), path)
    monkeypatch.setattr(table, "read_parquet", lambda *_: pytest.fail("it was read"))
    with pytest.raises(InputError, match=r"data\.parquet: holds 2e\+03 numbers"):
        open_series(path)


def test_pipes_and_broken_tables_are_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.parquet")
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "broken.parquet").write_bytes(b"PAR1" + bytes(100) + b"PAR1")
    (tmp_path / "words.csv").write_text("t,x\n0,=cmd()\n1,two\n")
    pq.write_table(pa.table({"xyzzy": np.zeros(9)}), tmp_path / "named.parquet")
    named = (tmp_path / "named.parquet").read_bytes()
    (tmp_path / "named.parquet").write_bytes(named.replace(b"xyzzy", b"x\xe1zzy"))
    broken = ("broken.parquet", "words.csv", "named.parquet")
    for name in ("pipe.parquet", "pipe.csv", *broken):
        with pytest.raises(InputError, match=name.replace(".", r"\.")):
            read_columns(tmp_path / name, {"x": "x"}, tmp_path / "recording.yaml")


def test_a_grid_of_objects_is_refused_and_runs_nothing(tmp_path: Path) -> None:
    grid = np.full((5, 5), Evil(tmp_path / "ran"), dtype=object)
    np.save(tmp_path / "grid.npy", grid)
    with pytest.raises(InputError, match=r"grid\.npy: is no array of numbers"):
        read_elevation(tmp_path / "grid.npy")
    assert not (tmp_path / "ran").exists()


def test_a_grid_that_promises_more_than_it_holds_is_refused(tmp_path: Path) -> None:
    with (tmp_path / "grid.npy").open("wb") as file:
        head = {"descr": "<f8", "fortran_order": False, "shape": (10**6, 10**6)}
        np.lib.format.write_array_header_1_0(file, head)
        file.write(bytes(800))
    with pytest.raises(InputError, match=r"grid\.npy: is no array of numbers"):
        read_elevation(tmp_path / "grid.npy")


def test_nothing_is_unpickled_anywhere() -> None:
    loads = re.compile(
        r"pickle\.loads?|joblib\.load|allow_pickle=True|full_load|unsafe_load|\beval\("
    )
    for path in PACKAGE.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        assert not loads.search(text), path
        for call in re.findall(r"np\.load\([^)]*\)", text):
            assert "allow_pickle=False" in call, (path, call)
        for call in re.findall(r"torch\.load\([^)]*\)", text):
            assert "weights_only=True" in call, (path, call)
