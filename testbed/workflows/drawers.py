"""Copies of this process that draw a run's report: they load what drawing needs on the other core
while the run goes on.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from testbed.simulation.copies import Copy, can_copy

if TYPE_CHECKING:
    from testbed.report.run_report import Drawn

SHARES = 2
SHORTEST_S = 20.0
"""Simulated time of a run whose report is worth processes of its own."""


class Drawers:
    """Draw: half of a report's pictures by one copy, the others by a copy of that."""

    def __init__(self) -> None:
        """Make the first copy, and let it load what it needs; what both need is loaded here."""
        import testbed.simulation.live_run
        import testbed.workflows.report  # noqa: F401

        self._copy = Copy(_draw)
        self._copy.begin(None)

    def begin(self, folder: Path) -> None:
        """Begin to draw all pictures of the run in `folder`."""
        self._copy.begin(folder)

    def drawn(self) -> list[Drawn]:
        """The pictures, in order. Raises what drawing raises."""
        pictures: dict[int, Drawn] = self._copy.results()[-1]
        return [pictures[number] for number in sorted(pictures)]

    def close(self) -> None:
        """End it."""
        self._copy.close()


@contextmanager
def drawers(simulated_s: float) -> Iterator[Drawers | None]:
    """Context: Drawers of a run of `simulated_s`; None where it is short or there is one core."""
    if simulated_s < SHORTEST_S or not can_copy():
        yield None
        return
    them = Drawers()
    try:
        yield them
    finally:
        them.close()


def _draw(folder: Path | None) -> dict[int, Drawn]:
    """Number of a picture -> the picture; of no folder it is what all of them need."""
    if folder is None:
        _load()
        return {}
    other = Copy(lambda share: _share(folder, share))
    other.begin(1)
    drawn = _share(folder, 0)
    drawn |= other.results()[0]
    other.close()
    return drawn


def _load() -> None:
    """The drawing library with its fonts, the machine's kinematics, and what reads a run."""
    import pyarrow.parquet  # noqa: F401

    from testbed.machine.build import build_machine
    from testbed.report.style import new_figure, svg
    from testbed.robot.robot import Robot

    svg(new_figure(1, 2.0)[0], "first")
    Robot.of(build_machine())


def _share(folder: Path, share: int) -> dict[int, Drawn]:
    """Every SHARES-th picture from `share` on."""
    from testbed.workflows.report import pictures_of

    return pictures_of(folder, range(share, 10**6, SHARES))
