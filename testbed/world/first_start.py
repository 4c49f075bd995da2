"""On a cold cache: child processes compile what a run needs, two side by side, and exit.

What compiling takes of memory they give back; the run itself only loads what it finds in the
shared cache. Further processes that start meanwhile (a sweep's, a benchmark's) wait for them rather
than compile the same again.
"""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from typing import Any

import numba
import numpy as np

from testbed.compiled import caches, can_cache, is_cached
from testbed.estimation.live.chain import ChainBelief, ChainState, step_chain
from testbed.estimation.live.whole_body import balance, step_body
from testbed.formats.records import Record
from testbed.machine.names import AXES
from testbed.recording.rows import DataRow
from testbed.world.board import Board
from testbed.world.compiled_step import RecordedRow, between_steps
from testbed.world.plant import plant_step, step_cylinders
from testbed.world.sensing import Noise


def compile_for(function: Any, *arguments: Any) -> None:
    """Compile a function for arguments like these, or load it from the cache; nothing is run."""
    function.compile(tuple(numba.typeof(value) for value in arguments))


def _balance() -> None:
    row, belief, state = _estimator()
    compile_for(balance, row, np.zeros(len(AXES)), belief["body"], state["body"])


def _body() -> None:
    row, belief, state = _estimator()
    compile_for(step_body, row, belief["body"], state["body"])


def _chain() -> None:
    compile_for(step_chain, *_estimator())


def _estimator() -> tuple[Any, Any, Any]:
    row, belief, state = (kind.zeros()[0] for kind in (DataRow, ChainBelief, ChainState))
    return row, belief, state


def _hydraulics() -> None:
    compile_for(step_cylinders, Board.zeros()[0])


def _plant() -> None:
    compile_for(plant_step, Board.zeros()[0])


def _contacts() -> None:
    from testbed.machine.build import build_machine
    from testbed.robot.loads.foot_loads import ExpectedLoads
    from testbed.robot.model import RobotModel

    machine = build_machine()
    ExpectedLoads(RobotModel(machine.urdf), machine).solve(np.zeros(len(AXES)), np.zeros(3))


def _step() -> None:
    board, estimator = Board.zeros(), (ChainBelief.zeros(), ChainState.zeros())
    compile_for(between_steps, 0, board, estimator, *map(_zeros, (Noise, DataRow, RecordedRow)))


def _zeros(kind: type[Record]) -> Any:
    return kind.zeros()


FAMILIES: dict[str, Callable[[], None]] = {
    "balance": _balance,
    "body": _body,
    "chain": _chain,
    "hydraulics": _hydraulics,
    "plant": _plant,
    "contacts": _contacts,
    "step": _step,
}
"""What is compiled together, by name, each in a process of its own: none holds much memory."""
ROWS = ("balance", "body", "chain", "step"), ("hydraulics", "plant", "contacts")
"""Two rows side by side: the body's estimate is put together from its balance, the chain of
estimates from both, the plant from the hydraulics, a step from chain and plant.
"""


def compile_apart() -> None:
    """Let child processes compile what a run needs, and say so; nothing to do on a warm cache.

    What a child fails to compile, the step that needs it compiles.
    """
    if is_cached(between_steps):
        return
    with _turn():
        if is_cached(between_steps):  # by the process that had its turn before
            return
        if not can_cache(between_steps):
            say = "testbed: nothing can be cached, so every start compiles for some minutes ..."
            print(say, file=sys.stderr, flush=True)
            return
        say = "testbed: the first start compiles the simulation, half a minute once ..."
        print(say, file=sys.stderr, flush=True)
        with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as side_by_side:
            list(side_by_side.map(_in_child, range(len(ROWS))))


def _in_child(row: int) -> None:
    quiet = subprocess.DEVNULL
    command = [sys.executable, "-m", __name__, str(row)]
    subprocess.run(command, stdin=quiet, stdout=quiet, stderr=quiet, check=False)


def compile_row(families: Sequence[str]) -> None:
    """Compile these one after the other, each in a copy of this process: what all of them import is
    imported once, and each gives its memory back.
    """
    for family in families:
        copy = os.fork()
        if copy == 0:
            try:
                FAMILIES[family]()
            finally:
                os._exit(0)
        os.waitpid(copy, 0)


@contextmanager
def _turn() -> Iterator[None]:
    """Wait until no other process compiles, and keep others waiting. A process that dies ends its
    turn; without locks nobody waits.
    """
    handle = None
    with suppress(OSError):
        caches().mkdir(parents=True, exist_ok=True)
        handle = os.open(caches() / "first_start.lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC)
        fcntl.flock(handle, fcntl.LOCK_EX)
    try:
        yield
    finally:
        if handle is not None:
            os.close(handle)


if __name__ == "__main__":
    compile_row(ROWS[int(sys.argv[1])])
