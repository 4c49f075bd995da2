"""A folder has one owner at a time, and none once the owner has ended, however it ended."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from testbed.errors import InputError
from testbed.formats.files import owned

OWNER = """
import sys, time
from testbed.formats.files import owned
with owned(sys.argv[1]):
    print("owned", flush=True)
    time.sleep(60)
"""

WITH_A_COPY = """
import os, sys, time
from testbed.formats.files import owned
with owned(sys.argv[1]):
    if os.fork() == 0:
        print(os.getpid(), flush=True)
    time.sleep(60)
"""


def test_a_second_owner_is_refused_in_one_line_and_writes_nothing(tmp_path: Path) -> None:
    with owned(tmp_path / "out") as folder:
        (folder / "mine").write_text("first")
        with (
            pytest.raises(InputError, match="out: --out: another testbed process is writing"),
            owned(tmp_path / "out"),
        ):
            raise AssertionError("two owners")
        assert [p.name for p in folder.iterdir()] == ["mine"]


def test_the_next_one_may_own_it_and_a_folder_inside_has_its_own_owner(tmp_path: Path) -> None:
    for _ in range(2):
        with owned(tmp_path / "out") as outer, owned(outer / "inside") as inner:
            assert inner.is_dir()


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGTERM])
def test_a_killed_process_owns_nothing(tmp_path: Path, end: signal.Signals) -> None:
    child = subprocess.Popen(
        [sys.executable, "-c", OWNER, str(tmp_path)], stdout=subprocess.PIPE, text=True
    )
    assert child.stdout is not None and child.stdout.readline() == "owned\n"
    with pytest.raises(InputError, match="another testbed process"), owned(tmp_path):
        raise AssertionError("two owners")
    child.send_signal(end)
    child.communicate(timeout=30)
    with owned(tmp_path):
        assert not list(tmp_path.iterdir())


def test_a_copy_that_outlives_its_killed_owner_owns_nothing(tmp_path: Path) -> None:
    """As the one that draws pictures beside a run does for a moment."""
    child = subprocess.Popen(
        [sys.executable, "-c", WITH_A_COPY, str(tmp_path)], stdout=subprocess.PIPE, text=True
    )
    assert child.stdout is not None
    copy = int(child.stdout.readline())
    try:
        with pytest.raises(InputError, match="another testbed process"), owned(tmp_path):
            raise AssertionError("two owners")
        child.kill()
        child.wait(timeout=30)
        os.kill(copy, 0)  # it is still there
        with owned(tmp_path):
            assert not list(tmp_path.iterdir())
    finally:
        os.kill(copy, signal.SIGKILL)
        child.stdout.close()


def test_what_is_no_folder_cannot_be_owned(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with (
        pytest.raises(InputError, match="file: --out: cannot be written"),
        owned(tmp_path / "file"),
    ):
        raise AssertionError("a file is owned")
