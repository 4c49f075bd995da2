"""Work that leaves a mark when it begins and when it ends, for tests of who does it how often."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

WORK_S = 0.4


def work(item: tuple[str, int]) -> int:
    """The square of a number, after a while; marks in the folder say which process began and which
    ended it.
    """
    folder, number = item
    mark = f"{number}-{os.getpid()}-{time.monotonic_ns()}"
    (Path(folder) / f"began-{mark}").touch()
    time.sleep(WORK_S)
    (Path(folder) / f"ended-{mark}").touch()
    return number**2


def begun_by_killed(item: tuple[str, int]) -> int:
    """`work`; whoever is the first to begin number 3 kills its own process."""
    folder, number = item
    if number == 3 and not (Path(folder) / "killed").exists():
        (Path(folder) / "killed").touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return work(item)


def killing(_: int) -> int:
    """Kills its own process."""
    os.kill(os.getpid(), signal.SIGKILL)
    return 0


def stubborn(item: tuple[str, int]) -> int:
    """Never ends by itself; marks in the folder say that it began, and that it heard Ctrl-C."""
    folder, number = item
    (Path(folder) / f"began-{number}").touch()
    while True:
        try:
            time.sleep(600.0)
        except KeyboardInterrupt:
            (Path(folder) / f"heard-{number}").touch()
