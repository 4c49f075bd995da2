"""`testbed check`: what is wrong with a recording, or that nothing is."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from testbed.errors import InputError
from testbed.machine.urdf_check import read_urdf
from testbed.recording.axis import read_recording
from testbed.recording.axis_header import Header
from testbed.recording.checker.balance import (
    check_balance,
    check_reference,
)
from testbed.recording.checker.clock import OTHER_UNIT, check_clock, rising
from testbed.recording.checker.finding import Checked, Finding, sorted_findings
from testbed.recording.checker.flow import check_flow
from testbed.recording.checker.foot_force import check_foot
from testbed.recording.checker.forces import Forces
from testbed.recording.checker.gains import check_gains
from testbed.recording.checker.inertia import check_inertia
from testbed.recording.checker.late import check_late
from testbed.recording.checker.motion import even
from testbed.recording.checker.raw import REFERENCE, Raw, read_raw
from testbed.recording.checker.resolution import check_resolution
from testbed.recording.checker.sensors import (
    check_clipped,
    check_frozen,
    check_numbers,
    check_ranges,
    readable,
)
from testbed.recording.checker.spikes import check_spikes
from testbed.recording.checker.supply import check_pressures
from testbed.recording.checker.whole_robot import check_robot
from testbed.recording.checks import LONGEST_M, MINIMUM_SAMPLES
from testbed.recording.foot import FootHeader, read_foot
from testbed.recording.known import Known
from testbed.recording.quantities import quantities_of
from testbed.recording.robot import read_robot

STEEL_KG_M3, OF_STEEL = 7850.0, 0.1
"""Density of a rod, and the share of a solid one's weight that no moving mass stays below."""
BEYOND_STROKE = 1.05
"""Share of a declared stroke that a position may span."""


def check_recording(place: str | Path) -> Checked:
    """Check a recording of any rig. Raises InputError only where there is no recording to look
    at.
    """
    folder = Path(place)
    try:
        raw = read_raw(folder)
    except InputError as error:
        if not (folder / "recording.yaml").is_file() and folder.name != "recording.yaml":
            raise
        return Checked(folder.resolve().name, (_refused(error),))
    found = list(check_clock(raw))
    if len(raw.time_s) >= MINIMUM_SAMPLES and all(f.what != OTHER_UNIT for f in found):
        found += _values(raw)
    if all(finding.severity != "error" for finding in found):
        found += _as_a_reader(raw, folder)
    return Checked(raw.name, sorted_findings(found))


def _refused(error: InputError) -> Finding:
    allowed = f"allowed: {error.allowed}" if error.allowed else "put it right"
    problem = " ".join(error.problem.split())
    return Finding("error", error.field or "recording", problem, str(error), allowed)


def _as_a_reader(raw: Raw, folder: Path) -> Iterator[Finding]:
    """What the reader itself refuses, where nothing else was found."""
    read: Callable[[Path], object] = read_recording
    if raw.rig in ("foot", "robot"):
        read = partial(read_foot, missing=True) if raw.rig == "foot" else read_robot
    try:
        read(folder)
        if raw.machine is not None:
            read_urdf(raw.machine.urdf)
    except InputError as error:
        yield _refused(error)


def _values(raw: Raw) -> Iterator[Finding]:
    """Everything but the clock; rows that have no time or no value are left out first."""
    numbers = list(check_numbers(raw))
    yield from numbers
    rows = rising(raw.time_s)
    filled = {}
    for name, values in raw.series.items():
        good = readable(values) & np.isfinite(raw.time_s)
        if not good.all() and good.sum() > 1:
            filled[name] = np.interp(raw.time_s, raw.time_s[good], values[good])
        elif not good.any():
            filled[name] = np.zeros_like(values)
    raw = raw.kept(rows, filled)
    if len(raw.time_s) < MINIMUM_SAMPLES:
        return
    for finding, there in list(check_spikes(raw)):
        yield finding
        values = raw.series[finding.channel]
        calm = np.interp(raw.time_s, raw.time_s[~there], values[~there])
        raw = raw.kept(np.ones_like(there), {finding.channel: calm})
    whole = {
        key: value
        for key, value in raw.series.items()
        if not any(_is_empty(number, key) for number in numbers)
    }
    declared = {key: step for key, step in raw.resolutions.items() if key in whole}
    raw = replace(raw, series=whole, resolutions=declared)
    for check in (check_ranges, check_clipped, check_frozen, check_resolution):
        yield from check(raw)
    if raw.machine is not None:
        yield from check_robot(raw)
    elif isinstance(raw.header, FootHeader) and "force" in raw.series:
        yield from check_foot(raw, raw.header)
    elif isinstance(raw.header, Header):
        yield from _axis(raw, raw.header)


def _is_empty(finding: Finding, name: str) -> bool:
    return finding.channel == name and finding.what == "holds no number at all"


