"""A run that was edited or cut is shown as far as it goes, or refused in one line; never a
traceback.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from synthetic_run import write_synthetic_run

from testbed.errors import InputError
from testbed.workflows.report import write_report

Edit = Callable[[Path], None]


def summary(**fields: Any) -> Edit:
    def edit(folder: Path) -> None:
        path = folder / "summary.json"
        path.write_text(json.dumps(json.loads(path.read_text()) | fields))

    return edit


def table(series: str, change: Callable[[pa.Table], pa.Table]) -> Edit:
    def edit(folder: Path) -> None:
        path = folder / f"{series}.parquet"
        pq.write_table(change(pq.read_table(path)), path)

    return edit


def column(name: str, value: object) -> Callable[[pa.Table], pa.Table]:
    def change(found: pa.Table) -> pa.Table:
        return found.set_column(
            found.column_names.index(name), name, pa.array([value] * len(found))
        )

    return change


def text(file: str, content: str) -> Edit:
    return lambda folder: (folder / file).write_text(content) and None


REFUSED: dict[str, Edit] = {
    "events are no list": summary(events="x"),
    "an event without time": summary(events=[{"kind": "x"}]),
    "a word for a number": summary(simulated_s="long"),
    "an effect without numbers": summary(undeclared=[{"effect": "a", "at": "b"}]),
    "the summary is a list": text("summary.json", "[1]"),
    "the summary is deep": text("summary.json", "[" * 100_000),
    "no truth": lambda folder: (folder / "truth.parquet").unlink(),
    "a foot's load is gone": table("truth", lambda t: t.drop_columns(["foot_load_fl"])),
    "time is gone": table("data", lambda t: t.drop_columns(["t"])),
    "time stands still": table("truth", column("t", 1.0)),
    "time is not a number": table("truth", column("t", float("nan"))),
    "words in a column": table("data", column("estimate_kbf_fl", "word")),
    "another rig": text("recording.yaml", "rig: 3"),
}
SHOWN: dict[str, Edit] = {
    "no summary": lambda folder: (folder / "summary.json").unlink(),
    "the last half of the data is gone": table("data", lambda t: t.slice(0, 1000)),
    "all rows of the data are gone": table("data", lambda t: t.slice(0, 0)),
    "an estimate is not a number": table("data", column("estimate_kbf_fl", float("nan"))),
}


DRAWN = ("a word for a number", "an effect without numbers", "an estimate is not a number")
"""What is met after all pictures are drawn."""


def as_slow_as_it_is(edit: str) -> Any:
    return pytest.param(edit, marks=pytest.mark.slow) if edit in DRAWN else edit


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_synthetic_run(tmp_path_factory.mktemp("runs") / "run", 2.0)


@pytest.mark.parametrize("edit", [as_slow_as_it_is(edit) for edit in REFUSED])
def test_it_is_refused_in_one_line(run: Path, tmp_path: Path, edit: str) -> None:
    folder = Path(shutil.copytree(run, tmp_path / "edited"))
    REFUSED[edit](folder)
    with pytest.raises(InputError, match="edited") as error:
        write_report(folder)
    assert "\n" not in str(error.value) and not (folder / "report.html").exists()


@pytest.mark.parametrize("edit", [as_slow_as_it_is(edit) for edit in SHOWN])
def test_it_is_shown_as_far_as_it_goes(run: Path, tmp_path: Path, edit: str) -> None:
    folder = Path(shutil.copytree(run, tmp_path / "edited"))
    SHOWN[edit](folder)
    assert "<h1>" in write_report(folder).read_text()
