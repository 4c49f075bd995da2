"""At whose cost a name explains: what is missing improves some recordings and leaves the others
alone; what only bends the model towards one recording predicts another worse.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from testbed.diagnosis.leg.acceptance import without
from testbed.diagnosis.leg.evidence import Evidence
from testbed.diagnosis.leg.search import Candidate, Search

COSTLY, SHARE = 0.03, 0.2
"""Growth of a group's noise that is none by chance, as a share, and what share of the largest fall
of a group, in logarithms, it may be: a filter that undoes a slow line raises the noise of slow
motions and asks 0.12, names that were not there asked 0.26 and more (E, 10 sound legs and 14 with
one effect of another simulator; COSTLY went from 5 to 3 % for one more sound leg, looked at later).
"""


def cost(now: Evidence, before: Evidence) -> float:
    """Largest growth of a group's noise on blocks left out, over the largest fall of a group's,
    both in logarithms; 0 where none grows by more than COSTLY, infinite where none falls. Groups at
    rest do not count.
    """
    logs = [
        float(np.log(now.scale[key] / before.scale[key]))
        for key in now.scale
        if key in before.scale and not key[0].endswith("rest")
    ]
    grown, fallen = max(logs, default=0.0), -min(logs, default=0.0)
    if grown <= np.log1p(COSTLY):
        return 0.0
    return grown / fallen if fallen > 0.0 else float("inf")


def dearest(state: Search, candidate: Candidate, names: Iterable[str]) -> str | None:
    """The name whose cost is the largest, and more than SHARE; None where no name's is. One at a
    time, as beside a wrong name a right one looks dear too.
    """
    costs = {
        name: cost(candidate.evidence, without(state, candidate, name).evidence) for name in names
    }
    worst = max(costs, key=lambda name: costs[name], default=None)
    return worst if worst is not None and costs[worst] > SHARE else None
