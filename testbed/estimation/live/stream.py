"""The whole robot's estimates and contact states from a real controller, sample by sample, whatever
comes late or not at all.

    stream = Stream(believed)                     # the estimators' belief, as `testbed estimate`
    builds it row = DataRow.zeros()                         # fill in what was measured, by name
    row["t"], row["pressure_a"][:] = ...
    told = stream.update(row)                     # the row with estimates: told["estimate"]["own"],
    told["contact"]

It is the code of a run and of a recording, and gives the same numbers where every sample comes. A
sample no later than the one before is left out. Where samples are missing, what was measured before
and after is joined by straight lines as soon as the next one comes. A number that is missing (nan)
stays what it was last. After a gap longer than LONGEST_GAP_S everything starts anew. `known` says
which feet's words still rest on something.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.estimation.live.believed import Believed
from testbed.estimation.live.chain import ESTIMATED, EstimatorChain
from testbed.estimation.live.feet import KNOWN_S
from testbed.estimation.live.judged import Judge
from testbed.formats.arrays import Array
from testbed.machine.names import LEGS
from testbed.recording.rows import DataRow

LONGEST_GAP_S = 0.5
"""After a longer gap nothing of what was remembered is true any more, s (E)."""
COLUMNS = DataRow.column_names()
MEASURED = np.array([name not in ESTIMATED for name in COLUMNS])
OF_LEG = {
    leg: [
        COLUMNS.index(f"{stem}_{leg}_vertical") for stem in ("position", "pressure_a", "pressure_b")
    ]
    for leg in LEGS
}
"""Without these nothing can be said of a foot."""


class Stream:
    """See the module. `detector`: another one than the chain's own, by name or FILE.py:Class.

    Raises InputError for a detector that is not there.
    """

    def __init__(self, believed: Believed, detector: str | None = None) -> None:
        self._chain, self._dt_s, self._named = EstimatorChain(believed), believed.dt_s, detector
        self._judge = self._fresh_judge()
        self._told = DataRow.zeros()
        self._last: Array | None = None
        self._seen_s = np.full(len(LEGS), -np.inf)

    def _fresh_judge(self) -> Judge | None:
        return None if self._named is None else Judge(self._named, self._chain.belief)

    @property
    def known(self) -> NDArray[np.bool_]:
        """Whether each foot had a whole sample lately, (4,)."""
        return np.asarray(self._told["t"][0] - self._seen_s <= KNOWN_S, dtype=bool)

    def update(self, row: NDArray[Any]) -> NDArray[Any]:
        """One sample: DataRow (1,) -> DataRow (1,) with its estimates; the last one where it comes
        too late.
        """
        now = np.array(DataRow.as_table(row)[0])
        time_s = now[0]
        if not np.isfinite(time_s) or (self._last is not None and time_s <= self._last[0]):
            return self._told.copy()
        if self._last is not None and time_s - self._last[0] > LONGEST_GAP_S:
            self._chain.forget()
            self._judge, self._last = self._fresh_judge(), None
        for index, leg in enumerate(LEGS):
            if np.isfinite(now[OF_LEG[leg]]).all():
                self._seen_s[index] = time_s
        missing = ~np.isfinite(now) & MEASURED
        now[missing] = 0.0 if self._last is None else self._last[missing]
        before = now if self._last is None else self._last
        steps = max(round((time_s - before[0]) / self._dt_s), 1)
        for step in range(1, steps + 1):
            self._step(before + (now - before) * (step / steps) if step < steps else now)
        self._last = now
        return self._told.copy()

    def _step(self, measured: Array) -> None:
        DataRow.as_table(self._told)[0, MEASURED] = measured[MEASURED]
        self._chain.step(self._told)
        if self._judge is not None:
            self._judge.judge(self._told)
