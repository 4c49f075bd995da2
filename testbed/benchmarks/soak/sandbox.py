"""A piece of work in a process of its own that may fall over: a fork of this one, so that what was
imported and compiled once serves every trial.

How it ended is judged as a user sees it: done (0, or 3 where an expectation was not met), refused
(2) or broken down in the simulation (1), each but the first with one line. A traceback, a fault of
the testbed, a signal, silence or no end within the time limit is wrong.
"""

from __future__ import annotations

import gc
import importlib
import math
import os
import resource
import runpy
import signal
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, partial
from typing import IO

from testbed.errors import InputError, SimulationFault, disk_refusal

LIMIT_S, WAITED = 180.0, 5.0
"""What takes more processor time hangs; so does what takes so many times as long on the clock."""
MOST_MEMORY = 16 << 30
"""Addresses that a piece of work may ask for, bytes: a bomb is found before the machine is full."""
WARM = (
    *(
        "testbed.cli",
        "testbed.envs",
        "testbed.recording.checker.check",
        "testbed.recording.importer",
    ),
    *(f"testbed.workflows.{name}" for name in ("detect", "estimate", "export", "report")),
    *("pyarrow.compute", "pyarrow.parquet", "scipy.ndimage", "scipy.signal", "scipy.optimize"),
)
"""Imported once, before the first fork."""
WORDS = {0: "served", 1: "fault of the simulation", 2: "refused", 3: "served"}
Work = Callable[[], None]
Judged = tuple[str, str]
"""Outcome in a word, and what is wrong with it in a sentence; empty: nothing."""


@dataclass(frozen=True)
class Ended:
    """How a piece of work ended."""

    status: int | None
    """Exit status, negative for a signal; None: it had not ended in time."""
    said: str
    """On standard error."""

    @property
    def judged(self) -> Judged:
        """See the module."""
        if self.status is None:
            return "hung", f"no end within {LIMIT_S:g} s of processor time"
        lines = [line for line in self.said.splitlines() if line.startswith("testbed:")]
        if self.status not in WORDS or "Traceback" in self.said:
            return "fell over", self.said[-300:] or f"exit status {self.status}"
        if "a fault of ours" in self.said:
            return "fell over", lines[-1][:300]
        if self.status in (1, 2) and len(lines) != 1:
            return "unclear", f"{len(lines)} lines with exit status {self.status}"
        return WORDS[self.status], ""


@dataclass(frozen=True)
class Child:
    """A piece of work on its way."""

    process: int
    said: IO[bytes]


def command(*arguments: str, before: Work | None = None) -> Ended:
    """A command of the testbed; `before` is done first, in its process."""
    return forked(by_command(*arguments, before=before))


def forked(work: Work) -> Ended:
    """Do it in a fork of this process; what it raises is reported as on the command line."""
    return ended(begun(work))


def by_command(*arguments: str, before: Work | None = None) -> Work:
    """A command of the testbed as a piece of work."""
    return partial(_command, arguments, before)


def begun(work: Work) -> Child:
    """Begin it in a fork of this process."""
    _warm()
    said = tempfile.TemporaryFile()  # noqa: SIM115 (closed by `ended`)
    child = os.fork()
    if child == 0:
        os._exit(_do(work, said))
    return Child(child, said)


def ended(child: Child) -> Ended:
    """Wait for its end; an interruption ends it."""
    with child.said as said:
        try:
            status = _wait(child.process)
        except KeyboardInterrupt:
            os.kill(child.process, signal.SIGKILL)
            raise
        said.seek(0)
        return Ended(status, said.read().decode(errors="replace"))


def _command(arguments: tuple[str, ...], before: Work | None) -> None:
    if before is not None:
        before()
    sys.argv = ["testbed", *arguments]
    runpy.run_module("testbed", run_name="__main__")


def _do(work: Work, said: IO[bytes]) -> int:
    """In the child: the work, and its exit status."""
    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream, target in ((0, nowhere), (1, nowhere), (2, said.fileno())):
        os.dup2(target, stream)
    sys.stdout, sys.stderr = open(1, "w", closefd=False), open(2, "w", closefd=False)  # noqa: SIM115
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(LIMIT_S), math.ceil(LIMIT_S) + 1))
    try:
        work()
        status = 0
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else 0
    except BaseException as error:
        status = _report(error)
    with suppress(OSError):
        sys.stderr.flush()
    return status


def _report(error: BaseException) -> int:
    """Print what a piece of work raised, in one line as a command would; returns its status."""
    error = disk_refusal(error) or error
    if isinstance(error, InputError | SimulationFault):
        line, status = str(error), 2 if isinstance(error, InputError) else 1
    else:
        line, status = f"a fault of ours: {type(error).__name__}: {error}", 1
    print("testbed:", " ".join(line.split()), file=sys.stderr)
    return status


def _wait(child: int) -> int | None:
    """Exit status of a child, which is killed at the time limit; None: it was."""
    over = time.monotonic() + WAITED * LIMIT_S
    pause_s = 0.001
    while time.monotonic() < over:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            code = os.waitstatus_to_exitcode(status)
            return None if code == -signal.SIGXCPU else code
        time.sleep(pause_s)
        pause_s = min(2.0 * pause_s, 0.1)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return None


@cache
def _warm() -> None:
    """Import and compile here what every child would else do for itself; pictures, most of a short
    run's time, have few pixels from here on.
    """
    from testbed.scenario.scenario import load_scenario
    from testbed.simulation import pictures
    from testbed.simulation.workers import single_threaded
    from testbed.world.simulation import Simulation

    single_threaded()
    for name in WARM:
        importlib.import_module(name)
    world = Simulation(load_scenario("stand_slope_45"))
    world.run_block(20)
    world.close()
    pictures.LARGE, pictures.SMALL = (60, 40), (36, 24)
    gc.collect()
    gc.freeze()  # a child's collector would else copy every page that they share
