"""The loads of a scene as they are kept: means of 5 ms, and the stretches in which a foot was off the ground."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from testbed.benchmarks.contact_loss.score import LOSS_N, Flags, stretches
from testbed.estimation.detectors.warning import STEP_S

Array = NDArray[np.float64]
Counts = NDArray[np.int16]
KEPT = ("own", "carried", "balance", "true")
UNIT_N = 5.0
"""Resolution of what is kept."""


def means(values: Array, dt_s: float) -> NDArray[np.int16]:
    """Means of 5 ms of (n, feet) or (n, kinds, feet), in UNIT_N; what is left over at the end is dropped."""
    each = max(round(STEP_S / dt_s), 1)
    whole = len(values) // each
    mean = values[: whole * each].reshape(whole, each, *values.shape[1:]).mean(axis=1)
    return np.asarray(np.clip(np.round(mean / UNIT_N), -32767, 32767), dtype=np.int16)


def off_ground(normal_n: Array, carrying: Flags, dt_s: float) -> list[list[float]]:
    """All stretches below 300 N: foot, start s, end s, 1 where the foot was meant to carry all the time."""
    return [
        [foot, round(a * dt_s, 4), round(b * dt_s, 4), int(carrying[max(a - 1, 0) : b, foot].all())]
        for foot in range(normal_n.shape[1])
        for a, b in stretches(normal_n[:, foot] < LOSS_N)
    ]


def packed(loads: Mapping[str, Counts]) -> str:
    """Loads (m, 4) in UNIT_N of every kind of KEPT as text for a line of JSON."""
    together = np.stack([loads[kind] for kind in KEPT]).astype("<i2")
    return base64.b64encode(zlib.compress(together.tobytes())).decode()


def unpacked(text: str) -> dict[str, Array]:
    """Loads (m, 4) in N by kind."""
    flat = np.frombuffer(zlib.decompress(base64.b64decode(text)), dtype="<i2")
    return dict(zip(KEPT, flat.reshape(len(KEPT), -1, 4) * UNIT_N, strict=True))
