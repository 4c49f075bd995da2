"""Figure 12 and Table IV: the Kalman filter and the modified one, and the latter's lock-out."""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.benchmarks.harness import rms
from testbed.benchmarks.paper.experiment import Line, Result
from testbed.benchmarks.paper.figure_06 import in_the_air
from testbed.benchmarks.paper.figure_08 import velocity
from testbed.benchmarks.paper.figure_11 import SLOW_M_S, external_force
from testbed.benchmarks.paper.leg import RATE_HZ
from testbed.estimation.filters import persistent
from testbed.estimation.live.believed import Tuning
from testbed.formats.arrays import Array

TRIALS, E_MAX_N = 12, 300.0
LOCKING_N = 1000.0
"""Smallest of the true steps on which the modified filter is shown to lock out."""
TRIED_N = (75.0, 100.0, 150.0, 200.0, 300.0, 450.0, 600.0)
"""e_max by trial and error, as the paper found its own."""


def locked_out(step_n: float, seed: int) -> bool:
    """Whether the modified filter still misses more than half of a true step two seconds after
    it.
    """
    tuning = Tuning()
    noise = np.random.default_rng([6, seed]).normal(0.0, 60.0, 3000)
    measured = 1000.0 + noise + step_n * (np.arange(3000) >= 1000)
    filtered = modified_kbf(measured, tuning.kbf_q_n2, tuning.kbf_r_n2, E_MAX_N)
    return bool(abs(filtered[-1] - 1000.0 - step_n) > 0.5 * step_n)


def experiment() -> Result:
    """Filter figure 11's force; the truth is zero."""
    # from a quarter of a cycle on: a filter that starts at rest would take its first estimate from
    # a peak
    trace, tuning = in_the_air(), Tuning()
    at_rest = external_force(trace)
    trace = trace.after(float(trace.time_s[0]) + 2.5)
    force, speed = external_force(trace), velocity(trace)
    q, r = tuning.kbf_q_n2, tuning.kbf_r_n2
    rested = rms(modified_kbf(at_rest, q, r, E_MAX_N)) / rms(kbf(at_rest, q, r))
    plain, modified = kbf(force, q, r), modified_kbf(force, q, r, E_MAX_N)
    robust = {
        "process_variance": q,
        "measurement_variance": r,
        "innovation_limit": E_MAX_N,
        "hold_samples": tuning.hold_samples,
    }
    own = persistent.run(force, **robust)
    # the filters answer some hundredths of a second late: the peaks belong to the slow stretch and
    # what follows it
    slow = np.convolve(np.abs(speed) < SLOW_M_S, np.ones(301), "same") > 0.5
    peaks = [float(np.abs(filtered[slow]).max()) for filtered in (plain, modified)]
    tried = {limit: modified_kbf(force, q, r, limit) for limit in TRIED_N}
    best = min(tried, key=lambda e: rms(tried[e]))
    best_peak = float(np.abs(tried[best][slow]).max())
    errors_n = [rms(filtered) for filtered in (force, plain, modified, own)]
    steps = np.random.default_rng(12).uniform(LOCKING_N, 8000.0, TRIALS)
    locked = sum(locked_out(float(step), index) for index, step in enumerate(steps))
    time_s, shown = trace.time_s - trace.time_s[0], slice(None, None, 5)
    x = (
        1000.0
        + 4000.0 * (np.arange(3000) >= 1000)
        + np.random.default_rng(13).normal(0.0, 60.0, 3000)
    )
    lock_t = np.arange(3000) / RATE_HZ
    rows = [
        ["Q", f"{tuning.kbf_q_n2:g}", "N2"],
        ["R", f"{tuning.kbf_r_n2:g}", "N2"],
        ["e_max", f"{E_MAX_N:g}", "N"],
    ]
    return Result(
        {
            "peaks": peaks[1] / peaks[0],
            "trend": errors_n[2] / errors_n[1],
            "at_rest": rested,
            "peaks_at_best": best_peak / peaks[0],
            "trend_at_best": rms(tried[best]) / errors_n[1],
            "locks_out": locked,
        },
        {
            "filtered": [
                Line(time_s[shown], force[shown], "(7)", 3),
                Line(time_s[shown], plain[shown], "Kalman filter", 0),
                Line(time_s[shown], modified[shown], "modified", 1),
            ],
            "step": [
                Line(lock_t, x, "measured", 3),
                Line(lock_t, modified_kbf(x, q, r, E_MAX_N), "modified", 1),
                Line(lock_t, persistent.run(x, **robust), "the testbed's own", 2, "--"),
            ],
        },
        {
            "constants": rows,
            "errors": [
                [name, f"{error:.1f}"]
                for name, error in zip(("none", "Kalman", "modified", "own"), errors_n, strict=True)
            ],
            "tried": [
                [f"{limit:g}", f"{rms(filtered):.1f}", f"{np.abs(filtered[slow]).max():.0f}"]
                for limit, filtered in tried.items()
            ],
        },
        {"e_max_n": E_MAX_N, "best_n": best, "plain_n": peaks[0], "modified_n": peaks[1]},
    )


# The published filters on filterpy, for recordings and the paper's figures: 40 us a sample.
#
# The compiled ones, which run live, are tested equal to these.


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
