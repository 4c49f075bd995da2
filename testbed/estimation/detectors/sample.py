"""What a detector is handed, live and over a recording."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.estimation.detectors.derived import Derived, OilState, derive
from testbed.formats.records import Record, part
from testbed.machine.names import LEGS
from testbed.recording.rows import DataRow


class Sample(Record):
    """One sample, four feet (fl, fr, rl, rr): every column of `data` by name, and what follows from
    it.

    `sample.row.estimate.own` (4,) N, `sample.row.pressure_a` (12,) Pa, `sample.derived.carried`
    (4,) N.
    """

    row = part(DataRow, "what was measured, estimated and ordered")
    derived = part(Derived, "loads with other friction")


class Watch:
    """Samples of a run, block by block; `belief`: the chain's, shape (1,)."""

    def __init__(self, belief: NDArray[Any]) -> None:
        self._belief, self._state = belief, OilState.zeros(len(LEGS))
        self._last = Derived.zeros()

    def samples(self, rows: NDArray[Any]) -> NDArray[Any]:
        """The next rows (n,) of DataRow, with their estimates, as `Sample` (n,); fields by name:
        `samples[k].row`.
        """
        out = Sample.zeros(len(rows))
        out["row"] = rows
        _derive_all(out, self._belief, self._state, self._last)
        return out.view(np.recarray)


@njit
def _derive_all(samples: Any, belief: Any, state: Any, last: Any) -> None:
    for k in range(samples.shape[0]):
        derive(samples[k].row, belief[0], state, last[0])
        for leg in range(len(LEGS)):
            samples[k].derived.carried[leg] = last[0].carried[leg]
            samples[k].derived.balance[leg] = last[0].balance[leg]
            samples[k].derived.velocity[leg] = last[0].velocity[leg]
            samples[k].derived.published[leg] = last[0].published[leg]
