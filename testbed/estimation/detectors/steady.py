"""The combined detector (combined.py) over as long as a loss must last.

A foot that bears next to nothing crosses the force of a loss with every blow; means over 20 ms
follow the word of the definition (estimation/losses.py), which waits for as long.
"""

from __future__ import annotations

from typing import ClassVar

from testbed.estimation.detectors.base import CompiledDetector
from testbed.estimation.detectors.combined import Combined, CombinedNumbers, CombinedState, step


class Steady(CompiledDetector, step=step):
    """The weights are the combined detector's."""

    name, text = "steady", "mean of three loads, over 20 ms"
    threshold = -691.5
    Numbers, State = CombinedNumbers, CombinedState
    numbers: ClassVar[dict[str, float]] = Combined.numbers | {"mean_time": 0.02}
