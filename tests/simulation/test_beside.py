"""Work in copies of a process: done once, on what was there then, and its failure is not lost."""

from __future__ import annotations

import os
import signal
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from testbed.errors import InputError
from testbed.simulation.pictures import Album, Beside, can_copy, pictures

copied = pytest.mark.skipif(not can_copy(), reason="one core, or a system without copies")


@copied
def test_a_copy_sees_what_was_there_then_and_changes_nothing_here(tmp_path: Path) -> None:
    state = {"now": "then"}

    def write() -> None:
        (tmp_path / "seen").write_text(f"{state['now']} {os.getpid()}")
        state["now"] = "spoilt"

    beside = Beside()
    beside.do(write)
    state["now"] = "later"
    assert beside.wait()
    word, process = (tmp_path / "seen").read_text().split()
    assert (word, state["now"]) == ("then", "later")
    assert int(process) != os.getpid()


@copied
def test_after_a_failure_work_is_done_here() -> None:
    done: list[int] = []
    beside = Beside()
    beside.do(lambda: 1 / 0)
    beside.do(lambda: done.append(os.getpid()))
    assert done == [os.getpid()]
    assert beside.wait()


@copied
def test_where_ends_of_children_are_ignored_a_copy_is_waited_for_all_the_same(
    tmp_path: Path,
) -> None:
    before = signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    try:
        beside = Beside()
        beside.do(lambda: (tmp_path / "done").touch())
        assert beside.wait()
    finally:
        signal.signal(signal.SIGCHLD, before)
    assert (tmp_path / "done").exists()


class Camera:
    """Sees grey, and fails from its second picture on."""

    taken = 0

    def picture(self, width: int, height: int) -> np.ndarray:
        self.taken += 1
        if self.taken > 1:
            raise InputError("cannot be written", file="picture")
        return np.full((height, width, 3), 128, dtype=np.uint8)


@pytest.mark.parametrize("copies", [False, True])
def test_a_last_picture_that_is_missing_is_said(tmp_path: Path, copies: bool) -> None:
    album, camera = Album(tmp_path, 10.0, copies=copies), Camera()
    album.take(camera, 0.0)
    with pytest.raises(InputError, match="cannot be written"):
        album.take_large(camera, 10.0)
        album.finish()
    assert [len(pictures(tmp_path, kind)) for kind in ("small", "large")] == [1, 0]


def test_one_of_several_workers_has_no_core_for_a_copy() -> None:
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as workers:
        assert not workers.submit(can_copy).result()
