"""A recording of the whole robot: `recording.yaml` + its table, read into checked SI columns.

The header is that of one axis but for its channels, which carry the names of the contract's
columns, and `known`, which maps dotted parameters of the machine to value and unit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.formats.checked import Checked, checked
from testbed.formats.checked import Sequence as Listed
from testbed.formats.table import read_columns
from testbed.formats.units import UNITS, convertible, to_si
from testbed.formats.yaml_files import read_mapping
from testbed.machine.build import build_machine
from testbed.machine.model import Machine
from testbed.machine.names import LEGS
from testbed.recording.axis import recording_folder
from testbed.recording.axis_header import (
    RECORDING,
    AnyHeader,
    check_format,
    check_kind_of_rig,
    check_present,
    check_unit,
)
from testbed.recording.checks import check_finite, check_pressure, check_span, check_time, in_pa
from testbed.recording.former import UNITS as FORMER_UNITS
from testbed.recording.former import current_numbers, written_for
from testbed.recording.robot_columns import OF_BODY, OF_LEGS, described, is_evidence, misspelt
from testbed.recording.survey import Surveyed


class Declared(Checked):
    """A number (or list of numbers) of the machine as the robot believes it."""

    value: Annotated[float | tuple[float, ...], Listed]
    """number, or a list"""
    unit: str
    """as `testbed parameters` lists it"""


class RobotHeader(AnyHeader):
    """The contents of a robot's recording.yaml."""

    rig: Literal["robot"]
    """the whole machine"""
    known: dict[str, Declared]
    """parameter of the machine (`testbed parameters`) -> value and unit as believed"""
    surveyed: Surveyed | None = None
    """what was measured before the run; null: each leg is estimated by itself"""
    scenario: str | None = None
    """the scenario that ran"""
    seed: int | None = None
    """its seed"""
    task: str | None = None
    """the kind of its task"""


@dataclass(frozen=True, eq=False)
class RobotRecording:
    """What sensors read and control expected: `data` maps the contract's column names to arrays
    (n,), SI.

    `machine` is what the header's `known` makes of the shipped machine. What estimators said in the
    run is left out.
    """

    folder: Path
    header: RobotHeader
    machine: Machine
    data: Mapping[str, Array]

    @property
    def file(self) -> Path:
        """The header's file."""
        return self.folder / "recording.yaml"

    @property
    def name(self) -> str:
        """The scenario that ran, or the folder's name."""
        return self.header.scenario or self.folder.resolve().name


def read_robot(folder: str | Path, needed: Sequence[str] = ()) -> RobotRecording:
    """Read and check a recording of the whole robot, finished or killed. Every fault is an
    InputError, one line.

    `needed`: quantities that the caller cannot do without, beside those of the feet's loads.
    """
    folder = recording_folder(folder)
    file = folder / "recording.yaml"
    header = read_robot_header(file)
    check_present(header.channels, needed, file)
    machine = machine_of(header, file)
    table = folder / header.data
    channels = {key: c for key, c in header.channels.items() if is_evidence(key)}
    columns = read_columns(
        table, {c.column: f"channels.{key}.column" for key, c in channels.items()}, file
    )
    time = to_si(columns[channels["t"].column], channels["t"].unit)
    check_time(time, header.sample_rate_hz, table, file, channels["t"].column)
    for name, values in columns.items():
        check_finite(name, values, time, table)
    data = {key: in_pa(c, to_si(columns[c.column], c.unit)) for key, c in channels.items()}
    for quantity, channel in channels.items():
        if quantity.startswith("pressure_"):
            check_pressure(channel, data[quantity], time, table)
    for leg in LEGS:
        quantity = f"position_{leg}_vertical"
        field, stroke_m = f"channels.{quantity}.unit", machine.axes[f"{leg}_vertical"].travel_m
        check_span(field, channels[quantity].unit, data[quantity], stroke_m, file)
    return RobotRecording(folder, header, machine, data)


def read_robot_header(path: Path) -> RobotHeader:
    """Read and check the header of a robot's recording. Every fault is an InputError, one line."""
    tree = read_mapping(path, RECORDING)
    check_format(tree, path)
    check_kind_of_rig(tree, "robot", path)
    header = checked(RobotHeader, tree, path)
    for quantity, channel in header.channels.items():
        meant, found = misspelt(quantity), described(quantity)
        if meant is not None:
            raise InputError(
                f"unknown quantity, did you mean {meant!r}?",
                file=path,
                field=f"channels.{quantity}",
            )
        if found is not None and is_evidence(quantity):
            volt = ("V", "mV") if quantity.startswith("pressure_") else ()
            former = (FORMER_UNITS[quantity],) if quantity in FORMER_UNITS else ()
            check_unit(quantity, channel, (*convertible(found[0]), *volt, *former), path)
        else:
            check_unit(quantity, channel, tuple(UNITS), path)
    check_present(header.channels, OF_LEGS if header.surveyed is None else OF_BODY, path)
    if (
        header.surveyed is not None
        and not header.surveyed.drills
        and "ordered_thrust" in header.channels
    ):
        raise InputError(
            "would have no effect: ordered_thrust says when the drill pushes",
            file=path,
            field="surveyed.drills",
            value=False,
        )
    return header


def machine_of(header: RobotHeader, file: Path) -> Machine:
    """The shipped machine with the `known` numbers and the surveyed URDF, which is not read here.

    Raises InputError for a number that no machine has.
    """
    of_set = written_for(header.known)
    shipped, changes = build_machine(of_set=of_set), {}
    for path, item in current_numbers(header.known).items():
        field = f"known.{path}"
        declared = shipped.quantity(path, file, field)
        if item.unit != declared.unit:
            raise InputError(
                "wrong unit",
                file=file,
                field=f"{field}.unit",
                value=item.unit,
                allowed=declared.unit,
            )
        if item.value != declared.value:
            changes[path] = item.value
    machine = build_machine(changes, file=file, section="known", of_set=of_set)
    urdf = None if header.surveyed is None else header.surveyed.urdf
    if urdf is None:
        return machine
    beside = file.parent / urdf  # an absolute path stays what it is
    found = beside if beside.exists() else Path(urdf)
    if not found.is_file():
        raise InputError(
            "no such file",
            file=file,
            field="surveyed.urdf",
            value=urdf,
            allowed="a URDF, its path whole or from the recording's folder",
        )
    return machine.with_urdf(found)
