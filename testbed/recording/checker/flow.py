"""Sign and scale of the motion against the valve: oil that flows in moves the piston out.

    v = sqrt((ps - pA) / drop) Q_rated o / A_A (extending),  v = sqrt((ps - pB) / drop) Q_rated o /
    A_B (retracting)

with o the opening beyond the deadband; springs of oil and the spool's delay are left out, so that
only factors count.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from testbed.formats.arrays import Array
from testbed.recording.checker.finding import Finding
from testbed.recording.checker.motion import MOVING_M_S, Even
from testbed.recording.known import Known

OPEN = 1e-3
"""Share of the spool's way from which on a valve lets oil through."""

FAST = 5.0
"""Times that a free piston's expected speed is beyond where friction's direction is certain."""
LATEST_S = 0.12
"""The spool and the oil answer within this."""
CLEAR = 0.5
"""Least correlation of speed and opening that tells a sign."""
FACTOR = 5.0
"""Scales nearer than this may be a worn valve."""
FEW = 200
UNLOADED = 0.1
"""Share of a load cell's largest reading below which the foot is not pressed on it."""


def check_flow(even: Even, known: Known, label: str) -> Iterator[Finding]:
    """A valve command against the motion, or a position whose scale the oil cannot make."""
    if "command" not in even.series:
        return
    opening = _opening(even.series["command"], known.valve_deadband or 0.0)
    expected = _speed(even, known, opening)
    measured = even.speed_m_s
    if (np.abs(opening) > OPEN).sum() < FEW:
        yield from _within_deadband(even, known, label)
        return
    if even.moving.sum() < FEW:
        yield from _hardly_moves(even, expected)
        return
    lag, alike = _best_lag(measured, opening if expected is None else expected, even.rate_hz)
    if abs(alike) < CLEAR:
        return
    if alike < 0.0:
        yield Finding(
            "error",
            label,
            "the piston moves against it: its sign, or the position's, is turned round",
            f"correlation of speed and opening {alike:.2f}",
            "turn the sign of the valve command (+ extends), or of the position (extension)",
        )
    if expected is None:
        return
    cause, answer = np.abs(expected[: len(expected) - lag]), np.abs(measured[lag:])
    clear = (cause > 0.2 * cause.max()) & (answer > MOVING_M_S)
    if clear.sum() < FEW:
        return
    # A leg pressed on something hardly moves however far the valve is open: its free strokes count.
    ratio = float(np.quantile(answer[clear] / cause[clear], 0.8))
    if not 1.0 / FACTOR < ratio < FACTOR:
        yield Finding(
            "error",
            "position",
            "moves by another scale than the oil that flows in",
            f"{ratio:.4g} times the speed that the valve's flow makes",
            "put the position's unit (mm?), the valve command's (%?) or the valve's rated flow right",
        )


def _within_deadband(even: Even, known: Known, label: str) -> Iterator[Finding]:
    """A piston that slides although its valve opens next to nothing, both ways by turns."""
    highest, deadband = float(np.max(np.abs(even.series["command"]))), known.valve_deadband or 0.0
    ways = [(way * even.speed_m_s > MOVING_M_S).sum() for way in (1.0, -1.0)]
    if not 0.0 < highest <= deadband + OPEN or min(ways) < FEW:
        return
    yield Finding(
        "error",
        label,
        "has another scale: it stays in the valve's dead band while the piston slides both ways",
        f"up to {highest:.3g}, the dead band is {deadband:.3g}",
        "put the valve command's unit (1 is fully open) or the declared dead band right",
    )


def _hardly_moves(even: Even, expected: Array | None) -> Iterator[Finding]:
    """A free piston that a flow makes fast, and whose position hardly changes."""
    if expected is None:
        return
    cell = np.abs(even.series.get("reference", np.zeros_like(expected)))
    free = cell <= UNLOADED * float(cell.max())
    fast = free & (np.abs(expected) > FAST * MOVING_M_S)
    if fast.sum() < FEW:
        return
    reached = float(np.quantile(np.abs(even.speed_m_s[free]), 0.95))
    asked = float(np.quantile(np.abs(expected[fast]), 0.8))
    if reached < asked / FACTOR:
        yield Finding(
            "error",
            "position",
            "moves by another scale than the oil that flows in",
            f"up to {reached:.3g} m/s, where the valve's flow makes {asked:.3g} m/s",
            "put the position's unit (km?), the valve command's (%?) or the valve's rated flow right",
        )


def _opening(command: Array, deadband: float) -> Array:
    beyond = np.maximum(np.abs(command) - deadband, 0.0) / (1.0 - deadband)
    return np.asarray(np.sign(command) * beyond)


def _speed(even: Even, known: Known, opening: Array) -> Array | None:
    """Speed that the valve's flow makes, m/s (n,); None where what it takes is not declared or
    recorded.
    """
    pressure_a, pressure_b = even.series.get("pressure_a"), even.series.get("pressure_b")
    supply, flow = known.supply_pressure_nominal_pa, known.valve_rated_flow_m3_s
    drop = known.valve_rated_drop_per_edge_pa
    if (
        pressure_a is None
        or pressure_b is None
        or not supply
        or not flow
        or not drop
        or not known.area_b_m2
    ):
        return None
    out = np.sqrt(np.maximum(supply - pressure_a, 0.0) / drop) / known.area_a_m2
    back = np.sqrt(np.maximum(supply - pressure_b, 0.0) / drop) / known.area_b_m2
    return np.asarray(flow * opening * np.where(opening > 0.0, out, back))


def _best_lag(answer: Array, cause: Array, rate_hz: float) -> tuple[int, float]:
    """(samples by which `answer` follows `cause`, their correlation there): the largest by size."""
    best = (0, 0.0)
    latest = max(1, round(LATEST_S * rate_hz))
    for lag in range(0, latest + 1, max(1, latest // 12)):
        one, other = answer[lag:], cause[: len(cause) - lag]
        if np.std(one) * np.std(other) > 0.0:
            alike = float(np.corrcoef(one, other)[0, 1])
            best = max(best, (lag, alike), key=lambda found: abs(found[1]))
    return best
