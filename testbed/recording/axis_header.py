"""The header of a recording of one axis: what `recording.yaml` may say, and what of it contradicts itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from testbed.errors import InputError
from testbed.formats.checked import Checked, Pair, checked
from testbed.formats.yaml_files import read_mapping
from testbed.recording.known import Known

FORMAT = "roboclimber-recording/1"

UNITS: dict[str, tuple[str, ...]] = {
    "time": ("s",),
    "valve_command": ("1",),
    "position": ("m",),
    "pressure_a": ("V", "Pa"),
    "pressure_b": ("V", "Pa"),
    "supply_pressure": ("Pa",),
    "oil_temperature": ("degC",),
    "actuator_force": ("N",),
}


class Calibration(Checked):
    """p = k_pa_per_v (a V + b), equation (2) of the paper."""

    k_pa_per_v: Annotated[float, Field(gt=0.0)]
    a: float
    b: float


class Channel(Checked):
    """Where a quantity is in the table, and what its sensor can do."""

    column: Annotated[str, Field(min_length=1)]
    unit: str
    resolution: Annotated[float, Field(gt=0.0)] | None = None
    range_pa: Pair | None = None
    calibration: Calibration | None = None

    @field_validator("range_pa")
    @classmethod
    def _rising(cls, value: tuple[float, float] | None) -> tuple[float, float] | None:
        if value is not None and not value[0] < value[1]:
            raise ValueError("the lower end of the range must be below the upper end")
        return value


class ReferenceForce(Checked):
    """What is known of the true external force."""

    kind: Literal["foot-in-air", "free", "load-cell"]
    column: str | None = None
    unit: Literal["N"] | None = None
    standard_deviation: Annotated[float, Field(ge=0.0)] | None = None
    resolution: Annotated[float, Field(ge=0.0)] | None = None

    @model_validator(mode="after")
    def _load_cell_has_column(self) -> ReferenceForce:
        if self.kind == "load-cell" and (self.column is None or self.unit is None):
            raise ValueError("a load-cell needs column and unit (N)")
        return self


class Header(Checked):
    """The contents of recording.yaml."""

    format: Literal["roboclimber-recording/1"]
    rig: Literal["vertical-leg", "cylinder", "drive"]
    data: Annotated[str, Field(min_length=1)]
    sample_rate_hz: Annotated[float, Field(gt=0.0, le=1e6)]
    channels: dict[str, Channel]
    known: Known
    reference_force: ReferenceForce | None = None
    description: str | None = None
    source: str | None = None
    licence: str | None = None


def read_header(path: Path) -> Header:
    """Read and check the header of one axis' recording. Every fault is an InputError, one line."""
    tree = read_mapping(path)
    check_format(tree, path)
    if tree.get("rig") == "robot":
        raise InputError(
            "is a run of the whole robot, not of one axis",
            file=path,
            field="rig",
            value="robot",
            allowed="vertical-leg, cylinder, drive",
        )
    header = checked(Header, tree, path)
    for quantity, channel in header.channels.items():
        if quantity not in UNITS:
            raise InputError(
                f"unknown quantity {quantity!r}",
                file=path,
                field="channels",
                allowed=", ".join(UNITS),
            )
        check_unit(quantity, channel, UNITS[quantity], path)
    check_present(header.channels, ("time", "position"), path)
    if header.rig == "drive" and "actuator_force" not in header.channels:
        raise InputError("channels.actuator_force is missing: a drive needs it", file=path)
    if header.rig != "drive" and "pressure_a" not in header.channels:
        raise InputError(f"channels.pressure_a is missing: a {header.rig} needs it", file=path)
    if header.rig != "drive" and header.known.bore_m is None:
        raise InputError("known.bore_m is missing: the piston area is not known", file=path)
    return header


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


def check_unit(quantity: str, channel: Channel, allowed: Sequence[str], path: Path) -> None:
    """Refuse a channel in another unit than the `allowed` ones, or whose calibration does not go with its unit."""
    if channel.unit not in allowed:
        raise InputError(
            "wrong unit",
            file=path,
            field=f"channels.{quantity}.unit",
            value=channel.unit,
            allowed=" or ".join(allowed),
        )
    if channel.unit == "V" and channel.calibration is None:
        raise InputError(f"channels.{quantity} is in V and needs a calibration", file=path)
    if channel.unit != "V" and channel.calibration is not None:
        raise InputError(
            f"is given beside unit {channel.unit}, but turns V into Pa",
            file=path,
            field=f"channels.{quantity}.calibration",
            allowed="unit V with a calibration, or no calibration",
        )


def check_present(channels: Mapping[str, Channel], needed: Sequence[str], path: Path) -> None:
    """Refuse a header that lacks one of the `needed` quantities."""
    for quantity in needed:
        if quantity not in channels:
            raise InputError(f"channels.{quantity} is missing", file=path)
