"""Processes of this machine: one that is killed loses nothing, and nothing that was answered is
done again.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import pytest
from counted_work import begun_by_killed, killing, work

from testbed.simulation.workers import Workers, work_through

COUNT = 8


@pytest.mark.slow
def test_what_a_killed_process_was_at_is_done_by_another_one(tmp_path: Path) -> None:
    """The first process that begins number 3 kills itself."""
    items = [(str(tmp_path), number) for number in range(COUNT)]
    answers = list(work_through(begun_by_killed, items, Workers(2)))
    assert Counter(answers) == Counter(number**2 for number in range(COUNT))
    ended = Counter(path.name.split("-")[1] for path in tmp_path.glob("ended-*"))
    assert set(ended) == {str(number) for number in range(COUNT)}
    assert sum(ended.values()) <= COUNT + 1, "at most what the other process was at is done twice"


@pytest.mark.slow
def test_work_that_kills_every_process_is_given_up(tmp_path: Path) -> None:
    with pytest.raises(BrokenProcessPool):
        list(work_through(killing, [1, 2], Workers(2)))


def test_one_process_works_here(tmp_path: Path) -> None:
    before = signal.getsignal(signal.SIGINT)
    assert list(work_through(work, [(str(tmp_path), 3)], Workers(1))) == [9]
    assert next(tmp_path.glob("ended-3-*")).name.split("-")[2] == str(os.getpid())
    assert signal.getsignal(signal.SIGINT) is before


STUBBORN = """
from counted_work import stubborn
from testbed.simulation.workers import Workers, work_through
list(work_through(stubborn, [({folder!r}, 0), ({folder!r}, 1)], Workers(2)))
"""


def hears_ctrl_c() -> None:
    """In a new process: Ctrl-C interrupts it, also where tests run in the background of a shell, to
    whose children it means nothing.
    """
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@pytest.mark.slow
def test_a_second_interrupt_ends_work_that_the_first_one_did_not(tmp_path: Path) -> None:
    def told(word: str) -> None:
        deadline = time.monotonic() + 120
        while len(list(tmp_path.glob(f"{word}-*"))) < 2:
            assert time.monotonic() < deadline, f"nobody {word}"
            time.sleep(0.02)

    path = os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
    process = subprocess.Popen(
        [sys.executable, "-c", STUBBORN.format(folder=str(tmp_path))],
        env={**os.environ, "PYTHONPATH": path},
        start_new_session=True,
        stderr=subprocess.PIPE,
        preexec_fn=hears_ctrl_c,
    )
    try:
        told("began")
        os.killpg(process.pid, signal.SIGINT)
        told("heard")
        assert process.poll() is None, "the first one is the work's own affair"
        deadline = time.monotonic() + 60
        while process.poll() is None and time.monotonic() < deadline:
            os.killpg(process.pid, signal.SIGINT)
            time.sleep(0.5)  # two that come at once are one to a process that waits for its turn
        _, said = process.communicate(timeout=60)  # the pipe closes once every process is gone
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
    assert process.returncode == -signal.SIGINT, said.decode()
    assert said.decode().rstrip().endswith("KeyboardInterrupt")
