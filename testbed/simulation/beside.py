"""Work that a copy of this process does on another core: it sees everything as it is now, and what
it leaves are files.

A copy costs a few milliseconds, whatever it has to see. Where the system makes none, or there is
one core, the work is done here.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from multiprocessing import parent_process


def can_copy() -> bool:
    """Whether this system copies processes, and has a core for the copy: beside one of several
    workers there is none.
    """
    alone = parent_process() is None
    return alone and sys.platform == "linux" and len(os.sched_getaffinity(0)) > 1


class Beside:
    """One piece of work at a time, in a copy of this process."""

    def __init__(self, copies: bool = True) -> None:
        """copies: False does all work here."""
        self._copies = copies and can_copy()
        self._busy: int | None = None

    def do(self, work: Callable[[], object]) -> None:
        """Begin it once the last is done. After a piece that a copy could not do all work is done
        here, where its errors are seen.
        """
        self._copies = self.wait() and self._copies
        if not self._copies:
            work()
            return
        self._busy = os.fork()
        if self._busy == 0:
            _work_and_end(work)

    def wait(self) -> bool:
        """Wait for the last piece of work; returns whether it was done."""
        busy, self._busy = self._busy, None
        if busy is None:
            return True
        try:
            return os.waitpid(busy, 0)[1] == 0
        except ChildProcessError:  # ended, and this process was started with SIGCHLD ignored
            return True


def _work_and_end(work: Callable[[], object]) -> None:
    """In the copy: the work, and an end that leaves everything that belongs to both alone."""
    failed = 1
    try:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the run's
        work()
        failed = 0
    finally:
        os._exit(failed)
