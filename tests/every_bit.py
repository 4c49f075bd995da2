"""A detector for tests: its contact states depend on every bit of what detectors are handed."""

from __future__ import annotations

import zlib
from typing import Any

import numpy as np

RARE = 64
"""One sample in so many is a lost foot."""


class EveryBit:
    """Finds a foot lost by a checksum of all loads so far, which follow from valve, oil and
    pressures.

    A single bit that differs changes every later checksum, so that the contact states differ soon
    after.
    """

    name = "every_bit"
    threshold = 0.5

    def __init__(self) -> None:
        self._checksums = [0, 0, 0, 0]

    def update(self, sample: Any) -> np.ndarray:
        """Score (4,) of one Sample: 1 where the checksum of a foot's carried loads says so."""
        loads = sample.derived.carried
        pairs = zip(loads, self._checksums, strict=True)
        self._checksums = [zlib.crc32(load.tobytes(), before) for load, before in pairs]
        return np.array([float(checksum % RARE == 0) for checksum in self._checksums])
