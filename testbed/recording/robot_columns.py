"""The columns of a recording of the whole robot: unit and meaning, and which of them an estimate
starts from.
"""

from __future__ import annotations

import difflib

from testbed.machine.names import AXES, LEGS, SIDES
from testbed.recording.former import current
from testbed.recording.rows import DataRow

_COLUMNS = {column.name: column for column in DataRow.columns()}
_SAID = ("estimate_", "own_", "contact_", "reference_")
"""What estimators, detectors and the position loops said during the run: nothing is computed from
it again.
"""
_PER_AXIS = ("position_", "pressure_a_", "pressure_b_", "valve_")
_VERTICAL = tuple(f"{stem}{leg}_vertical" for stem in _PER_AXIS[:3] for leg in LEGS)
OF_LEGS: tuple[str, ...] = ("t", *_VERTICAL, "attitude_roll", "attitude_pitch")
"""Without these there is no load of a foot."""
OF_JOINTS: tuple[str, ...] = (
    *(f"{stem}{axis}" for stem in _PER_AXIS[:3] for axis in AXES),
    *OF_LEGS[-2:],
)
"""With these the forces of a leg's three cylinders are known, whatever holds the body."""
OF_BODY: tuple[str, ...] = (
    "t",
    *(f"{stem}{axis}" for stem in _PER_AXIS for axis in AXES),
    "supply_pressure",
    "oil_temperature",
    *(f"rope_tension_{side}" for side in SIDES),
    *(f"attitude_{angle}" for angle in ("roll", "pitch", "yaw")),
    *(f"angular_rate_{axis}" for axis in "xyz"),
)
"""Without these the body of a surveyed machine cannot be balanced."""


def described(quantity: str) -> tuple[str, str] | None:
    """(unit, meaning) of a quantity of the whole robot; None for one that has no declared
    meaning.
    """
    column = _COLUMNS.get(current(quantity))
    return None if column is None else (column.unit, column.meaning)


def quantities() -> dict[str, tuple[str, str, bool]]:
    """Pattern of a column's name -> (SI unit, meaning, whether a robot's recording must have
    it).
    """
    units: dict[str, list[str]] = {}
    found = {}
    for column in DataRow.columns():
        pattern = _pattern(column.name)
        units.setdefault(pattern, [])
        if column.unit not in units[pattern]:
            units[pattern].append(column.unit)
        found[pattern] = (column.meaning, column.name in OF_BODY)
    return {
        name: (" or ".join(units[name]), meaning, needed)
        for name, (meaning, needed) in found.items()
    }


def _pattern(name: str) -> str:
    """A column's name with `<leg>_<joint>`, `<leg>` or `<left|right>` in the place of one of
    them.
    """
    for names, placeholder in (
        (AXES, "<leg>_<joint>"),
        (LEGS, "<leg>"),
        (SIDES, "<" + "|".join(SIDES) + ">"),
    ):
        for one in names:
            if name.endswith(f"_{one}"):
                return name.removesuffix(one) + placeholder
    return name


def is_evidence(quantity: str) -> bool:
    """Whether estimates are computed from it: what sensors read, what control ordered and
    expected.
    """
    return described(quantity) is not None and not quantity.startswith(_SAID)


def misspelt(quantity: str) -> str | None:
    """The axis that a quantity such as `valve_fl_vertcal` means, where it names none of the twelve;
    else None.
    """
    for stem in _PER_AXIS:
        place = quantity.removeprefix(stem)
        if place != quantity and place not in AXES:
            return stem + (difflib.get_close_matches(place, AXES, n=1, cutoff=0.0) or AXES)[0]
    return None
