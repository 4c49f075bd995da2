"""Units that a recording may be written in, and how each becomes SI: value in SI = factor * (value
+ zero).
"""

from __future__ import annotations

from typing import NamedTuple, TypeVar

import numpy as np

from testbed.errors import check_one_of
from testbed.formats.arrays import Array

Number = TypeVar("Number", float, Array)


class Unit(NamedTuple):
    """One unit: the SI unit it becomes, the factor, and what is added before (a temperature's
    zero).
    """

    si: str
    factor: float = 1.0
    zero: float = 0.0


_FACTORS: dict[str, dict[str, float]] = {
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
    "m": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254},
    "Pa": {
        "Pa": 1.0,
        "hPa": 1e2,
        "kPa": 1e3,
        "MPa": 1e6,
        "mbar": 1e2,
        "bar": 1e5,
        "psi": 6894.757293168,
    },
    "V": {"V": 1.0, "mV": 1e-3},
    "A": {"A": 1.0, "mA": 1e-3},
    "N": {"N": 1.0, "daN": 10.0, "kN": 1e3, "MN": 1e6, "kgf": 9.80665, "lbf": 4.4482216152605},
    "N m": {"N m": 1.0, "Nm": 1.0, "kN m": 1e3, "kNm": 1e3},
    "kg": {"kg": 1.0, "g": 1e-3, "t": 1e3},
    "rad": {"rad": 1.0, "mrad": 1e-3, "deg": np.pi / 180.0},
    "rad/s": {"rad/s": 1.0, "deg/s": np.pi / 180.0, "rpm": np.pi / 30.0},
    "m/s": {"m/s": 1.0, "mm/s": 1e-3},
    "m/s2": {"m/s2": 1.0, "mm/s2": 1e-3, "g0": 9.80665},
    "m3/s": {"m3/s": 1.0, "l/min": 1e-3 / 60.0},
    "1": {"1": 1.0, "%": 1e-2},
    "W": {"W": 1.0, "kW": 1e3},
    "Hz": {"Hz": 1.0, "kHz": 1e3},
}
UNITS: dict[str, Unit] = {
    **{name: Unit(si, factor) for si, group in _FACTORS.items() for name, factor in group.items()},
    "degC": Unit("degC"),
    "K": Unit("degC", 1.0, -273.15),
    "degF": Unit("degC", 5.0 / 9.0, -32.0),
}
"""Every unit that is understood, by its name."""


def convertible(si: str) -> tuple[str, ...]:
    """The names of all units that become `si`, which stands first."""
    return (si, *(name for name, unit in UNITS.items() if unit.si == si and name != si))


def si_unit(unit: str) -> str:
    """The SI unit that `unit` becomes. Raises InputError for one that is not known."""
    check_one_of(unit, UNITS, "unit", "unknown unit")
    return UNITS[unit].si


def to_si(values: Number, unit: str) -> Number:
    """A value or an array in `unit`, as SI; temperatures in degC."""
    found = UNITS[unit]
    return (
        values
        if found.factor == 1.0 and found.zero == 0.0
        else (values + found.zero) * found.factor
    )


def span_to_si(span: float, unit: str) -> float:
    """A difference (a resolution, a standard deviation) in `unit`, as SI: no zero is added."""
    return span * UNITS[unit].factor
