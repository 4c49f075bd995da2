"""The header of a recording of one axis: what `recording.yaml` may say, and what of it contradicts
itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path, PurePath
from typing import Any, Literal

from pydantic import Field, field_validator, model_validator

from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.formats.checked import Checked, Pair, checked
from testbed.formats.units import UNITS, convertible, si_unit, span_to_si
from testbed.formats.yaml_files import read_mapping
from testbed.recording.known import Known
from testbed.recording.quantities import Quantity, misspelling_of, quantities_of

FORMAT = "roboclimber-recording/1"
RECORDING = f"a folder with recording.yaml (format: {FORMAT}) beside its table"


class Calibration(Checked):
    """p = k_pa_per_v (a V + b), equation (2) of the paper."""

    k_pa_per_v: float = Field(gt=0.0)
    """nominal sensitivity, Pa/V"""
    a: float
    """gain, 1 for a sensor as built"""
    b: float
    """zero, V"""

    def pressure_pa(self, volts: Array) -> Array:
        """The pressures that these voltages stand for."""
        return self.k_pa_per_v * (self.a * volts + self.b)

    def volts(self, pressure_pa: Array) -> Array:
        """The voltages that stood for these pressures."""
        return (pressure_pa / self.k_pa_per_v - self.b) / self.a


class Channel(Checked):
    """Where a quantity is in the table, and what its sensor can do."""

    column: str = Field(min_length=1)
    """name of the table's column"""
    unit: str
    """unit of the column; another than SI is converted on reading"""
    resolution: float | None = Field(default=None, gt=0.0)
    """smallest step, in `unit`"""
    range_pa: Pair | None = None
    """a pressure sensor's ends, Pa: clipped there"""
    calibration: Calibration | None = None
    """of a pressure in V"""
    meaning: str | None = None
    """in words what it is"""

    @field_validator("range_pa")
    @classmethod
    def _rising(cls, value: tuple[float, float] | None) -> tuple[float, float] | None:
        if value is not None and not value[0] < value[1]:
            raise ValueError("the lower end of the range must be below the upper end")
        return value

    @property
    def in_volt(self) -> bool:
        """Whether the column is a voltage, which a calibration turns into a pressure."""
        return si_unit(self.unit) == "V"

    def in_si(self) -> Channel:
        """The same channel once its column has been converted."""
        finest = None if self.resolution is None else span_to_si(self.resolution, self.unit)
        return self.model_copy(update={"unit": si_unit(self.unit), "resolution": finest})


class ReferenceForce(Checked):
    """What is known of the true external force."""

    kind: Literal["foot-in-air", "free", "load-cell"]
    """foot-in-air, free: it is 0 N; load-cell: it was measured"""
    column: str | None = None
    """the load cell's column"""
    unit: str | None = None
    """of the column, the deviation and the resolution"""
    standard_deviation: float | None = Field(default=None, ge=0.0)
    """of the load cell's noise"""
    resolution: float | None = Field(default=None, ge=0.0)
    """the load cell's step"""

    @model_validator(mode="after")
    def _load_cell_has_column(self) -> ReferenceForce:
        if self.kind == "load-cell" and (self.column is None or self.unit is None):
            raise ValueError("a load-cell needs column and unit (N)")
        if self.unit is not None and self.unit not in convertible("N"):
            raise ValueError(f"unit = {self.unit!r} is none of {', '.join(convertible('N'))}")
        return self

    def in_si(self) -> ReferenceForce:
        """The same once its column has been converted."""
        unit = self.unit or "N"
        spans = {
            name: None if value is None else span_to_si(value, unit)
            for name in ("standard_deviation", "resolution")
            for value in (getattr(self, name),)
        }
        return self.model_copy(update={"unit": self.unit and "N", **spans})


class AnyHeader(Checked):
    """What every recording.yaml says, whatever was recorded."""

    format: Literal["roboclimber-recording/1"]
    """this format and its version"""
    data: str = Field(min_length=1)
    """the table beside it: .parquet or .csv"""
    sample_rate_hz: float = Field(gt=0.0, le=1e6)
    """nominal rate; `time` is what counts"""
    channels: dict[str, Channel]
    """quantity -> where it is in the table"""
    description: str | None = None
    """in words what was done"""
    source: str | None = None
    """where the data come from"""
    licence: str | None = None
    """under which they may be used"""

    @field_validator("data")
    @classmethod
    def _beside_it(cls, value: str) -> str:
        path = PurePath(value)
        if path.is_absolute() or ".." in path.parts or "\0" in value:
            raise ValueError("must be a file in the recording's own folder")
        return value


