"""The scale of a foot: as its machine declares it, or from its recorded force alone where nobody
does.
"""

from __future__ import annotations

import numpy as np

from testbed.formats.arrays import Array
from testbed.machine.model import Machine

ENDS = (0.5, 99.5)
"""Percentiles between which the force lies, but for outliers (E)."""
WINDOW_S, WINDOW_SAMPLES, CALM = 0.2, 25, 0.2
"""The force is at rest in this share of the record's windows: those in which it moves least. A
window is so long, or so many samples where a small leg steps faster than that (E).
"""
NOISE_TO_BREAKAWAY = 3.0
"""So many standard deviations at rest count as break-away force (E)."""
ASSUMED_SHARE = 0.12
"""Of the nominal load: what is held to be the break-away force of a foot that nobody declares, as
seals, gears and a sensor's offset commonly leave it (E).
"""


def nominal_load_n(force_n: Array) -> float:
    """Median of the force (n,), N, where the foot carries: above the middle of its range. Never
    0.
    """
    finite = force_n[np.isfinite(force_n)]
    if not finite.size:
        return 1.0
    low, high = np.percentile(finite, ENDS)
    carrying = finite[finite >= 0.5 * (low + high)]
    load = float(np.median(carrying)) if carrying.size else float(high)
    return max(load, float(np.abs(finite).max()) * 1e-3) or 1.0


def breakaway_n(force_n: Array, time_s: Array) -> float:
    """The error at rest that the noise of the force (n,) shows, N; what friction holds still cannot
    be seen in it.
    """
    finite = np.isfinite(force_n)
    force, time = force_n[finite], time_s[finite]
    if len(time) < 2:
        return 0.0
    width = min(WINDOW_S, WINDOW_SAMPLES * float(np.median(np.diff(time)))) or WINDOW_S
    window = ((time - time[0]) / width).astype(np.int64)
    starts = np.flatnonzero(np.diff(window, prepend=-1))
    counts = np.diff(np.append(starts, len(force)))
    centred = force - np.repeat(np.add.reduceat(force, starts) / counts, counts)
    deviations = np.sqrt(np.add.reduceat(centred**2, starts) / counts)[counts > 2]
    return NOISE_TO_BREAKAWAY * float(np.quantile(deviations, CALM)) if deviations.size else 0.0


def assumed_breakaway_n(force_n: Array, time_s: Array, nominal_load_n: float) -> float:
    """Break-away force of a foot of which nothing is declared, N: as assumed, or what its noise
    shows, where that is more.
    """
    return max(breakaway_n(force_n, time_s), ASSUMED_SHARE * nominal_load_n)


def believed_breakaway_n(machine: Machine) -> float:
    """Break-away force of a vertical cylinder as believed, the larger of both ways, N."""
    cylinder = machine.vertical_cylinder
    out = cylinder.coulomb_out_n + cylinder.static_out_n
    return max(out, cylinder.coulomb_in_n + cylinder.static_in_n)
