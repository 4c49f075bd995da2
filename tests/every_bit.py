"""A detector for tests: its contact states depend on every bit of what detectors are handed."""

from __future__ import annotations

import zlib
from typing import Any

import numpy as np

RARE = 64
"""One sample in so many is a lost foot."""


class EveryBit:
    """Finds a foot lost by a checksum of the loads that follow from valve, oil and pressures."""

    name = "every_bit"
    threshold = 0.5

    def update(self, sample: Any) -> np.ndarray:
        """Score (4,) of one Sample: 1 where the checksum of a foot's carried load says so."""
        loads = sample.derived.carried
        return np.array([float(zlib.crc32(load.tobytes()) % RARE == 0) for load in loads])
