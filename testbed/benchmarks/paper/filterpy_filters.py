"""The published filters on filterpy, for recordings and the paper's figures: 40 us a sample.

The compiled ones, which run live, are tested equal to these.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.formats.arrays import Array


def _random_walk(first: float, q: float, r: float) -> Any:
    from filterpy.kalman import KalmanFilter

    kf = KalmanFilter(dim_x=1, dim_z=1)
    kf.x = np.array([[first]])
    kf.F = kf.H = np.eye(1)
    kf.P, kf.Q, kf.R = np.array([[r]]), np.array([[q]]), np.array([[r]])
    return kf


def kbf(z: Array, q_n2: float, r_n2: float) -> Array:
    """The KBF (6) over z[n] in N; starts at z[0] with P = R. Returns x[n] in N."""
    return modified_kbf(z, q_n2, r_n2, np.inf)


def modified_kbf(z: Array, q_n2: float, r_n2: float, e_max_n: float) -> Array:
    """The modified KBF (6, Fig. 10) over z[n] in N: no state update while |z_k - x_(k-1)| >
    e_max.
    """
    kf = _random_walk(float(z[0]), q_n2, r_n2)
    x = np.empty(z.size)
    x[0] = z[0]
    for index in range(1, z.size):
        error = abs(z[index] - kf.x[0, 0])
        kf.predict()
        kf.update(z[index] if error <= e_max_n else None)
        x[index] = kf.x[0, 0]
    return x
