"""Text tables as loggers write them: separator, decimal sign, names and units are told from the
text.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from testbed.errors import InputError
from testbed.recording.importer.importer import read_any


def read(folder: Path, text: str, *wanted: str, name: str = "log.csv") -> dict[str, np.ndarray]:
    (folder / name).write_text(text)
    return read_any(folder / name, dict.fromkeys(wanted, "s"))


@pytest.mark.parametrize(
    "text",
    [
        "t,p\n0,1.5\n1,2.5\n",
        "t;p\n0;1,5\n1;2,5\n",
        "t\tp\ns\tbar\n0\t1,5\n1\t2,5\n",
        "# a logger's remark\nt   p\n0  1.5\n1      2.5\n",
        '"t","p"\n0,1.5\n1,2.5\n',
        '"t";"p"\n"0";"1,5"\n"1";"2,5"\n',
    ],
    ids=["comma", "decimal comma", "units below", "spaces and remark", "quotes", "all in quotes"],
)
def test_a_table_of_any_make_is_read(tmp_path: Path, text: str) -> None:
    found = read(tmp_path, text, "t", "p")
    assert found["t"].tolist() == [0.0, 1.0] and found["p"].tolist() == [1.5, 2.5]


def test_columns_without_names_are_numbered_and_an_empty_cell_is_no_number(tmp_path: Path) -> None:
    found = read(tmp_path, "0,1.5\n1,\n", "1", "2")
    assert found["1"].tolist() == [0.0, 1.0]
    assert found["2"][0] == 1.5 and np.isnan(found["2"][1])


@pytest.mark.parametrize(
    ("text", "wanted", "name", "said"),
    [
        ("t,p\n0,1\n", "q", "log.csv", "has no column 'q'"),
        ("t,t\n0,1\n", "t", "log.csv", "has two columns 't'"),
        ("t,p\n0,1,2\n", "t", "log.csv", "equally many cells"),
        ("t,p\n", "t", "log.csv", "holds no table"),
        ("t,p\n0,high\n1,low\n", "p", "log.csv", "is not numbers"),
        ("t,p\n0,1\n", "t", "log.xls", "unknown ending"),
    ],
)
def test_what_is_no_table_of_numbers_is_refused(
    tmp_path: Path, text: str, wanted: str, name: str, said: str
) -> None:
    with pytest.raises(InputError, match=said):
        read(tmp_path, text, wanted, name=name)
