"""The floor: what the best causal decision from the true load misses, through the sensors' own
delay and noise.

    z   = true normal force through the transducers' lag, with their noise through both piston
    areas, sampled S_k = clip(S_(k-1) + clip((F - z_k) / (2 s), -1, 1), -H, H),   F the force of a
    loss, s the noise of z

S adds up the likelihood ratio of `less than F` against `more`, at most one a sample, over a window
of 2 H samples: as long as a loss must last. It knows no friction, no drift, no other leg and no
inertia to be wrong about; what it still misses is what nobody can know who does not see the future:
whether a touch or a gap will last. It calls a foot lost from a threshold of S on, which is set on
the tuning scenes for the fewest wrong seconds.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.estimation.detectors.base import Hold
from testbed.estimation.losses import LossRule
from testbed.machine.model import Machine

Array = NDArray[np.float64]
NAME, TEXT = "floor", "true load through the sensors' delay and noise"
THRESHOLD = 6.0
HOLD = Hold(dwell_s=0.0)
"""Its window does for both ways."""


def noise_n(machine: Machine) -> float:
    """Noise of a load measured through the pressure transducers of a vertical cylinder, one sample,
    N.
    """
    cylinder = machine.vertical_cylinder
    area_a = 0.25 * math.pi * cylinder.bore_m**2
    area_b = area_a - 0.25 * math.pi * cylinder.rod_m**2
    return machine.sensor.pressure_noise_pa * math.hypot(area_a, area_b)


def floor_scores(
    normal_n: Array, machine: Machine, rule: LossRule, dt_s: float, seed: int
) -> Array:
    """Scores (n, 4), -H to H, of true normal forces (n, 4)."""
    from scipy.signal import lfilter

    keep = math.exp(-2.0 * math.pi * machine.sensor.transducer_bandwidth_hz * dt_s)
    late = lfilter([1.0 - keep], [1.0, -keep], normal_n, axis=0)
    sd = noise_n(machine)
    seen = late + np.random.default_rng([seed, 7]).normal(0.0, sd, normal_n.shape)
    out = np.empty(normal_n.shape)
    half = 0.5 * rule.shortest_s / dt_s
    _add_up((rule.force_n - seen) / (2.0 * sd), half, out)
    return out


@njit
def _add_up(gains: Any, most: float, out: Any) -> None:
    for foot in range(gains.shape[1]):
        total = 0.0
        for n in range(gains.shape[0]):
            total += min(max(gains[n, foot], -1.0), 1.0)
            total = min(max(total, -most), most)
            out[n, foot] = total
