"""What the channels of one axis or one foot may be: SI unit, meaning with sign, and which rigs
cannot do without.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import NamedTuple

HYDRAULIC = ("vertical-leg", "cylinder")
AXES_KINDS = (*HYDRAULIC, "drive")


class Quantity(NamedTuple):
    """One quantity: SI unit, meaning, the rigs that may have it and those that need it."""

    unit: str
    meaning: str
    rigs: tuple[str, ...] = AXES_KINDS
    needed_by: tuple[str, ...] = ()


QUANTITIES: dict[str, Quantity] = {
    "time": Quantity("s", "time, rising", (*AXES_KINDS, "foot"), (*AXES_KINDS, "foot")),
    "valve_command": Quantity("1", "-1 to 1, + extends, held between samples"),
    "position": Quantity(
        "m", "extension of the piston, + downwards on a leg", AXES_KINDS, AXES_KINDS
    ),
    "pressure_a": Quantity(
        "Pa", "piston side, gauge; in V with a calibration", HYDRAULIC, HYDRAULIC
    ),
    "pressure_b": Quantity("Pa", "rod side, gauge; in V with a calibration", HYDRAULIC),
    "supply_pressure": Quantity("Pa", "supply pressure, gauge"),
    "oil_temperature": Quantity("degC", "oil temperature"),
    "actuator_force": Quantity("N", "force of the actuator, + extends", ("drive",), ("drive",)),
    "force": Quantity("N", "load of the foot, + pressed on the ground", ("foot",), ("foot",)),
    "contact": Quantity("1", "whether the foot carries: at most two distinct values", ("foot",)),
}
LIKELY_MISSPELT = 0.92
"""Names more alike than this (difflib) are the same name misspelt; `pressure_c` is another one."""


def quantities_of(rig: str) -> dict[str, Quantity]:
    """The quantities that a kind of rig may have, by name."""
    return {name: quantity for name, quantity in QUANTITIES.items() if rig in quantity.rigs}


def misspelling_of(name: str, known: Iterable[str]) -> str | None:
    """The known name that an unknown one hardly differs from, None where it is a name of its
    own.
    """
    near = difflib.get_close_matches(name.lower(), list(known), n=1, cutoff=LIKELY_MISSPELT)
    return near[0] if near else None
