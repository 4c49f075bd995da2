"""What further experiment would tell two hypotheses apart, and that motion as a table."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from testbed.formats.table import write_columns
from testbed.recording.known import Known

TELLS: dict[str, str] = {
    "friction.position": "slow strokes over the whole travel at two speeds, both ways",
    "friction.pressure": "the same strokes at two supply pressures",
    "friction.load": "press on the load cell at rising loads and slide a few millimetres under each",
    "friction.presliding": "small sinusoids of 0.2 to 2 mm about several places",
    "friction.temperature": "the same constant-speed strokes with cold and with warm oil",
    "inertia.mass": "fast sinusoids of a few millimetres in the air, at least 3 m/s2",
    "force.spring": "stops along the whole travel, approached from both sides",
    "force.periodic": "a long, slow stroke with nothing else running, then with each auxiliary switched on",
    "force.cushion": "slow strokes into the lower quarter of the travel, both ways",
    "sensor.gain_a": "press at rising loads with chamber B at tank pressure",
    "sensor.gain_b": "retract against rising loads with chamber A at tank pressure",
    "sensor.drift_a": "ten minutes of the same slow sinusoid",
    "sensor.line_b": "sharp steps of the valve against a held piston, then slow ramps",
    "sensor.delay": "fast reversals at several speeds",
    "leakage.internal": "hold a load with the valve shut and watch the piston sink",
    "hydraulics.air": "the same steps at low and at high pressure in both chambers",
    "hydraulics.hose": "steps of pressure in A with the piston held, then a minute of rest",
    "valve.deadband": "slow triangles of the valve command through zero",
    "supply.droop": "full-speed strokes after a rest, with the supply pressure recorded",
}


def experiments(names: Iterable[str]) -> list[tuple[str, str]]:
    """(name, the motion that shows it alone) for the names of an ambiguous group."""
    return [(name, TELLS[name]) for name in names if name in TELLS]


def write_motion(path: Path, known: Known, seconds: float = 60.0, rate_hz: float = 100.0) -> None:
    """A motion that parts most groups: slow strokes, small fast sinusoids and steps; columns `t` s, `position` m.

    Raises InputError for an ending other than .csv or .parquet, or a place that cannot be written.
    """
    stroke = known.stroke_m or 0.5
    t = np.arange(round(seconds * rate_hz)) / rate_hz
    phase = t / seconds
    slow = 0.5 + 0.3 * (2.0 / np.pi) * np.arcsin(np.sin(2.0 * np.pi * 3.0 * phase))
    fast = np.where(phase > 0.5, 0.006, 0.0) * np.sin(2.0 * np.pi * (1.0 + 3.0 * phase) * t)
    steps = 0.05 * np.sign(np.sin(2.0 * np.pi * t / 7.0)) * (phase < 0.25)
    write_columns(path, {"t": t, "position": stroke * np.clip(slow + steps, 0.1, 0.9) + fast})
