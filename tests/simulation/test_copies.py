"""Work in copies of a process: on what was there when they were made, in order, and no failure is
lost.
"""

from __future__ import annotations

import os
import signal
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from testbed.errors import InputError
from testbed.scenario.scenario import load_scenario
from testbed.simulation.copies import Copy, SharedOut, can_copy
from testbed.simulation.pictures import Album, pictures
from testbed.world.simulation import Simulation

copied = pytest.mark.skipif(not can_copy(), reason="one core, or a system without copies")


@copied
def test_a_copy_sees_what_was_there_then_and_changes_nothing_here() -> None:
    state = {"now": "then"}

    def work(piece: int) -> tuple[int, str, int]:
        seen, state["now"] = state["now"], "spoilt"
        return piece, seen, os.getpid()

    copy = Copy(work)
    state["now"] = "later"
    for piece in range(2):
        copy.begin(piece)
    (first, saw, process), (second, then, _) = copy.results()
    copy.close()
    assert (first, saw, second, then, state["now"]) == (0, "then", 1, "spoilt", "later")
    assert process != os.getpid()


@copied
def test_a_failure_is_raised_here_and_what_comes_after_is_done() -> None:
    copy = Copy(lambda piece: 1 / piece)
    copy.begin(0)
    with pytest.raises(ZeroDivisionError):
        copy.results()
    copy.begin(2)
    assert copy.results() == [0.5]
    copy.close()


@copied
def test_a_copy_that_has_ended_is_said() -> None:
    copy = Copy(lambda piece: os._exit(1))
    copy.begin(1)
    with pytest.raises(ChildProcessError):
        copy.results()
    copy.begin(2)
    copy.close()


@copied
def test_where_ends_of_children_are_ignored_a_copy_works_all_the_same() -> None:
    before = signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    try:
        copy = Copy(str)
        copy.begin(1)
        assert copy.results() == ["1"]
        copy.close()
    finally:
        signal.signal(signal.SIGCHLD, before)


@copied
def test_a_copy_ends_with_the_process_that_made_it() -> None:
    """Both lines that it holds would keep a copy made before it from seeing the end."""
    ours, theirs = os.pipe()
    process = os.fork()
    if process == 0:
        os.close(ours)
        _copies = Copy(str), Copy(str)
        os.kill(os.getpid(), signal.SIGKILL)
    os.close(theirs)
    os.waitpid(process, 0)
    assert os.read(ours, 1) == b"", "the last holder of the other end has gone"
    os.close(ours)


class Model:
    """Sees grey, and fails from its second picture on."""

    taken = 0

    def picture(self, width: int, height: int) -> np.ndarray:
        self.taken += 1
        if self.taken > 1:
            raise InputError("cannot be written", file="picture")
        return np.full((height, width, 3), 128, dtype=np.uint8)

    def seen(self) -> None: ...

    def show(self, seen: None) -> None: ...


@pytest.mark.parametrize("copies", [False, True])
def test_a_last_picture_that_is_missing_is_said(tmp_path: Path, copies: bool) -> None:
    album = Album(tmp_path, Model(), 10.0, copies=copies)
    album.take(0.0)
    with pytest.raises(InputError, match="cannot be written"):
        album.take_large(10.0)
        album.finish()
    assert [len(pictures(tmp_path, kind)) for kind in ("small", "large")] == [1, 0]


def test_what_was_seen_is_shown_again(tmp_path: Path) -> None:
    """Ropes, drill and joints of a moment, in a world that has gone on since."""
    scenario = load_scenario("drill_slope_45", ["task.start_s=0.2"], duration=10.0)
    world = Simulation(scenario)
    try:
        world.run_block(1000)
        then, picture = world.machine.seen(), world.picture(240, 160)
        world.machine.board.ropes[0].whole = False
        world.run_block(1500)
        assert (world.picture(240, 160) != picture).any()
        world.machine.show(then)
        assert (world.picture(240, 160) == picture).all()
    finally:
        world.close()


def test_one_of_several_workers_has_no_core_for_a_copy() -> None:
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as workers:
        assert not workers.submit(can_copy).result()


@copied
def test_numbers_that_are_shared_out_go_to_one_of_two_each() -> None:
    numbers = SharedOut(200)
    copy = Copy(lambda _: [number for number in range(210) if number in numbers])
    copy.begin(None)
    here = [number for number in range(210) if number in numbers]
    there = copy.results()[0]
    copy.close()
    numbers.close()
    assert sorted(here + there) == list(range(200))
