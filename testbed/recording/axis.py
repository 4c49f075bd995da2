"""A recording of one hydraulic axis: `recording.yaml` + its table, read into checked SI channels.

A rig is a folder with `identify/<name>/` and `verify/<name>/`, each a recording.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path

import numpy as np

from testbed.errors import InputError
from testbed.formats.arrays import Array, Flags
from testbed.formats.files import check_links
from testbed.formats.table import read_columns
from testbed.formats.units import to_si
from testbed.recording.axis_header import RECORDING, Header, read_header
from testbed.recording.checks import check_finite, check_span, check_time, in_pa, pressure
from testbed.recording.known import Known
from testbed.recording.quantities import quantities_of

FINEST_COUNT_M = 1e-7
"""Steps below this are a continuous signal's, not an encoder's."""

RIG = "a folder with identify/<name>/ and verify/<name>/, each a recording"

SAME = tuple(Known.model_fields)
"""What is declared of a rig: one model is fitted to all of its recordings, so that a number of one
of them alone would have no effect.
"""


@dataclass(frozen=True, eq=False)
class Recording:
    """One recording, SI, one row a sample, length n everywhere; a channel that was not recorded is
    None.

    Pressures are gauge, through their calibration. `saturated_*` marks samples at the end of a
    sensor's range. `reference_force_n` is the true external force (0 with the foot in the air),
    None where nobody knows it.
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
    saturated_a: Flags
    saturated_b: Flags
    extra: Mapping[str, Array] = field(default_factory=dict)
    """What rides along (a current, a temperature), SI, by the name that the header gives it."""
    began_s: float | None = None
    """Of a stretch: the first time of the recording that it is of; None: its own."""

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
        """The encoder's step; where it is not declared, the smallest step seen (0 if
        continuous).
        """
        declared = self.header.channels["position"].resolution
        if declared is not None:
            return declared
        steps = np.abs(np.diff(np.unique(self.position_m)))
        return float(steps.min()) if steps.size and steps.min() > FINEST_COUNT_M else 0.0

    def known_force_n(self) -> Array:
        """The true external force (n,). Raises InputError where the recording does not declare
        it.
        """
        if self.reference_force_n is None:
            raise InputError(
                "the external force is not known",
                file=self.folder / "recording.yaml",
                field="reference_force",
                allowed="kind: foot-in-air, free (it is 0 N) or load-cell (its column)",
            )
        return self.reference_force_n

    def part(self, rows: slice, name: str) -> Recording:
        """A stretch of it."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        cut = {key: value[rows] for key, value in values.items() if isinstance(value, np.ndarray)}
        extra = {key: value[rows] for key, value in self.extra.items()}
        began_s = float(self.time_s[0]) if self.began_s is None else self.began_s
        return replace(self, **cut, extra=extra, name=name, began_s=began_s)  # type: ignore[arg-type]

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
    """Read and check one recording folder (or its recording.yaml). Every fault is an InputError,
    one line.
    """
    folder = recording_folder(folder)
    file = folder / "recording.yaml"
    header = read_header(file)
    wanted = {channel.column: f"channels.{key}.column" for key, channel in header.channels.items()}
    reference = header.reference_force
    if reference is not None and reference.column is not None:
        wanted[reference.column] = "reference_force.column"
    data = folder / header.data
    columns = _in_si(header, read_columns(data, wanted, file), file)
    header = header.in_si()
    at, position = header.channels["time"].column, header.channels["position"]
    check_time(columns[at], header.sample_rate_hz, data, file, at)
    for name, values in columns.items():
        check_finite(name, values, columns[at], data)
    check_span(
        "channels.position.unit",
        position.unit,
        columns[position.column],
        header.known.stroke_m,
        file,
    )
    return _build(folder, header, columns)


def recording_folder(place: str | Path) -> Path:
    """The folder of a recording, given it or its recording.yaml. Raises InputError where there is
    no such folder.
    """
    folder = Path(place)
    folder = folder.parent if folder.name == "recording.yaml" else folder
    if not folder.is_dir():
        problem = "is not a folder" if folder.exists() else "no such folder"
        raise InputError(problem, file=folder, allowed=RECORDING)
    if not (folder / "recording.yaml").is_file():
        raise InputError("no such file", file=folder / "recording.yaml", allowed=RECORDING)
    return check_links(folder)


def read_rig(folder: str | Path, allowed: str = RIG, judged: bool = True) -> Rig:
    """Read a rig folder with `identify/` and `verify/`; `allowed`: what is said where it is none.

    `judged`: false where nothing is judged on `verify/`, which may then be missing. Raises
    InputError where one of them is missing or empty, and for recordings of different machines.
    """
    folder = Path(folder)
    if not folder.is_dir():
        problem = "is not a folder" if folder.exists() else "no such folder"
        raise InputError(problem, file=folder, allowed=allowed)
    if (folder / "identify").is_dir():
        check_links(folder)
    parts: dict[str, tuple[Recording, ...]] = {}
    for part in ("identify", "verify"):
        if part == "verify" and not judged and not (folder / part).is_dir():
            parts[part] = ()
            continue
        if not (folder / part).is_dir():
            raise InputError(
                f"has no folder {part!r}",
                file=folder,
                allowed=allowed,
            )
        names = sorted(path for path in (folder / part).iterdir() if path.is_dir())
        if not names:
            raise InputError("holds no recording", file=folder / part)
        parts[part] = tuple(read_recording(name) for name in names)
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
        check_same_machine(rig.identify[0], other)
    return rig


def check_same_machine(first: Recording, other: Recording, names: Sequence[str] = SAME) -> None:
    """Refuse a recording of another machine than the first one's: one of the declared `names`
    differs.
    """
    for name in names:
        mine, theirs = getattr(first.known, name), getattr(other.known, name)
        if mine != theirs:
            raise InputError(
                f"is another rig than {first.folder}",
                file=other.folder / "recording.yaml",
                field=f"known.{name}",
                value="nothing" if theirs is None else theirs,
                allowed=f"{'nothing' if mine is None else mine}, or a rig of its own",
            )


def _in_si(header: Header, columns: dict[str, Array], file: Path) -> dict[str, Array]:
    """The columns in SI. Raises InputError where two channels read one column in different
    units.
    """
    units: dict[str, str] = {}
    uses = [(channel.column, channel.unit) for channel in header.channels.values()]
    reference = header.reference_force
    if reference is not None and reference.column is not None:
        uses.append((reference.column, reference.unit or "N"))
    for column, unit in uses:
        if units.setdefault(column, unit) != unit:
            raise InputError(
                f"column {column!r} cannot be in {units[column]} and in {unit}", file=file
            )
    return {column: to_si(values, units[column]) for column, values in columns.items()}


def _build(folder: Path, header: Header, columns: dict[str, Array]) -> Recording:
    known = quantities_of(header.rig)
    channels = {name: channel for name, channel in header.channels.items() if name in known}

    def series(quantity: str) -> Array | None:
        channel = channels.get(quantity)
        return None if channel is None else columns[channel.column]

    time, position, data = series("time"), series("position"), folder / header.data
    assert time is not None and position is not None
    pressure_a, saturated_a = pressure(channels.get("pressure_a"), series("pressure_a"), time, data)
    pressure_b, saturated_b = pressure(channels.get("pressure_b"), series("pressure_b"), time, data)
    rows = len(time)
    reference: Array | None = None
    if header.reference_force is not None:
        column = header.reference_force.column
        reference = (
            columns[column]
            if header.reference_force.kind == "load-cell" and column
            else np.zeros(rows)
        )
    never = np.zeros(rows, dtype=np.bool_)
    return Recording(
        name=folder.resolve().name,
        folder=folder,
        header=header,
        time_s=time,
        position_m=position,
        valve_command=series("valve_command"),
        pressure_a_pa=pressure_a,
        pressure_b_pa=pressure_b,
        supply_pressure_pa=series("supply_pressure"),
        oil_temperature_degc=series("oil_temperature"),
        actuator_force_n=series("actuator_force"),
        reference_force_n=reference,
        saturated_a=never if saturated_a is None else saturated_a,
        saturated_b=never if saturated_b is None else saturated_b,
        extra={
            name: in_pa(channel, columns[channel.column])
            for name, channel in header.channels.items()
            if name not in channels
        },
    )
