"""A recording of one hydraulic axis: `recording.yaml` + its table, read into checked SI channels.

A rig is a folder with `identify/<name>/` and `verify/<name>/`, each a recording.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field, field_validator, model_validator

from testbed.errors import InputError
from testbed.parameters.checked import Checked, Pair, checked
from testbed.parameters.known import Known
from testbed.parameters.table import read_columns
from testbed.parameters.yaml_files import read_mapping

FORMAT = "roboclimber-recording/1"
MINIMUM_SAMPLES = 50
"""Fewer rows than this carry no velocity worth the name."""

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

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


@dataclass(frozen=True, eq=False)
class Recording:
    """One recording, SI, one row a sample, length n everywhere; a channel that was not recorded is None.

    Pressures are gauge, through their calibration. `saturated_*` marks samples at the end of a
    sensor's range. `reference_force_n` is the true external force (0 with the foot in the air), None where
    nobody knows it.
    """

    name: str
    folder: Path
    header: Header
    time_s: Array
    position_m: Array
    valve_command: Array | None
    pressure_a_pa: Array | None
    pressure_b_pa: Array | None
    supply_pressure_pa: Array | None
    oil_temperature_degc: Array | None
    actuator_force_n: Array | None
    reference_force_n: Array | None
    saturated_a: Mask
    saturated_b: Mask

    @property
    def rig(self) -> str:
        """`vertical-leg`, `cylinder` or `drive`."""
        return self.header.rig

    @property
    def known(self) -> Known:
        """What is declared."""
        return self.header.known

    @property
    def sample_rate_hz(self) -> float:
        """Nominal rate; `time_s` is what counts."""
        return self.header.sample_rate_hz

    @property
    def is_free(self) -> bool:
        """True where the external force is known to be 0 N."""
        reference = self.header.reference_force
        return reference is not None and reference.kind in ("foot-in-air", "free")

    @property
    def position_resolution_m(self) -> float:
        """The encoder's step; where it is not declared, the smallest step seen (0 if continuous)."""
        declared = self.header.channels["position"].resolution
        if declared is not None:
            return declared
        steps = np.abs(np.diff(np.unique(self.position_m)))
        return float(steps.min()) if steps.size and steps.min() > 1e-7 else 0.0

    def __len__(self) -> int:
        return len(self.time_s)


@dataclass(frozen=True)
class Rig:
    """A machine's recordings: `identify` to fit and to choose on, `verify` to judge on."""

    name: str
    folder: Path
    identify: tuple[Recording, ...]
    verify: tuple[Recording, ...]

    @property
    def kind(self) -> str:
        """`vertical-leg`, `cylinder` or `drive`."""
        return self.identify[0].rig

    @property
    def known(self) -> Known:
        """What is declared (equal in all recordings of a rig)."""
        return self.identify[0].known


def read_recording(folder: str | Path) -> Recording:
    """Read and check one recording folder (or its recording.yaml). Every fault is an InputError, one line."""
    folder = Path(folder)
    folder = folder.parent if folder.name == "recording.yaml" else folder
    if not folder.is_dir():
        raise InputError("no such recording folder", file=folder)
    header = _read_header(folder / "recording.yaml")
    wanted = {c.column: f"channels.{q}.column" for q, c in header.channels.items()}
    reference = header.reference_force
    if reference is not None and reference.column is not None:
        wanted[reference.column] = "reference_force.column"
    data = folder / header.data
    columns = read_columns(data, wanted, folder / "recording.yaml")
    time = columns[header.channels["time"].column]
    _check_time(time, data)
    for name, values in columns.items():
        _check_finite(name, values, time, data)
    return _build(folder, header, columns)


def read_rig(folder: str | Path) -> Rig:
    """Read a rig folder with `identify/` and `verify/`. InputError where one of them is missing or empty."""
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError("no such rig folder", file=folder)
    parts = {}
    for part in ("identify", "verify"):
        if not (folder / part).is_dir():
            raise InputError(
                f"has no folder {part!r}", file=folder, allowed="identify/<name>/ and verify/<name>/"
            )
        names = sorted(p for p in (folder / part).iterdir() if p.is_dir())
        if not names:
            raise InputError("holds no recording", file=folder / part)
        parts[part] = tuple(read_recording(p) for p in names)
    rig = Rig(folder.resolve().name, folder, parts["identify"], parts["verify"])
    for other in (*rig.identify, *rig.verify):
        if other.rig != rig.kind:
            raise InputError(
                f"is of another kind than {rig.identify[0].name}",
                file=other.folder,
                field="rig",
                value=other.rig,
                allowed=rig.kind,
            )
    return rig


