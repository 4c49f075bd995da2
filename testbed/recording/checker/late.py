"""A load cell whose clock is not that of the other channels."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from testbed.recording.checker.balance import MENDED, WORST
from testbed.recording.checker.finding import Finding
from testbed.recording.checker.forces import Forces

LATEST_S, STEPS = 0.4, 20
"""Largest shift that is tried, and into how many steps it is cut, each way."""
LATE_S = 0.05
"""What is late by less may be a sensor's own delay, which is for the diagnosis to find."""


def check_late(forces: Forces, label: str) -> Iterator[Finding]:
    """A load cell that would balance the other forces at another time, and does not at its own."""
    if "reference" not in forces.even.series:
        return
    as_it_is = forces.misfit({})
    if as_it_is < WORST:
        return
    step = max(1, round(LATEST_S * forces.even.rate_hz / STEPS))
    left = {lag: _shifted(forces, lag) for lag in range(-STEPS * step, STEPS * step + 1, step)}
    best = min(left, key=lambda lag: left[lag])
    late_s = best / forces.even.rate_hz
    inside = abs(best) < STEPS * step  # at the end of what is tried it is no minimum
    if inside and abs(late_s) > LATE_S and left[best] < MENDED * as_it_is:
        yield Finding(
            "warning",
            label,
            "comes late" if late_s > 0.0 else "comes early",
            f"the force balance leaves {100 * as_it_is:.3g} % of the forces as it is, "
            f"{100 * left[best]:.2g} % once it is moved by {1e3 * abs(late_s):.0f} ms",
            "put the clocks of its logger and of the others together",
        )


def _shifted(forces: Forces, lag: int) -> float:
    """What is left of the balance with the load cell taken `lag` samples later than recorded."""
    cell = forces.even.series["reference"]
    moved = cell[np.clip(np.arange(cell.size) + lag, 0, cell.size - 1)]
    series = {**forces.even.series, "reference": moved}
    return replace(forces, even=replace(forces.even, series=series)).misfit({})
