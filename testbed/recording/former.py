"""Former names of columns and numbers of a run: recordings that use them stay readable."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TypeVar

from testbed.machine.provenance import DEFAULT, SetName

Item = TypeVar("Item")

STEMS: Mapping[str, str] = {
    "estimate_own_low_": "own_low_",
    "estimate_own_high_": "own_high_",
    "estimate_own_sd_": "own_sd_",
}
"""How a column began once -> how it begins now."""
UNITS: Mapping[str, str] = {"ordered_thrust": "1", "ordered_torque": "1"}
"""Units that were once written down for a quantity."""
NUMBERS: Mapping[str, tuple[str, str]] = {
    "edge_leakage_m3_s_pa": ("edge_at_leakage_m3_s_pa", "edge_bt_leakage_m3_s_pa"),
    "edge_leakage_supply_m3_s_pa": ("edge_pa_leakage_m3_s_pa", "edge_pb_leakage_m3_s_pa"),
}
"""Number of a valve that stood for two edges once -> those of today."""


def current_numbers(known: Mapping[str, Item]) -> dict[str, Item]:
    """A machine's numbers by dotted path, under the paths that they have today."""
    out: dict[str, Item] = {}
    for path, item in known.items():
        group, _, name = path.rpartition(".")
        for now in NUMBERS.get(name, (name,)):
            out[f"{group}.{now}" if group else now] = item
    return out


def written_for(known: Mapping[str, Item]) -> SetName:
    """The set of the machine's numbers that a recording counts from: once valves held no loads, and
    none said so.
    """
    of_a_valve = any(path.startswith("valve.") for path in known)
    return "original" if of_a_valve and "valve.holding_a" not in known else DEFAULT


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
        out += [
            key + name.removeprefix(stem) for key, stem in STEMS.items() if name.startswith(stem)
        ]
    return out
