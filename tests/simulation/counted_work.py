"""Work that leaves a mark when it begins and when it ends, for tests of who does it how often."""

from __future__ import annotations

import os
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
