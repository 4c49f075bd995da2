"""The feet of any recording: their forces, their own scale, and what there is to score a contact
state against.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.errors import InputError, naming
from testbed.estimation.contact_losses import LossRule, nominal_load_n
from testbed.formats.arrays import Array, Flags
from testbed.formats.table import read_columns
from testbed.formats.units import convertible, to_si
from testbed.machine.names import LEGS
from testbed.recording.axis import recording_folder
from testbed.recording.axis_header import AnyHeader, Header, read_header
from testbed.recording.checks import check_finite
from testbed.recording.foot import FootHeader, as_contact, read_foot
from testbed.workflows.own_files import header_of

FOOT = "foot"
"""What the one foot of a rig is called."""


@dataclass(frozen=True, eq=False)
class Estimated:
    """A robot's rows (n,) of DataRow with every estimate, and what they came from: a ChainBelief,
    (1,).
    """

    rows: npt.NDArray[Any]
    belief: npt.NDArray[Any]


@dataclass(frozen=True, eq=False)
class RecordedFeet:
    """The feet of a recording, by name; n rows, forces in N, + pressed on the ground."""

    folder: Path
    """Of the recording."""
    time_s: Array
    """(n,)"""
    force_n: Mapping[str, Array]
    """Foot -> estimated or measured force (n,)."""
    force_from: str
    """Where that comes from, in words."""
    nominal_load_n: float | None = None
    """A quarter of the machine's weight, or what is declared; None: nobody says."""
    nominal_load_from: str = "declared"
    """Where that comes from, in words."""
    breakaway_n: float | None = None
    """Declared; None: nobody has."""
    reference: Mapping[str, Array] = field(default_factory=dict)
    """Foot -> measured force (n,) to be scored against; empty: there is none."""
    reference_from: str | None = None
    """Where that comes from, in words."""
    robot: Estimated | None = None
    """Where the estimates of a whole robot are at hand."""


def read_feet(
    place: str | Path,
    force: str | None = None,
    reference: str | None = None,
    model: str | Path | None = None,
) -> RecordedFeet:
    """The feet of a recording of any rig.

    `force`, `reference`: columns of its table instead of what the rig offers; of a robot a column
    of one foot, or the part before `_<leg>` for all. `model`: what a force is estimated with from
    pressures. Raises InputError for what cannot be used.
    """
    folder = recording_folder(place)
    rig = header_of(folder).get("rig")
    if model is not None and (rig == FOOT or force is not None):
        raise InputError(
            "estimates nothing: the force is in the recording",
            field="--model",
            value=str(model),
            allowed="a leg or a robot, without --force",
        )
    if rig == "robot":
        return _of_robot(folder, force, reference, model)
    if rig == FOOT:
        return _of_foot(folder, force, reference)
    return _of_axis(folder, force, reference, model)


def _of_foot(folder: Path, force: str | None, reference: str | None) -> RecordedFeet:
    read = read_foot(folder, missing=True)
    column = _column_of(folder, read.header, read.time_s)
    known, contact = read.header.known, read.contact
    against: dict[str, Array] = {}
    reference_name = reference
    if reference is not None:
        against, reference_name = {FOOT: column(reference, "--reference")}, reference
    elif contact is not None:
        against, reference_name = {FOOT: contact.astype(np.float64)}, "channel contact"
    elif read.reference_n is not None:
        against, reference_name = {FOOT: read.reference_n}, "reference_force"
    return RecordedFeet(
        folder,
        read.time_s,
        {FOOT: read.force_n if force is None else column(force, "--force")},
        force or "channel force",
        known.nominal_load_n,
        "declared",
        known.breakaway_n,
        against,
        reference_name,
    )


def _of_axis(
    folder: Path, force: str | None, reference: str | None, model: str | Path | None
) -> RecordedFeet:
    from testbed.recording.axis import read_recording
    from testbed.workflows.estimate import leg_force

    read = read_recording(folder)
    # the header as it was written: the one that was read is in SI already
    column = _column_of(folder, read_header(folder / "recording.yaml"), read.time_s)
    breakaway = None
    if force is not None:
        load, said = column(force, "--force"), force
    else:
        load, breakaway, said = leg_force(read, model)
    against: dict[str, Array] = {}
    reference_name = reference
    if reference is not None:
        against = {FOOT: column(reference, "--reference")}
    elif read.reference_force_n is not None:
        against, reference_name = {FOOT: read.reference_force_n}, "reference_force"
    return RecordedFeet(
        folder, read.time_s, {FOOT: load}, said, None, "", breakaway, against, reference_name
    )


