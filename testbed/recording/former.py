"""What columns of a run were called once: recordings of that time stay readable."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

STEMS: Mapping[str, str] = {
    "estimate_own_low_": "own_low_",
    "estimate_own_high_": "own_high_",
    "estimate_own_sd_": "own_sd_",
}
"""How a column began once -> how it begins now."""
UNITS: Mapping[str, str] = {"ordered_thrust": "1", "ordered_torque": "1"}
"""Units that were once written down for a quantity."""


def current(name: str) -> str:
    """The name that a column has today."""
    for before, now in STEMS.items():
        if name.startswith(before):
            return now + name.removeprefix(before)
    return name


def with_former(names: Iterable[str]) -> list[str]:
    """The names, each followed by what it was called once."""
    out = []
    for name in names:
        out.append(name)
        out += [b + name.removeprefix(n) for b, n in STEMS.items() if name.startswith(n)]
    return out
