"""Figure 9: the differential force at slow reversals: compression of the oil, stick-slip."""

from __future__ import annotations

import numpy as np

from testbed.benchmarks.paper.experiment import Line, Result
from testbed.benchmarks.paper.leg import RATE_HZ, Trace, run
from testbed.benchmarks.paper.stick_slip import (
    SPEEDS_M_S,
    net_damping_n_s_m,
    sensitivity,
    slips_at,
    slow_reversals,
)
from testbed.estimation.leg.motion import smooth
from testbed.report.page import Table

SLOW_M_S, TRAVEL_M = 1.0e-3, 0.010
COUNT_M = 1.0e-4
BELOW_M_S, ABOVE_M_S = 5.0e-3, 10.0e-3
"""The paper's bound of stick-slip, and a speed well above it."""


def compression_n(trace: Trace, window_s: float = 4.0) -> float:
    """Median over reversals of the change of force before the encoder moves by one count, N."""
    wanted = np.sign(np.diff(trace.reference_m, prepend=trace.reference_m[0]))
    turns = np.flatnonzero((wanted[1:] * wanted[:-1]) < 0.0) + 1
    force, out = smooth(trace.two_chamber_n, 10.0), []
    for turn in turns:
        stop = min(turn + int(window_s * RATE_HZ), len(force))
        shown = trace.encoder_m[turn:stop]
        direction = wanted[turn]
        # from where the piston stood at its furthest until it is one count back
        furthest = int(np.argmax(-direction * shown))
        moved = np.flatnonzero(direction * (shown - shown[furthest]) >= COUNT_M * 0.99)
        moved = moved[moved > furthest]
        if moved.size:
            out.append(float(np.ptp(force[turn : turn + int(moved[0])])))
    return float(np.median(out)) if out else float("nan")


def experiment() -> Result:
    """Reverse slowly and look for both marks."""
    trace = run(slow_reversals(), seed=9).after(1.0)
    counts = [slips_at(speed) for speed in SPEEDS_M_S]
    margins = [net_damping_n_s_m(speed) for speed in SPEEDS_M_S]
    slow = [count for count, speed in zip(counts, SPEEDS_M_S, strict=True) if speed <= BELOW_M_S]
    fast = [count for count, speed in zip(counts, SPEEDS_M_S, strict=True) if speed >= ABOVE_M_S]
    sticking = run(slow_reversals(1, BELOW_M_S, 8.0e-3), seed=9).after(1.0)
    time_s, shown, start = trace.time_s, slice(None, None, 5), slice(0, 1500)
    return Result(
        {
            "compression": compression_n(trace),
            "at_5_mm_s": counts[SPEEDS_M_S.index(BELOW_M_S)],
            "below": max(slow[:-1]),
            "above": max(fast),
        },
        {
            "force": [Line(time_s[shown], smooth(trace.two_chamber_n, 3.0)[shown], "(3)")],
            "position": [
                Line(time_s[shown], (trace.encoder_m[shown] - 0.25) * 1e3, "encoder", 0),
                Line(time_s[shown], (trace.reference_m[shown] - 0.25) * 1e3, "set point", 3, "--"),
            ],
            "speed": [Line(sticking.time_s[start], sticking.speed_m_s[start] * 1e3, "speed", 1)],
            "force_at_5_mm_s": [
                Line(sticking.time_s[start], sticking.two_chamber_n[start], "(3) as read")
            ],
        },
        numbers={"travel_mm": TRAVEL_M * 1e3, "slow_mm_s": SLOW_M_S * 1e3},
        more_tables=[
            Table(
                "Stick-slips in eight seconds, and net damping [kN s/m] (negative: sliding is unstable)",
                [f"{speed * 1e3:g} mm/s" for speed in SPEEDS_M_S],
                [
                    [
                        f"{count} ({margin / 1e3:+.1f})"
                        for count, margin in zip(counts, margins, strict=True)
                    ]
                ],
            ),
            sensitivity(
                {},
                "Speeds [mm/s] with stick-slip, simulated (and where the net damping is "
                "negative): 27 um and +180 N is the declared seal",
            ),
        ],
    )