def _of_robot(
    folder: Path, force: str | None, reference: str | None, model: str | Path | None
) -> RecordedFeet:
    from testbed.estimation.detectors.foot_scale import believed_breakaway_n
    from testbed.estimation.live.chain import belief_of
    from testbed.estimation.live.joined import replay_rows
    from testbed.recording.robot import read_robot
    from testbed.workflows.estimate import robot_belief

    run = read_robot(folder)
    column = _column_of(folder, run.header, run.data["t"])
    rows = None
    if force is not None:
        loads = {leg: column(name, "--force") for leg, name in _by_leg(force).items()}
    else:
        belief = robot_belief(run, model)
        with naming(run.file):
            rows = replay_rows(run.data, belief)
        own = rows["estimate"]["own"]
        loads = {leg: np.ascontiguousarray(own[:, index]) for index, leg in enumerate(LEGS)}
    against = {
        leg: column(name, "--reference")
        for leg, name in (_by_leg(reference) if reference else {}).items()
    }
    return RecordedFeet(
        folder,
        run.data["t"],
        loads,
        force or "the whole-body estimate from the pressures",
        nominal_load_n(run.machine),
        "a quarter of the believed weight",
        believed_breakaway_n(run.machine),
        against,
        reference,
        None if rows is None else Estimated(rows, belief_of(belief)),
    )


def _by_leg(name: str) -> dict[str, str]:
    """Leg -> column: of one leg where the name ends in it, else of all four."""
    stem, _, leg = name.rpartition("_")
    return {leg: name} if stem and leg in LEGS else {leg: f"{name}_{leg}" for leg in LEGS}


def _column_of(folder: Path, header: AnyHeader, time_s: Array) -> Callable[[str, str], Array]:
    """A function (column, field it was named in) -> its values (n,), SI where the header declares
    its unit.

    `header`: as it was written. What the table lacks is looked for in `truth.parquet` beside it.
    Numbers may be missing in a force alone.
    """
    units = _declared_units(header)
    file, truth = folder / header.data, folder / "truth.parquet"

    def column(name: str, field: str) -> Array:
        try:
            found = read_columns(file, {name: field}, file)[name]
        except InputError:
            if not truth.exists():
                raise
            found = read_columns(truth, {name: field}, truth)[name]
        if len(found) != len(time_s):
            raise InputError(
                f"has {len(found)} rows, the recording {len(time_s)}", field=field, value=name
            )
        if field == "--reference":
            check_finite(name, found, time_s, file)
        elif not np.isfinite(found).any():
            raise InputError("holds no number", file=file, field=field, value=name)
        is_contact = field == "--reference" and len(np.unique(found)) <= 2
        if units.get(name, "N") not in convertible("N") and not is_contact:
            raise InputError(
                f"is in {units[name]}, which is no force",
                file=folder / "recording.yaml",
                field=field,
                value=name,
                allowed=" or ".join(convertible("N")),
            )
        return np.asarray(to_si(found, units[name])) if name in units else found

    return column


def _declared_units(header: AnyHeader) -> dict[str, str]:
    """Column -> unit, of the channels and of the reference force."""
    units = {channel.column: channel.unit for channel in header.channels.values()}
    cell = header.reference_force if isinstance(header, Header | FootHeader) else None
    if cell is not None and cell.column is not None and cell.unit is not None:
        units.setdefault(cell.column, cell.unit)
    return units


def carrying_of(reference: Array, time_s: Array, rule: LossRule, file: Path) -> Flags:
    """Whether the foot carries, (n,), by a contact channel (at most two distinct values) or a
    measured force, N.
    """
    if len(np.unique(reference)) <= 2:
        return rule.settled(as_contact(reference, file, "of the reference", "--reference"), time_s)
    return rule.carrying(reference, time_s)
