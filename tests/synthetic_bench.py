"""A bench of other laws than the machine's: one chamber pressed on a load cell at three levels of
pressure.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from testbed.benchmarks.estimators.identification_trials import KNOWN, recording_of, speed_profile
from testbed.recording.axis import Recording
from testbed.recording.known import Known


def bench(
    speeds: Sequence[float], seed: int = 0, zero_n: float = 25.0, area: float = 1.03
) -> tuple[list[Recording], Known]:
    """(recordings, known): `area` times the declared area, a constant force of the sensors' zeros,
    Coulomb 80 N.
    """
    known = KNOWN.model_copy(
        update={"rod_m": None, "moving_mass_kg": None, "inclination_deg": 90.0}
    )
    out: list[Recording] = []
    for k, level in enumerate((1e5, 3e5, 7e5)):
        rng = np.random.default_rng([seed, k])
        v = speed_profile(speeds, longest_s=1.0, travel_m=0.02)
        t = np.arange(v.size) * 1e-3
        pa = level + 2e4 * np.sin(t) + rng.normal(0.0, 200.0, t.size)
        reference = (
            area * known.area_a_m2 * pa + zero_n - 80.0 * np.sign(v) + rng.normal(0.0, 1.7, t.size)
        )
        x = 0.2 + np.cumsum(v) * 1e-3
        r = recording_of(t, x, pa, 0 * pa, reference, known, "load-cell")
        header = r.header.model_copy(update={"rig": "cylinder"})
        out.append(replace(r, name=f"level{k}", header=header, pressure_b_pa=None))
    return out, known
