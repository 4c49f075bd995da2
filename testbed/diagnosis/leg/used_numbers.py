"""Declared numbers that a diagnosis moved within their tolerance, or found where none was given."""

from __future__ import annotations

from testbed.estimation.friction.declared_numbers import MOST, Used
from testbed.recording.known import Known

UNITS = {"bore_m": "m", "rod_m": "m", "moving_mass_kg": "kg"}
"""Numbers that a fit may move, and their units."""
OF_AREAS = ("bore_m", "rod_m")
"""Those of them whose areas move."""
SAME = 1e-6
"""Share by which a number that stayed may differ from what was declared."""


def used_numbers(declared: Known, used: Known) -> tuple[Used, ...]:
    """What was declared and what a model uses instead, of each number that is not the same."""
    found = []
    for name, unit in UNITS.items():
        given, taken = getattr(declared, name), getattr(used, name)
        if taken is None or (given is not None and abs(taken - given) <= SAME * abs(given)):
            continue
        if not given:
            found.append(Used(name, unit, None, taken))
            continue
        tolerance = declared.tolerance(name)
        power = 2 if name in OF_AREAS else 1  # as identification counts, whose numbers are linear
        off = abs((taken / given) ** power - 1.0) / (power * tolerance)
        found.append(Used(name, unit, given, taken, tolerance, off, off > 0.99 * MOST))
    return tuple(found)
