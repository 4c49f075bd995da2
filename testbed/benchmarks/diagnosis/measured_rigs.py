"""Identification, and diagnosis, judged on really measured rigs: relative force error on recordings
kept back.

A cylinder with a load cell: error of the estimated force over the force, root mean squares, where
the piston moves.
A drive: the model's force from the position against the drive's, as the drive's own benchmark does
it (Janot, Gautier,
Brunot 2019): position and force through a Butterworth low-pass of order 4 at 100 Hz, to both sides;
every term and the force decimated by 25; the first 5 and the last 10 samples dropped. Decimating
needs its own low-pass: to pick every 25th sample folds the vibrations onto the motion; what comes
out then depends on the sample one begins with (5 to 10 %).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from testbed.benchmarks.harness import rms
from testbed.errors import InputError
from testbed.estimation.friction.identification import identify_rig
from testbed.estimation.leg.balance import MOVING_M_S
from testbed.estimation.leg.force import estimate
from testbed.estimation.leg.motion import signals_of
from testbed.formats.arrays import Array
from testbed.recording.axis import Recording, Rig, read_rig
from testbed.recording.leg_model import Friction, LegModel
from testbed.report.page import Table

CUT_HZ, ORDER, DECIMATED = 100.0, 4, 25
FIRST, LAST = 5, 10
SEAL_LIMIT, DRIVE_LIMIT = 0.006, 0.054
"""What is wanted of the identified model: at most, median of the seals; the drive."""
SEAL_AFTER, DRIVE_AFTER = 0.004, 0.032
"""What is wanted of the diagnosed model's estimate."""


@dataclass(frozen=True)
class Marked:
    """One recording of one rig: relative error of the identified model's force, and of the estimate
    that uses it.
    """

    rig: str
    kind: str
    recording: str
    relative_error: float
    by_estimate: float
    effects: tuple[str, ...] = ()
    """What the diagnosis added, where it was asked."""
    by_diagnosed: float | None = None
    """Relative error of the estimate that uses the diagnosed model."""


def mark(rig: Rig, diagnosed: bool = False) -> list[Marked]:
    """Identify on `identify` (and, `diagnosed`, find what the model lacks), judge on `verify`."""
    from testbed.diagnosis.leg.diagnose import diagnose

    model = identify_rig(rig).model
    found = diagnose(rig) if diagnosed else None
    out = []
    for recording in rig.verify:
        by_estimate = estimate_error(recording, model)
        own = drive_error(recording, model) if rig.kind == "drive" else by_estimate
        marked = Marked(rig.name, rig.kind, recording.name, own, by_estimate)
        if found is not None:
            names = tuple(entry.name for entry in found.entries)
            marked = replace(
                marked, effects=names, by_diagnosed=estimate_error(recording, found.models["after"])
            )
        out.append(marked)
    return out


def mark_all(folder: Path, diagnosed: bool = False) -> list[Marked]:
    """Every rig below `folder`. Raises InputError where there is none."""
    rigs = (
        sorted(path for path in folder.iterdir() if (path / "identify").is_dir())
        if folder.is_dir()
        else []
    )
    if not rigs:
        raise InputError("holds no rig", file=folder, allowed="folders with identify/ and verify/")
    return [found for path in rigs for found in mark(read_rig(path), diagnosed)]


def median_error(found: list[Marked], kind: str, diagnosed: bool = False) -> float:
    """Median relative error over the recordings of one kind of rig; `diagnosed`: with the diagnosed
    model.
    """
    return float(
        np.median(
            [
                rig.by_diagnosed if diagnosed else rig.relative_error
                for rig in found
                if rig.kind == kind
            ]
        )
    )


def estimate_error(recording: Recording, model: LegModel) -> float:
    """RMS error of the estimated external force over RMS force, where the piston moves."""
    signals = signals_of(recording, model.known)
    moving = np.abs(np.interp(recording.time_s, signals.time_s, signals.velocity_m_s)) > MOVING_M_S
    reference = recording.known_force_n()
    error = (estimate(recording, model).force_n - reference)[moving]
    force = recording.actuator_force_n if recording.actuator_force_n is not None else reference
    return rms(error) / rms(force[moving])


def drive_error(recording: Recording, model: LegModel) -> float:
    """RMS of the drive's force less the model's, over RMS of the drive's force; low-passed and
    decimated.
    """
    from scipy.signal import butter, decimate, filtfilt

    force = recording.actuator_force_n
    if force is None:
        raise InputError("is missing", file=recording.folder, field="channels.actuator_force")
    period = float(np.median(np.diff(recording.time_s)))
    b, a = butter(ORDER, CUT_HZ * 2.0 * period)
    position_m = filtfilt(b, a, recording.position_m)
    velocity_m_s = np.gradient(position_m, period)
    predicted = (model.known.moving_mass_kg or 0.0) * np.gradient(velocity_m_s, period) + friction(
        model.friction, velocity_m_s
    )
    predicted = predicted - model.force_offset_n

    def few(values: Array) -> Array:
        return np.asarray(decimate(filtfilt(b, a, values), DECIMATED)[FIRST:-LAST])

    return rms(few(force) - few(predicted)) / rms(few(force))


def friction(friction: Friction, v_m_s: Array) -> Array:
    """(5) at speeds (n,), N."""
    speed = np.abs(v_m_s)
    plus = friction.viscous_plus_n_s_m * speed + friction.coulomb_plus_n
    plus = plus + friction.stribeck_plus_n * np.exp(-speed / friction.stribeck_speed_plus_m_s)
    minus = friction.viscous_minus_n_s_m * speed + friction.coulomb_minus_n
    minus = minus + friction.stribeck_minus_n * np.exp(-speed / friction.stribeck_speed_minus_m_s)
    return np.where(v_m_s > 0.0, plus, np.where(v_m_s < 0.0, -minus, 0.0))


def table(found: list[Marked]) -> Table:
    """Relative errors in per cent."""
    heads = ["rig", "recording", "model's force, %", "estimate's, %"]
    rows = [
        [rig.rig, rig.recording, f"{100 * rig.relative_error:.2f}", f"{100 * rig.by_estimate:.2f}"]
        for rig in found
    ]
    diagnosed = any(rig.by_diagnosed is not None for rig in found)
    if diagnosed:
        heads += ["diagnosed, %", "with"]
        rows = [
            [*row, f"{100 * (rig.by_diagnosed or 0.0):.2f}", ", ".join(rig.effects) or "nothing"]
            for row, rig in zip(rows, found, strict=True)
        ]
    wanted = (
        ("cylinder", "seals, median", SEAL_LIMIT, SEAL_AFTER),
        ("drive", "drive", DRIVE_LIMIT, DRIVE_AFTER),
    )
    for kind, label, limit, after in wanted:
        if any(rig.kind == kind for rig in found):
            rows.append(
                [
                    label,
                    f"wanted: at most {100 * limit:.1f}",
                    f"{100 * median_error(found, kind):.2f}",
                    "",
                ]
            )
            if diagnosed:
                error = f"{100 * median_error(found, kind, diagnosed=True):.2f}"
                rows[-1] += [error, f"wanted: at most {100 * after:.1f}"]
    return Table("Relative force error on what was not identified on", heads, rows)