def _axis(raw: Raw, header: Header) -> Iterator[Finding]:
    names = {
        "pressure_a": "pressure_a",
        "pressure_b": "pressure_b",
        "force": "actuator_force",
        "reference": REFERENCE,
        "command": "valve_command",
    }
    known, taken = header.known, (*quantities_of(header.rig), REFERENCE)
    raw = replace(raw, series={name: raw.series[name] for name in taken if name in raw.series})
    yield from _missing(header)
    yield from _mass(known)
    yield from check_pressures(raw, known, "pressure_a", "pressure_b")
    if "position" not in raw.series:
        return
    beyond = list(_stroke(raw, known))
    yield from beyond
    if any(finding.severity == "error" for finding in beyond):
        return  # speeds and accelerations say nothing then
    axis = even(raw, names)
    yield from _signs(raw, Forces(axis, known), names)


def _signs(raw: Raw, forces: Forces, names: dict[str, str]) -> Iterator[Finding]:
    """Balance of forces, then the valve; a position turned round is said once."""
    known = forces.known
    balance: list[Finding] = []
    drive = "pressure_a" not in forces.even.series and "force" in forces.even.series
    knows_load = "reference" in forces.even.series or (
        isinstance(raw.header, Header)
        and raw.header.reference_force is not None
        and raw.header.reference_force.kind != "load-cell"
    )
    if knows_load and (drive or "pressure_a" in forces.even.series):
        balance = list(check_balance(forces, names))
    scales = list(check_inertia(forces, names)) if knows_load else []
    if scales and all(_of_inertia(finding) for finding in balance):
        balance = []  # which of force, way and mass is wrong is told by what it weighs, too
    yield from balance or scales
    if not balance and not scales:
        scaled = list(check_reference(forces, names["reference"]))
        late = scaled or (check_late(forces, names) if knows_load else [])
        yield from late or ([] if drive else check_gains(forces, names))
    turned = any("position" in f.channel and "turned" in f.what for f in balance)
    wrong_pressure = any(f.channel.startswith("pressure") for f in balance)
    for finding in check_flow(forces.even, known, names["command"]):
        if not (turned and "turned" in finding.what) and not (
            wrong_pressure and "scale" in finding.what
        ):
            yield finding


def _of_inertia(finding: Finding) -> bool:
    """Whether a finding of the balance is of a scale on which what the mass needs depends."""
    scaled = any(word in finding.what for word in ("scale", "too small", "too large", "hardly"))
    return scaled and finding.channel in ("known.moving_mass_kg", "position", "actuator_force")


def _missing(header: Header) -> Iterator[Finding]:
    """What is not recorded or declared, and what cannot be said without it."""
    hydraulic = header.rig != "drive"
    if header.rig == "vertical-leg" and "pressure_b" not in header.channels:
        yield Finding(
            "warning",
            "pressure_b",
            "is not recorded",
            "the balance of a vertical leg needs both chambers",
            "record it; calibrate, identify and estimate refuse without it",
        )
    if header.reference_force is None:
        yield Finding(
            "note",
            REFERENCE,
            "is not declared",
            "the true external force is not known",
            "good to estimate on; to identify or diagnose, declare free, foot-in-air or a load-cell",
        )
    if hydraulic and "valve_command" not in header.channels:
        yield Finding(
            "note",
            "valve_command",
            "is not recorded",
            "no flow balance",
            "effects of valve, oil and supply cannot be seen",
        )
    for name in header.channels:
        if name not in quantities_of(header.rig):
            yield Finding(
                "note",
                name,
                "rides along",
                "no law uses it",
                "nothing to do, unless it is a misspelt quantity (testbed recording-schema)",
            )


def _mass(known: Known) -> Iterator[Finding]:
    """A moving mass that its own rod would outweigh by far; 0 is one that is left out."""
    if not known.moving_mass_kg or not known.rod_m or not known.stroke_m:
        return
    rod_kg = 0.25 * np.pi * known.rod_m**2 * known.stroke_m * STEEL_KG_M3
    if known.moving_mass_kg < OF_STEEL * rod_kg:
        yield Finding(
            "warning",
            "known.moving_mass_kg",
            "is less than its rod weighs",
            f"{known.moving_mass_kg:.4g} kg declared, a steel rod alone {rod_kg:.3g} kg",
            "declare it in kg (t?), or null where nobody knows it",
        )


def _stroke(raw: Raw, known: Known) -> Iterator[Finding]:
    """Positions that span more than the stroke, or nothing that a cylinder could be."""
    position = raw.series["position"]
    span, stroke = float(np.ptp(position)), known.stroke_m
    if span > LONGEST_M or (stroke is not None and span > BEYOND_STROKE * stroke):
        large = stroke is None or span > 2.0 * stroke
        yield Finding(
            "error" if large else "warning",
            "position",
            "spans more than the stroke",
            f"{span:.4g} m" + (f", stroke {stroke:g} m" if stroke else ""),
            "declare unit mm if the column is in it, or put the stroke right",
        )
    if span == 0.0:
        yield Finding(
            "warning",
            "position",
            "never changes",
            f"{position[0]:.6g} m in all rows",
            "good for a leg that is pressed on a load cell; shows nothing about friction",
        )
