"""On a cold cache: two processes compile side by side what happens between two engine steps.

The first process needs the contact solver to build its world; meanwhile the second compiles the
plant and the heaviest part of the estimator into the shared cache, where the first finds them.
Further processes that start meanwhile (a sweep's, a benchmark's) wait for them rather than compile
the same again.
"""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numba
import numpy as np

from testbed.compiled import caches, is_cached
from testbed.estimation.live.chain_step import ChainBelief, ChainState, step_chain
from testbed.estimation.live.whole_body import balance
from testbed.machine.names import AXES
from testbed.recording.rows import DataRow
from testbed.world.between import between_steps
from testbed.world.board import Board
from testbed.world.plant import plant_step


def compile_for(function: Any, *arguments: Any) -> None:
    """Compile a function for arguments like these, or load it from the cache; nothing is run."""
    function.compile(tuple(numba.typeof(value) for value in arguments))


def share_of_second() -> None:
    """Compile what the second process does, about half of all."""
    row, belief, state = DataRow.zeros()[0], ChainBelief.zeros()[0], ChainState.zeros()[0]
    compile_for(balance, row, np.zeros(len(AXES)), belief["body"], state["body"])
    compile_for(plant_step, Board.zeros()[0])


def beside() -> Callable[[], None]:
    """Say that a first start compiles, and begin to in a second process where there is a second
    core.

    Returns what to call before the first step: it compiles the first process's share and waits for
    the second. A share that fails is compiled by the step that needs it.
    """
    if is_cached(between_steps):
        return lambda: None
    _take_turn()
    if is_cached(step_chain):  # by the process that had its turn before
        _end_turn()
        return lambda: None
    say = "testbed: the first start compiles the simulation, half a minute once ..."
    print(say, file=sys.stderr, flush=True)
    if len(os.sched_getaffinity(0)) < 2:
        return _end_turn
    quiet = subprocess.DEVNULL
    command = [sys.executable, "-m", __name__]
    process = subprocess.Popen(command, stdin=quiet, stdout=quiet, stderr=quiet)

    def finish() -> None:
        compile_for(step_chain, DataRow.zeros()[0], ChainBelief.zeros()[0], ChainState.zeros()[0])
        process.wait()
        _end_turn()

    return finish


_held: list[int] = []
"""The lock file while this process has its turn; a world that could not be built may have left
it.
"""


def _take_turn() -> None:
    """Wait until no other process compiles. A process that dies ends its turn; without locks nobody
    waits.
    """
    if _held:
        return
    with suppress(OSError):
        caches().mkdir(parents=True, exist_ok=True)
        handle = os.open(caches() / "first_start.lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC)
        _held.append(handle)
        fcntl.flock(handle, fcntl.LOCK_EX)


def _end_turn() -> None:
    """Let the next process have its turn."""
    while _held:
        os.close(_held.pop())


if __name__ == "__main__":
    share_of_second()
