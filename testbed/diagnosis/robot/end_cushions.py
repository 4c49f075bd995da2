"""The end cushions that the machine declares: dampers that brake a piston before either end of its
stroke.
"""

from __future__ import annotations

import numpy as np

from testbed.formats.arrays import Array
from testbed.machine.model import Machine


def end_cushions_n(
    extension_m: Array, speed_m_s: Array, stroke_m: Array, machine: Machine
) -> Array:
    """(n, 12) N along extension, of pistons at these extensions and speeds (n, 12) in strokes (12,)
    (laws/end_stops.py): nothing while a piston leaves its end.
    """
    stops = [axis.end_stop for axis in machine.axes.values()]
    length_m = np.array([stop.cushion_length_m for stop in stops])
    damping = np.array([stop.cushion_damping_n_s_m for stop in stops])
    inner, outer = (
        np.clip(1.0 - gap / length_m, 0.0, 1.0) for gap in (extension_m, stroke_m - extension_m)
    )
    inward, outward = np.maximum(-speed_m_s, 0.0), np.maximum(speed_m_s, 0.0)
    return np.asarray(damping * (inner * inward - outer * outward))
