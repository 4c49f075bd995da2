"""Pressures against the supply, and the supply against its nominal value."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from testbed.recording.checker.balance import SMALLEST_PA
from testbed.recording.checker.finding import Finding
from testbed.recording.checker.raw import Raw
from testbed.recording.known import Known

NEAR_NOMINAL = 0.2, 1.5
"""Shares of the nominal supply pressure between which a measured one may lie."""
LEAST_SUPPLY_SHARE = 1e-3
"""Share of the supply that the highest pressure of a working cylinder reaches."""
IN_ANOTHER_UNIT = 0.02, 1.5
"""Shares of the supply that make another unit plausible."""
SUPPLY_UNITS = {1e5: "bar", 1e3: "kPa", 1e6: "MPa", 6894.76: "psi"}
BESIDE_SUPPLY, BESIDE_IDLE_SUPPLY = 1.5, 6.0
"""A cylinder's pressure above so many times the supply's is not in the same unit (a lifted load
adds some tenths): the declared supply's; and a measured one's, which may idle while a valve holds
the load.
"""


def check_pressures(raw: Raw, known: Known, *names: str) -> Iterator[Finding]:
    """Pressures against the supply, and the supply against its nominal value."""
    nominal, measured = known.supply_pressure_nominal_pa, raw.series.get("supply_pressure")
    most = BESIDE_IDLE_SUPPLY if nominal is None else BESIDE_SUPPLY
    if nominal and measured is not None:
        ratio = float(np.median(measured)) / nominal
        if not NEAR_NOMINAL[0] < ratio < NEAR_NOMINAL[1]:
            yield _of_supply("supply_pressure", ratio, "its nominal value")
    if nominal is None and measured is not None:  # one that follows the load is often lower
        nominal = float(np.quantile(measured, 0.99))
    if not nominal or nominal <= 0.0:
        highest = max(
            (float(np.max(np.abs(raw.series[key]))) for key in names if key in raw.series),
            default=1e9,
        )
        if highest < SMALLEST_PA:
            yield Finding(
                "error",
                names[0],
                "is hardly in Pa",
                f"never above {highest:.4g} Pa",
                "declare the unit that the column is in (bar?)",
            )
        return
    for name in names:
        if name in raw.series:
            ratio = float(np.quantile(np.abs(raw.series[name]), 0.99)) / nominal
            if ratio > most or ratio < LEAST_SUPPLY_SHARE:
                yield _of_supply(name, ratio, "the supply pressure")


def _of_supply(name: str, ratio: float, beside: str) -> Finding:
    small = [
        f"{unit} ({factor:g} Pa)"
        for factor, unit in SUPPLY_UNITS.items()
        if IN_ANOTHER_UNIT[0] < ratio * factor < IN_ANOTHER_UNIT[1]
    ]
    return Finding(
        "error",
        name,
        "has another scale than the supply",
        f"{ratio:.4g} of {beside}",
        "declare the unit that the column is in" + (f": {' or '.join(small)}" if small else ""),
    )


def check_idle_supply(raw: Raw) -> Iterator[Finding]:
    """A supply that is next to nothing beside the pressures of most axes."""
    supply = raw.series.get("supply_pressure")
    highest = [
        float(np.quantile(np.abs(values), 0.99))
        for name, values in raw.series.items()
        if name.startswith("pressure_")
    ]
    if supply is None or not highest:
        return
    ratio = float(np.quantile(np.abs(supply), 0.99)) / max(float(np.median(highest)), 1e-12)
    if ratio * BESIDE_IDLE_SUPPLY < 1.0:
        yield _of_supply("supply_pressure", ratio, "the cylinders' pressures")