class Header(AnyHeader):
    """The contents of recording.yaml of one axis."""

    rig: Literal["vertical-leg", "cylinder", "drive"]
    """vertical-leg: hydraulic, on a bench; cylinder: perhaps one chamber only; drive: its force is
    known instead of pressures
    """
    known: Known
    """what is declared about the rig; null = to be identified"""
    reference_force: ReferenceForce | None = None
    """the true external force"""

    def in_si(self) -> Header:
        """The same header once the table's columns have been converted."""
        reference = self.reference_force
        changes = {
            "channels": {name: channel.in_si() for name, channel in self.channels.items()},
            "reference_force": None if reference is None else reference.in_si(),
        }
        return self.model_copy(update=changes)


AXIS_RIGS = ("vertical-leg", "cylinder", "drive")
"""Kinds of rig of one axis."""
NAMED = 4
"""So many of the quantities that are missing are listed by name."""


def read_header(path: Path) -> Header:
    """Read and check the header of one axis' recording. Every fault is an InputError, one line."""
    tree = read_mapping(path, RECORDING)
    check_format(tree, path)
    rig = tree.get("rig")
    if rig in ("robot", "foot"):
        what = {"robot": "a run of the whole robot", "foot": "of one foot's force"}[rig]
        raise InputError(
            f"is {what}, not of one axis",
            file=path,
            field="rig",
            value=rig,
            allowed=", ".join(AXIS_RIGS),
        )
    if rig not in AXIS_RIGS:
        raise InputError(
            "is no kind of rig",
            file=path,
            field="rig",
            value=rig,
            allowed=", ".join((*AXIS_RIGS, "foot", "robot")),
        )
    header = checked(Header, tree, path)
    check_quantities(header.channels, quantities_of(header.rig), path, header.rig)
    if header.rig != "drive" and header.known.bore_m is None:
        raise InputError("known.bore_m is missing: the piston area is not known", file=path)
    return header


def check_quantities(
    channels: Mapping[str, Channel], known: Mapping[str, Quantity], path: Path, rig: str
) -> None:
    """Refuse a known quantity in a wrong unit, a misspelt or missing one; any other may ride along
    in a known unit.
    """
    for name, channel in channels.items():
        if name in known:
            volt = ("V", "mV") if known[name].unit == "Pa" and name != "supply_pressure" else ()
            check_unit(name, channel, (*convertible(known[name].unit), *volt), path)
            continue
        meant = misspelling_of(name, known)
        if meant is not None:
            raise InputError(
                f"unknown quantity {name!r}, did you mean {meant!r}?",
                file=path,
                field="channels",
                allowed=", ".join(known) + ", or another name for what rides along",
            )
        check_unit(name, channel, tuple(UNITS), path)
    for name, quantity in known.items():
        if rig in quantity.needed_by and name not in channels:
            raise InputError(f"channels.{name} is missing: a {rig} needs it", file=path)


def check_format(tree: Mapping[str, Any], path: Path) -> None:
    """Refuse a header of another format."""
    if tree.get("format") != FORMAT:
        raise InputError(
            "is not a recording's format",
            file=path,
            field="format",
            value=tree.get("format"),
            allowed=FORMAT,
        )


def check_kind_of_rig(tree: Mapping[str, Any], wanted: str, path: Path) -> None:
    """Refuse a header of another kind of rig before its fields, which differ, are looked at."""
    rig = tree.get("rig", wanted)
    if rig != wanted:
        problem = "is of another kind of rig"
        raise InputError(problem, file=path, field="rig", value=rig, allowed=wanted)


def check_unit(quantity: str, channel: Channel, allowed: Sequence[str], path: Path) -> None:
    """Refuse a channel in another unit than the `allowed` ones, or whose calibration or range does
    not go with its unit.
    """
    if channel.unit not in allowed:
        raise InputError(
            "wrong unit",
            file=path,
            field=f"channels.{quantity}.unit",
            value=channel.unit,
            allowed=" or ".join(allowed),
        )
    if quantity.startswith("pressure_") and channel.in_volt and channel.calibration is None:
        raise InputError(f"channels.{quantity} is in V and needs a calibration", file=path)
    if not channel.in_volt and channel.calibration is not None:
        raise InputError(
            f"is given beside unit {channel.unit}, but turns V into Pa",
            file=path,
            field=f"channels.{quantity}.calibration",
            allowed="unit V with a calibration, or no calibration",
        )
    if channel.range_pa is not None and si_unit(channel.unit) not in ("Pa", "V"):
        raise InputError(
            f"is given beside unit {channel.unit}, but is the range of a pressure sensor",
            file=path,
            field=f"channels.{quantity}.range_pa",
            value=list(channel.range_pa),
            allowed="a pressure in Pa or V with a range, or no range",
        )


def check_present(channels: Mapping[str, Channel], needed: Sequence[str], path: Path) -> None:
    """Refuse a header that lacks some of the `needed` quantities; names the first ones."""
    missing = [quantity for quantity in needed if quantity not in channels]
    if missing:
        others = f", and so are {', '.join(missing[1:NAMED])}" if missing[1:] else ""
        more = f" and {len(missing) - NAMED} more" if len(missing) > NAMED else ""
        raise InputError(f"channels.{missing[0]} is missing{others}{more}", file=path)
