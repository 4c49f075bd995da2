"""The harness works every case out once, keeps it whole, and resumes after whatever ended its
process.
"""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from counting_benchmark import Counting

from testbed.benchmarks import harness
from testbed.benchmarks.harness import LINES, Answers, answers, code, rounded, run, sources, stored
from testbed.errors import InputError
from testbed.formats.files import owned


@pytest.fixture
def made(tmp_path: Path) -> Path:
    """Where every case that is worked out leaves a file."""
    folder = tmp_path / "made"
    folder.mkdir()
    return folder


def _made(folder: Path) -> list[int]:
    return sorted(int(path.name.partition("-")[0]) for path in folder.iterdir())


def test_every_case_is_worked_out_once_and_the_result_is_written(
    made: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    for _ in range(2):
        assert run(Counting(made), out) == {"squares": [0, 1, 4, 9]}
    assert _made(made) == [0, 1, 2, 3]
    assert json.loads((out / "counting.json").read_text()) == {"squares": [0, 1, 4, 9]}
    assert (out / "counting.html").read_text() == "<p>[0, 1, 4, 9]</p>"
    assert (out / "counting.md").read_text() == (
        "## Squares\n\n| square |\n| --- |\n| 0 |\n| 1 |\n| 4 |\n| 9 |\n"
    )


class Fractions(Counting):
    """Its result holds fractions, and whole numbers that are long."""

    def summarise(self, answers: Answers) -> dict[str, Any]:
        return {
            "squares": [1],
            "share": 2.0 / 3.0,
            "force_n": np.float64(123456.7),
            "of": (1.0e-7 / 3.0, [-9.999996, math.nan]),
            "seed": 2**53 + 1,
            "met": True,
        }


def test_a_written_result_has_five_digits_and_the_returned_one_all(
    made: Path, tmp_path: Path
) -> None:
    result = run(Fractions(made), tmp_path / "out")
    assert result["share"] == 2.0 / 3.0
    written = json.loads((tmp_path / "out" / "counting.json").read_text())
    assert written == {
        "squares": [1],
        "share": 0.66667,
        "force_n": 123460.0,
        "of": [3.3333e-08, [-10.0, None]],
        "seed": 2**53 + 1,
        "met": True,
    }
    assert rounded(written) == written


def test_more_cases_add_to_those_that_are_there(made: Path, tmp_path: Path) -> None:
    run(Counting(made, count=2), tmp_path / "out")
    assert run(Counting(made, count=3), tmp_path / "out") == {"squares": [0, 1, 4]}
    assert _made(made) == [0, 1, 2]
    assert len(stored(tmp_path / "out")) == 3


def test_a_case_made_with_other_options_is_worked_out_again(made: Path, tmp_path: Path) -> None:
    for options in ("a", "b", "a"):
        run(Counting(made, count=1, options=options), tmp_path / "out")
    assert _made(made) == [0, 0]


@pytest.mark.parametrize(
    "spoil",
    [
        lambda text: text[:-9],
        lambda text: "",
        lambda text: text.replace('"case"', '"cake"'),
        lambda text: "17\n[]\n",
    ],
)
def test_a_line_that_is_cut_off_or_foreign_counts_for_nothing(
    made: Path, tmp_path: Path, spoil: Callable[[str], str]
) -> None:
    lines = tmp_path / "out" / LINES
    run(Counting(made, count=1), tmp_path / "out")
    lines.write_text(spoil(lines.read_text()))
    for _ in range(2):
        assert run(Counting(made, count=1), tmp_path / "out") == {"squares": [0]}
    assert _made(made) == [0, 0]


def test_a_folder_at_work_and_one_that_cannot_be_are_refused(made: Path, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with owned(tmp_path / "out"), pytest.raises(InputError, match="another"):
        run(Counting(made), tmp_path / "out")
    with pytest.raises(InputError, match="file"):
        run(Counting(made), tmp_path / "file")
    with pytest.raises(InputError, match="holds no finished cases"):
        stored(tmp_path / "out")
    assert _made(made) == []


def test_without_a_folder_nothing_is_kept(made: Path) -> None:
    assert list(answers(Counting(made, count=2))) == ["case 0", "case 1"]
    assert _made(made) == [0, 1]


def test_nothing_is_shown_of_the_progress_when_it_is_piped(
    made: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    run(Counting(made), tmp_path / "out")
    assert capfd.readouterr() == ("", "")


def test_a_mark_hears_of_code_and_numbers_but_not_of_comments_and_pages(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(harness, "PACKAGE", tmp_path)
    files = {
        "laws/a.py": "x = 1\n",
        "benchmarks/mine/cases.py": "y = 1\n",
        "benchmarks/mine/page.py": "z = 1\n",
        "benchmarks/other/cases.py": "z = 1\n",
        "report/style.py": "z = 1\n",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)

    def mark(changed: str, text: str) -> str:
        (tmp_path / changed).write_text(text)
        sources.cache_clear()
        code.cache_clear()
        return sources(("mine",))

    before = mark("laws/a.py", "x = 1\n")
    assert mark("laws/a.py", '"""What it is."""\nx  =  1  # one\n') == before
    for name in ("benchmarks/mine/page.py", "benchmarks/other/cases.py", "report/style.py"):
        assert mark(name, "z = 2\n") == before
    assert mark("benchmarks/mine/cases.py", "y = 2\n") != before
    assert mark("benchmarks/mine/cases.py", "y = 1\n") == before
    assert mark("laws/a.py", "x = 2\n") != before


def _started(out: Path, made: Path, jobs: int) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "counting_benchmark", str(out), str(made), "1.0", str(jobs)]
    return subprocess.Popen(
        command, cwd=Path(__file__).parents[1], start_new_session=True, stderr=subprocess.PIPE
    )


def _await(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 60.0
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.1)


@pytest.mark.slow
@pytest.mark.parametrize("blow", [signal.SIGKILL, signal.SIGINT])
def test_a_stopped_benchmark_leaves_no_process_and_resumes(
    made: Path, tmp_path: Path, blow: signal.Signals
) -> None:
    """The parent alone is hit: its workers must go by themselves; what was finished is not done
    again.
    """
    out = tmp_path / "out"
    process = _started(out, made, jobs=2)
    _await(lambda: (out / LINES).is_file() and (out / LINES).read_bytes().count(b"\n") >= 2)
    os.kill(process.pid, blow)
    process.communicate(timeout=60)  # its pipe closes once every process is gone
    assert process.returncode != 0
    done = {json.loads(line)["case"] for line in (out / LINES).read_text().splitlines()}
    assert 2 <= len(done) < 6
    workers = {path.name.split("-")[1] for path in made.iterdir()}
    assert str(process.pid) not in workers and len(workers) == 2
    again = Counting(made, count=6)
    before = _made(made)
    assert run(again, out, jobs=2) == {"squares": [n**2 for n in range(6)]}
    assert len(_made(made)) - len(before) == 6 - len(done)
    assert {a["threads"] for a in stored(out)} == {"1"}
