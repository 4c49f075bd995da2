"""The shipped detector: the mean of two loads over a few milliseconds, and a word that is held.

A foot that bears next to nothing under a hammering drill crosses any one level with every blow:
that, not an error of the load, makes most false alarms of a threshold. So the word has three
levels. Below the first a foot is lost. It counts as loaded again once it has stayed above the
second, which is further up by what friction hides, for longer than a few blows; or above the third,
where no friction could lift an unloaded foot, for as long as a touchdown lasts.

The loads are `own` and `carried` (derived.py), which take the friction of a resting piston in
different ways, with what a drifting sensor adds to the second one given back (combined.py). The
piston alone, without any friction (`balance`), adds nothing to the two once the word is held.
"""

from __future__ import annotations

from typing import ClassVar

from testbed.estimation.detectors.base import CompiledDetector, Hold
from testbed.estimation.detectors.combined import Combined, CombinedNumbers, CombinedState, step


class Held(CompiledDetector, step=step):
    """All numbers were set on the tuning scenes, N and s on a machine of 4 t."""

    name, text = "held", "mean of two loads over 5 ms, three levels"
    threshold = -175.0
    hold: Hold = Hold(margin=626.0, dwell_s=0.22, sure_margin=1200.0, sure_s=0.018)
    Numbers, State = CombinedNumbers, CombinedState
    numbers: ClassVar[dict[str, float]] = Combined.numbers | {
        "mean_time": 0.005,
        "weight_balance": 0.0,
        "weight_own": 0.83,
        "weight_carried": 0.17,
    }
