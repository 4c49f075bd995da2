"""A machine of your own: one folder with its numbers (machine.yaml) and its bodies (robot.urdf).

    format: roboclimber-machine/1
    name: my climber
    description: what it is
    length_scale: 0.5      # numbers not given are ROBOCLIMBER's, scaled by Froude's law (1: as is)
    set: original          # of which set: a constant supply, no holding valves; or
                           # inferred: the paper's circuit
    without: [drill]       # what the drawn URDF leaves out: drill, ropes
    numbers:               # groups and names of roboclimber.yaml, with unit, mark and source
      oil: {entrained_air: {value: 0.01, unit: "1", mark: E, source: "new oil"}}

Geometry, masses, strokes and ranges are the URDF's, and a number that says otherwise is refused:
one truth.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from testbed import resources
from testbed.errors import InputError
from testbed.formats.checked import Checked, Sequence, checked
from testbed.formats.files import check_links
from testbed.formats.yaml_files import read_mapping
from testbed.machine.model import SHIPPED, Machine
from testbed.machine.overridden import check_kind, check_read
from testbed.machine.provenance import (
    DEFAULT,
    Quantity,
    SetName,
    machine_set,
    quantities_of,
    read_quantities,
)
from testbed.machine.scale import exponent

NUMBERS, BODIES = "machine.yaml", "robot.urdf"
OF_THE_MATERIAL = ("oil.bulk_modulus_pa", "rock.")
"""Numbers that no size changes."""


class Head(Checked):
    """What machine.yaml says beside its numbers."""

    format: Literal["roboclimber-machine/1"]
    name: str = Field(min_length=1, max_length=80)
    """what people call it"""
    description: str = ""
    """what it is, one or two sentences"""
    length_scale: float = Field(default=1.0, gt=0.01, le=10.0)
    """its size beside ROBOCLIMBER's"""
    set: SetName = DEFAULT
    """which of ROBOCLIMBER's sets gives the numbers that are not here"""
    without: Annotated[tuple[Literal["drill", "ropes"], ...], Sequence] = ()
    """what the drawn URDF leaves out"""
    numbers: dict[str, Any] = Field(default_factory=dict)
    """as in roboclimber.yaml"""


def machine_folder(given: str | Path, folder: Path = Path()) -> Path:
    """The folder of a machine: one of the user's (relative to `folder`), or a shipped one by its
    name.

    Raises InputError where there is neither.
    """
    shipped = Path(__file__).with_name("shipped")
    for found in (folder / given, shipped / str(given)):
        if (found / NUMBERS).is_file():
            return check_links(found.resolve())
    names = ", ".join(sorted(path.name for path in shipped.iterdir() if path.is_dir()))
    raise InputError(
        f"is no folder with a {NUMBERS}",
        field="machine.folder",
        value=str(given),
        allowed=f"a folder of your own, or {names}",
    )


def read_head(folder: Path) -> Head:
    """The head of a machine's numbers. Raises InputError for what cannot be used."""
    path = folder / NUMBERS
    return checked(Head, read_mapping(path), path)


def own_numbers(folder: Path) -> dict[str, Quantity]:
    """The numbers that a folder gives itself, by path. Raises InputError as read_head does."""
    return quantities_of(read_head(folder).numbers, folder / NUMBERS)


def drawing_board(folder: Path) -> Machine:
    """The machine of a folder by its numbers alone, its URDF not read; where there is none, the
    shipped one's.

    Raises InputError naming the number that cannot be.
    """
    head, path = read_head(folder), folder / NUMBERS
    base = read_quantities(Path(__file__).with_name(SHIPPED)) | machine_set(head.set)
    quantities = dict(_scaled(base, head.length_scale))
    machine = Machine.of(quantities, folder / BODIES, path)
    own = own_numbers(folder)
    for name, quantity in own.items():
        old = machine.quantity(name, path, f"numbers.{name}")
        if old.unit != quantity.unit or isinstance(old.value, tuple) != isinstance(
            quantity.value, tuple
        ):
            raise InputError(
                "has another unit or shape",
                file=path,
                field=f"numbers.{name}",
                value=f"{quantity.value} {quantity.unit}",
                allowed=f"like {old.value} {old.unit}",
            )
        quantities[name] = quantity
    machine = Machine.of(quantities, folder / BODIES, path, "numbers")
    for name, quantity in own.items():
        check_read(name, quantity.value, path, "numbers")
        check_kind(name, quantity.value, machine, path, "numbers")
    return machine


def bodies_of_folder(folder: Path) -> Path:
    """The URDF of a folder. Raises InputError where it has none."""
    if not (folder / BODIES).is_file():
        raise InputError(
            "has no URDF", file=folder / BODIES, allowed="one drawn by `testbed machine FOLDER`"
        )
    return folder / BODIES


def _scaled(base: Mapping[str, Quantity], length: float) -> Iterator[tuple[str, Quantity]]:
    """ROBOCLIMBER's numbers at another size, marked for what they then are."""
    for name, quantity in base.items():
        factor = length ** exponent(quantity.unit)
        if factor == 1.0 or name.startswith(OF_THE_MATERIAL):
            same = f"as ROBOCLIMBER: {quantity.source}"
            mark = "D" if quantity.mark == "D" else "E"
            yield name, replace(quantity, mark=mark, source=same)
            continue
        values = quantity.value
        value = (
            tuple(factor * number for number in values)
            if isinstance(values, tuple)
            else factor * values
        )
        source = f"ROBOCLIMBER's {values} scaled by Froude's law, length {length:g}"
        yield name, replace(quantity, value=value, mark="E", source=source)


def is_shipped_urdf(path: Path) -> bool:
    """Whether a URDF is the one of ROBOCLIMBER that travels with the testbed."""
    return path == resources.urdf()
