"""Loose ground: it gives way under a load for good, and is as firm as the highest load made it.

    ds/dt = max(0, F / k - s) / T

s >= 0 is the settlement under one foot, F its load, k the plastic stiffness.

A linear virgin curve with a viscous delay; unloading gives nothing back (the elastic part is the
ground's stiffness).
"""

from __future__ import annotations

import math


def settled(
    settlement_m: float, load_n: float, plastic_n_m: float, time_s: float, dt: float
) -> float:
    """Settlement after `dt` s under a constant load, m; exact, never smaller than before."""
    goal = load_n / plastic_n_m
    if goal <= settlement_m:
        return settlement_m
    return goal + (settlement_m - goal) * math.exp(-dt / time_s)
