"""Proportional valve: amplifier lag, hysteresis, second-order spool, dead band."""

from __future__ import annotations

from numba import njit


@njit(cache=True)
def play(state: float, command: float, half_width: float) -> float:
    """Hysteresis as a play operator: the output follows the command, `half_width` behind it in either direction."""
    if command > state + half_width:
        return command - half_width
    if command < state - half_width:
        return command + half_width
    return state


@njit(cache=True)
def spool_step(s: float, rate: float, target: float, wn: float, zeta: float, dt: float) -> tuple[float, float]:
    """One implicit step of s'' = wn^2 (target - s) - 2 zeta wn s', stops at +-1; returns s (1) and s' (1/s)."""
    w = wn * dt
    new_rate = (rate + wn * w * (target - s)) / (1.0 + 2.0 * zeta * w + w * w)
    new = s + dt * new_rate
    if new > 1.0:
        return 1.0, 0.0
    if new < -1.0:
        return -1.0, 0.0
    return new, new_rate


@njit(cache=True)
def opening(s: float, deadband: float) -> float:
    """o = sign(s) max(|s| - d, 0) / (1 - d), -1..1."""
    if s > deadband:
        return (s - deadband) / (1.0 - deadband)
    if s < -deadband:
        return (s + deadband) / (1.0 - deadband)
    return 0.0
