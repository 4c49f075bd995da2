"""Copies of this process that work beside it, on another core.

A copy begins with everything as it is at its start: nothing is imported or built twice. It ends
with its last piece of work, or with the process that made it, however that ends.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import Pipe, parent_process
from multiprocessing.connection import Connection
from typing import Any


def can_copy() -> bool:
    """Whether this system copies processes, and has a core for the copy: beside one of several
    workers there is none.
    """
    alone = parent_process() is None
    return alone and sys.platform == "linux" and len(os.sched_getaffinity(0)) > 1


class Copy:
    """Does pieces of work one after the other, in a copy of this process."""

    def __init__(self, work: Callable[[Any], Any]) -> None:
        """work: what is done with each piece; all that it sees is as it is now."""
        self._line, theirs = Pipe()
        self._begun = 0
        self._process = os.fork()
        if self._process == 0:
            self._line.close()
            _serve(work, theirs)
        theirs.close()

    def begin(self, piece: Any) -> None:
        """Let a piece be done after those before it."""
        with suppress(BrokenPipeError):  # said by `results`
            self._line.send(piece)
        self._begun += 1

    def results(self) -> list[Any]:
        """What the pieces begun since the last call came to, in their order.

        Raises what the first that failed raised, ChildProcessError where the copy has ended.
        """
        begun, self._begun = self._begun, 0
        try:
            answers = [self._line.recv() for _ in range(begun)]
        except (EOFError, ConnectionResetError) as error:
            raise ChildProcessError("a process that works beside this one has ended") from error
        for _, failure in answers:
            if failure is not None:
                raise failure
        return [answer for answer, _ in answers]

    def close(self) -> None:
        """End it after the piece that it is at."""
        self._line.close()
        with suppress(ChildProcessError):  # this process was started with SIGCHLD ignored
            os.waitpid(self._process, 0)


class SharedOut:
    """Numbers from 0 on that a process and its copies share out among them: each belongs to the one
    that asks for it first. Every one of them must ask in rising order.
    """

    def __init__(self, count: int) -> None:
        """count: of numbers, at most 256."""
        self._numbers, line = os.pipe()
        os.write(line, bytes(range(count)))
        os.close(line)
        self._mine = -1

    def __contains__(self, number: object) -> bool:
        assert isinstance(number, int)
        while self._mine < number:
            byte = os.read(self._numbers, 1)
            self._mine = byte[0] if byte else sys.maxsize
        return self._mine == number

    def close(self) -> None:
        """Give back what it holds of the system."""
        os.close(self._numbers)


def _serve(work: Callable[[Any], Any], line: Connection) -> None:
    """In the copy: piece after piece, and an end that leaves everything that belongs to both
    alone.
    """
    try:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the run's
        while True:
            piece, answer, failure = line.recv(), None, None
            try:
                answer = work(piece)
            except Exception as error:
                failure = error
            line.send((answer, failure))
    finally:
        os._exit(0)
