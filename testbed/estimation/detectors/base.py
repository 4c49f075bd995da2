"""What every detector is: a compiled step over four feet at once, from signals to scores; causal, no truth.

`step(signals, state, p, score)`: signals [SIGNALS, 4] of this sample, state [4, n] of the detector's own, numbers p,
score [4] out: the higher, the surer that the foot has lost its load. An alarm stands while score >= threshold, so one
pass over a run gives the answers at every threshold. `run` is the same over many samples.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Detector:
    """One detector of the table."""

    name: str
    text: str
    """What it does, in half a sentence."""
    run: Callable[[Any, Any, Any, Any], None]
    """run(signals [n, SIGNALS, 4], state [4, state_size], numbers, score [n, 4])."""
    state_size: int
    numbers: tuple[float, ...]
    """Constants; set on the tuning scenes where they are not given by the machine."""
    best: bool = False

    def start(self) -> Array:
        """A state that has seen nothing."""
        return np.zeros((4, max(self.state_size, 1)))
