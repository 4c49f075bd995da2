"""A channel whose clock is not that of the others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from testbed.formats.arrays import Array
from testbed.recording.checker.balance import ALIKE, GROSS, MENDED, WORST
from testbed.recording.checker.finding import Finding
from testbed.recording.checker.forces import Forces

LATEST_S, STEPS = 0.3, 30
"""Largest shift that is tried, and into how many steps it is cut, each way."""
LATE_S = 0.035
"""What is late by less may be a sensor's own delay, which is for the diagnosis to find."""


def check_late(forces: Forces, names: Mapping[str, str]) -> list[Finding]:
    """A channel that would balance the other forces at another time, and does not at its own."""
    as_it_is = forces.misfit({})
    if as_it_is < WORST:
        return []
    found = []
    for channels, label in _suspects(forces, names):
        if _moves_friction(channels, forces) and as_it_is < GROSS:
            continue
        left, late_s = _best(forces, channels)
        if abs(late_s) > LATE_S and left < MENDED * as_it_is:
            found.append((left, label, late_s))
    if not found:
        return []
    found.sort()
    best = found[0][0]
    (left, label, late_s), *others = [one for one in found if one[0] < ALIKE * best + 0.1 * WORST]
    return [
        Finding(
            "warning",
            label,
            _how(late_s) + "".join(f"; or {other} {_how(by)}" for _, other, by in others),
            f"the force balance leaves {100 * as_it_is:.3g} % of the forces as it is, "
            f"{100 * left:.2g} % once it is moved by {1e3 * abs(late_s):.0f} ms",
            "put the clocks of its logger and of the others together",
        )
    ]


def _how(late_s: float) -> str:
    return "comes late" if late_s > 0.0 else "comes early"


def _suspects(forces: Forces, names: Mapping[str, str]) -> list[tuple[tuple[str, ...], str]]:
    """(Channels that are moved together, what they are called)."""
    channels = ("reference", "pressure_a", "pressure_b", "force")
    here = [name for name in channels if name in forces.even.series]
    pressures = tuple(name for name in here if name.startswith("pressure"))
    found: list[tuple[tuple[str, ...], str]] = [((name,), names[name]) for name in here]
    found.append((("position",), "position"))
    if len(pressures) > 1:
        found.append((pressures, ", ".join(names[name] for name in pressures)))
    return found


def _moves_friction(channels: tuple[str, ...], forces: Forces) -> bool:
    """Whether a shift moves the motion against all forces: what friction does at a reversal looks
    like that, too.
    """
    own = {"pressure_a", "pressure_b", "force"} & set(forces.even.series)
    return "position" in channels or own <= set(channels)


def _best(forces: Forces, channels: tuple[str, ...]) -> tuple[float, float]:
    """(What is left of the balance with channels moved by what suits them best, how late they are,
    s); nothing is known of what is best at the end of what is tried.
    """
    step = max(1, round(LATEST_S * forces.even.rate_hz / STEPS))
    left = {
        lag: _shifted(forces, channels, lag).misfit({})
        for lag in range(-STEPS * step, STEPS * step + 1, step)
    }
    best = min(left, key=lambda lag: left[lag])
    if abs(best) == STEPS * step:
        return left[0], 0.0
    return left[best], best / forces.even.rate_hz


def _shifted(forces: Forces, channels: tuple[str, ...], lag: int) -> Forces:
    """The balance with channels taken `lag` samples later than recorded."""
    even = forces.even
    rows = np.clip(np.arange(even.speed_m_s.size) + lag, 0, even.speed_m_s.size - 1)

    def moved(name: str, values: Array) -> Array:
        return values[rows] if name in channels else values

    series = {name: moved(name, values) for name, values in even.series.items()}
    return replace(
        forces,
        even=replace(
            even,
            series=series,
            speed_m_s=moved("position", even.speed_m_s),
            acceleration_m_s2=moved("position", even.acceleration_m_s2),
        ),
    )