def _read_header(path: Path) -> Header:
    tree = read_mapping(path)
    if tree.get("format") != FORMAT:
        raise InputError(
            "is not a recording's format", file=path, field="format", value=tree.get("format"), allowed=FORMAT
        )
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
                f"unknown quantity {quantity!r}", file=path, field="channels", allowed=", ".join(UNITS)
            )
        if channel.unit not in UNITS[quantity]:
            raise InputError(
                "wrong unit",
                file=path,
                field=f"channels.{quantity}.unit",
                value=channel.unit,
                allowed=" or ".join(UNITS[quantity]),
            )
        if channel.unit == "V" and channel.calibration is None:
            raise InputError(f"channels.{quantity} is in V and needs a calibration", file=path)
    for needed in ("time", "position"):
        if needed not in header.channels:
            raise InputError(f"channels.{needed} is missing", file=path)
    if header.rig == "drive" and "actuator_force" not in header.channels:
        raise InputError("channels.actuator_force is missing: a drive needs it", file=path)
    if header.rig != "drive" and "pressure_a" not in header.channels:
        raise InputError(f"channels.pressure_a is missing: a {header.rig} needs it", file=path)
    if header.rig != "drive" and header.known.bore_m is None:
        raise InputError("known.bore_m is missing: the piston area is not known", file=path)
    return header


def _check_time(time: Array, file: Path) -> None:
    if len(time) < MINIMUM_SAMPLES:
        raise InputError(f"too few samples: {len(time)}", file=file, allowed=f"at least {MINIMUM_SAMPLES}")
    _check_finite("time", time, time, file)
    steps = np.diff(time)
    if (steps <= 0).any():
        row = int(np.argmax(steps <= 0)) + 1
        how = "goes backwards" if steps[row - 1] < 0 else "stands still"
        raise InputError(f"time {how} at row {row}: {time[row - 1]:.6g} s, then {time[row]:.6g} s", file=file)


def _check_finite(name: str, values: Array, time: Array, file: Path) -> None:
    bad = ~np.isfinite(values)
    if bad.any():
        row = int(np.argmax(bad))
        raise InputError(
            f"column {name!r} is not finite at row {row} (t = {time[row]:.6g} s): {values[row]} "
            f"({int(bad.sum())} such rows)",
            file=file,
        )


def _build(folder: Path, header: Header, columns: dict[str, Array]) -> Recording:
    def series(quantity: str) -> Array | None:
        channel = header.channels.get(quantity)
        return None if channel is None else columns[channel.column]

    a, saturated_a = _pressure(header.channels.get("pressure_a"), series("pressure_a"))
    b, saturated_b = _pressure(header.channels.get("pressure_b"), series("pressure_b"))
    time, position = series("time"), series("position")
    assert time is not None and position is not None
    n = len(time)
    reference: Array | None = None
    if header.reference_force is not None:
        column = header.reference_force.column
        reference = columns[column] if header.reference_force.kind == "load-cell" and column else np.zeros(n)
    never = np.zeros(n, dtype=np.bool_)
    return Recording(
        name=folder.resolve().name,
        folder=folder,
        header=header,
        time_s=time,
        position_m=position,
        valve_command=series("valve_command"),
        pressure_a_pa=a,
        pressure_b_pa=b,
        supply_pressure_pa=series("supply_pressure"),
        oil_temperature_degc=series("oil_temperature"),
        actuator_force_n=series("actuator_force"),
        reference_force_n=reference,
        saturated_a=never if saturated_a is None else saturated_a,
        saturated_b=never if saturated_b is None else saturated_b,
    )


def _pressure(channel: Channel | None, raw: Array | None) -> tuple[Array | None, Mask | None]:
    """Pressure in Pa through its calibration, and where the sensor is at the end of its range."""
    if channel is None or raw is None:
        return None, None
    c = channel.calibration
    pressure = raw if c is None else c.k_pa_per_v * (c.a * raw + c.b)
    if channel.range_pa is None:
        return pressure, None
    low, high = channel.range_pa
    # The clip happens before the voltage is rounded to the converter's step: 0.1 % of the range is tolerance.
    margin = 1e-3 * (high - low)
    at_end = pressure >= high - margin
    if low != 0.0:
        at_end |= pressure <= low + margin
    return pressure, at_end
