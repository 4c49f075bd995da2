"""Processes that draw a run's report on the other core: they load what drawing needs while the run
goes on.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from testbed.report.run_report import Drawn

WORKERS = 2
SHORTEST_S = 20.0
"""Simulated time of a run whose report is worth processes of its own."""


class Drawers:
    """Processes that draw; each takes every so many-th picture of a report."""

    def __init__(self) -> None:
        """Start them, and let them load what they need."""
        self._pool = ProcessPoolExecutor(
            WORKERS, mp_context=get_context("spawn"), initializer=_begin
        )
        for _ in range(WORKERS):
            self._pool.submit(_load)

    def draw(self, folder: Path) -> list[Drawn]:
        """All pictures of the run in `folder`, in order. Raises what drawing raises."""
        shares: list[Future[dict[int, Drawn]]] = [
            self._pool.submit(_draw, str(folder), share) for share in range(WORKERS)
        ]
        drawn: dict[int, Drawn] = {}
        for share in shares:
            drawn |= share.result()
        return [drawn[number] for number in sorted(drawn)]

    def close(self) -> None:
        """End them."""
        self._pool.shutdown(wait=False, cancel_futures=True)


@contextmanager
def drawers(simulated_s: float) -> Iterator[Drawers | None]:
    """Context: Drawers of a run of `simulated_s`; None where it is short or there is one core."""
    cores = os.sched_getaffinity(0) if sys.platform == "linux" else range(os.cpu_count() or 1)
    if simulated_s < SHORTEST_S or len(cores) < WORKERS:
        yield None
        return
    them = Drawers()
    try:
        yield them
    finally:
        them.close()


def _begin() -> None:
    """Ctrl-C is the run's, which sums itself up."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _load() -> None:
    """What every picture needs: the drawing library with its fonts, and what reads a run."""
    import testbed.workflows.report  # noqa: F401
    from testbed.report.style import new_figure, svg

    svg(new_figure(1, 2.0)[0], "first")


def _draw(folder: str, share: int) -> dict[int, Drawn]:
    """Number of a picture -> the picture, of every WORKERS-th from `share` on."""
    from testbed.workflows.report import pictures_of

    return pictures_of(Path(folder), range(share, 10**6, WORKERS))
