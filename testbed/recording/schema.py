"""Every field of a recording.yaml and every quantity of every kind of rig, read off the objects
that check them.
"""

from __future__ import annotations

from typing import Any

from testbed.formats.schema import HEADS, rows
from testbed.formats.units import convertible
from testbed.recording import robot_columns
from testbed.recording.axis_header import AnyHeader, Header
from testbed.recording.foot import FootHeader
from testbed.recording.quantities import quantities_of
from testbed.recording.robot import RobotHeader

RIGS: dict[str, type[AnyHeader]] = {
    "vertical-leg": Header,
    "cylinder": Header,
    "drive": Header,
    "foot": FootHeader,
    "robot": RobotHeader,
}
"""Kind of rig -> the object that checks its recording.yaml."""
TABLE_HEADS = ("rig", *HEADS)
RIDES_ALONG = "another name: rides along, for whoever looks for what explains a residual"


def tree() -> dict[str, Any]:
    """Kind of rig -> its fields and its quantities, as JSON carries it."""
    return {
        rig: {"fields": [row._asdict() for row in rows(header)], "quantities": quantities(rig)}
        for rig, header in RIGS.items()
    }


def quantities(rig: str) -> list[dict[str, Any]]:
    """The quantities of a kind of rig: name, SI unit, units that convert to it, whether needed,
    meaning.
    """
    found = (
        robot_columns.quantities()
        if rig == "robot"
        else {
            name: (quantity.unit, quantity.meaning, rig in quantity.needed_by)
            for name, quantity in quantities_of(rig).items()
        }
    )
    return [
        {
            "quantity": name,
            "unit": unit,
            "units": units(name, unit),
            "needed": needed,
            "meaning": meaning,
        }
        for name, (unit, meaning, needed) in found.items()
    ]


def units(quantity: str, unit: str) -> list[str]:
    """Every unit that a quantity's column may be in; a pressure sensor's may be a voltage too."""
    volt = ["V", "mV"] if quantity.startswith("pressure_") else []
    return [name for one in unit.split(" or ") for name in convertible(one)] + volt


def table() -> list[list[str]]:
    """Rows of TABLE_HEADS: fields that all rigs share come once, then each kind of rig's own, then
    quantities.
    """
    of_rig = {rig: list(rows(header)) for rig, header in RIGS.items()}
    out: list[list[str]] = []
    seen = set()
    for fields in of_rig.values():
        for row in fields:
            rigs = [other for other, theirs in of_rig.items() if row in theirs]
            if row not in seen:
                out.append(["all" if len(rigs) == len(of_rig) else ", ".join(rigs), *row])
            seen.add(row)
    for rig in RIGS:
        for quantity in quantities(rig):
            default = "" if quantity["needed"] else "left out"
            path = f"channels.{quantity['quantity']}"
            out.append([rig, path, default, " or ".join(quantity["units"]), quantity["meaning"]])
    out.append(["all", "channels.<another>", "left out", "any known unit", RIDES_ALONG])
    return out
