"""Sensors, a pump and ropes of another kind than the simulator's, as a change of a recording's
columns.

Each kind gives column -> (n,) change of what was read, in the column's unit. What is the machine's
is drawn from `own`, which is the same for all its recordings; what comes and goes from `passing`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import butter, lfilter, lfilter_zi

from testbed.benchmarks.diagnosis.other_friction import elastic
from testbed.formats.arrays import Array
from testbed.machine.groups import Sensor
from testbed.machine.names import AXES, ROTATION, SIDES
from testbed.recording.rows import XYZ
from testbed.robot.robot import Robot

PRESSURES = tuple(f"pressure_{chamber}_{axis}" for axis in AXES for chamber in "ab")
TENSIONS = tuple(f"rope_tension_{side}" for side in SIDES)
SUPPLY = "supply_pressure"
UNSMOOTHED_S = 0.01
"""What a sensor's loop or play follows is its column smoothed over so long: the noise comes after
them.
"""
LOOPS = (0.25, 0.75, 1.25, 1.75)
"""Radii of the elements of a loop, of half its width: small motions make small loops."""
SLOWEST_HZ = 0.02
MOST_OF_NYQUIST = 0.9
"""A filter with a corner beyond this share of half the sampling rate filters nothing."""
TENSION_RANGE_N = 6.0e4
"""Of load pins (E)."""


@dataclass(frozen=True, eq=False)
class Recorded:
    """A recording that is to be changed: its columns, its robot as believed, random numbers, and
    how large what changes it is: loops, noise and counts times that, corners of filters by it.
    """

    data: Mapping[str, Array]
    robot: Robot
    own: np.random.Generator
    passing: np.random.Generator
    size: float = 1.0

    @property
    def sensor(self) -> Sensor:
        """As declared."""
        return self.robot.machine.sensor

    @property
    def time_s(self) -> Array:
        """(n,)"""
        return self.data["t"]

    @property
    def rate_hz(self) -> float:
        """Samples a second."""
        return 1.0 / float(np.median(np.diff(self.time_s)))

    def smoothed(self, column: str) -> Array:
        """A column (n,) without its noise."""
        width = UNSMOOTHED_S * self.rate_hz
        return np.asarray(gaussian_filter1d(self.data[column], width, mode="nearest"))


Changes = dict[str, Array]
Kind = Callable[[Recorded], Changes]


def flicker(count: int, rate_hz: float, exponent: float, rng: np.random.Generator) -> Array:
    """(count,) noise whose power falls with the frequency to this exponent, of unit standard
    deviation.
    """
    frequency = np.fft.rfftfreq(count, 1.0 / rate_hz)
    size = np.maximum(frequency, SLOWEST_HZ) ** (-0.5 * exponent)
    size[0] = 0.0
    white = rng.standard_normal(len(size)) + 1j * rng.standard_normal(len(size))
    made = np.fft.irfft(size * white, count)
    return np.asarray(made / np.std(made))


def coloured_noise(recorded: Recorded) -> Changes:
    """Flicker in pressures (0.01 to 0.04 % of their range), ropes, accelerometers and attitude."""
    own, count = recorded.own, len(recorded.time_s)
    exponent = own.uniform(0.7, 1.3)
    range_pa = recorded.sensor.pressure_range_pa
    size = {name: range_pa * own.uniform(1e-4, 4e-4) for name in (*PRESSURES, SUPPLY)}
    size |= {name: own.uniform(5.0, 20.0) for name in TENSIONS}
    size |= {f"specific_force_{k}": own.uniform(2e-3, 1e-2) for k in XYZ}
    size |= {f"attitude_{k}": own.uniform(5e-5, 2e-4) for k in ("roll", "pitch")}
    return {
        name: recorded.size * sd * flicker(count, recorded.rate_hz, exponent, recorded.passing)
        for name, sd in size.items()
        if name in recorded.data
    }


def coarse_counts(recorded: Recorded) -> Changes:
    """Converters of 11 or 12 bits that count from another zero, of pressures, supply and ropes."""
    range_pa, out = recorded.sensor.pressure_range_pa, {}
    for name in (*PRESSURES, SUPPLY, *TENSIONS):
        whole = TENSION_RANGE_N if name in TENSIONS else range_pa * (1 + (name == SUPPLY))
        count = recorded.size * whole / 2.0 ** recorded.own.integers(11, 13)
        first = count * recorded.own.random()
        values = recorded.data[name]
        out[name] = np.round((values - first) / count) * count + first - values
    return out


def hysteresis(recorded: Recorded) -> Changes:
    """Pressure sensors whose loop is 0.1 to 0.25 % of the range wide."""
    names = list(PRESSURES)
    share = recorded.size * recorded.own.uniform(1e-3, 2.5e-3, len(names))
    half_pa = 0.5 * recorded.sensor.pressure_range_pa * share
    read = np.column_stack([recorded.smoothed(name) for name in names])
    behind = [half_pa * r * elastic(read, half_pa * r) for r in LOOPS]
    return dict(zip(names, -np.mean(behind, axis=0).T, strict=True))


def hum(recorded: Recorded) -> Changes:
    """Mains at 50 Hz with two harmonics: 0.05 to 0.2 % of the pressures' range, 20 to 60 N."""
    own = recorded.own
    angle = 2.0 * np.pi * own.uniform(49.8, 50.2) * recorded.time_s + recorded.passing.uniform(0, 6)
    wave = np.sin(angle) + 0.3 * np.sin(2.0 * angle + 1.0) + 0.3 * np.sin(3.0 * angle + 2.0)
    range_pa = recorded.sensor.pressure_range_pa
    size = {name: range_pa * own.uniform(5e-4, 2e-3) for name in (*PRESSURES, SUPPLY)}
    size |= {name: own.uniform(20.0, 60.0) for name in TENSIONS}
    return {name: recorded.size * sd * wave for name, sd in size.items()}


def uneven_clock(recorded: Recorded) -> Changes:
    """Samples taken up to a sample late, each channel by its own, and jittering by 0.1 to 0.4."""
    late_s, time_s = recorded.size / recorded.rate_hz, recorded.time_s
    jitter = recorded.own.uniform(0.1, 0.4) * recorded.passing.standard_normal(len(time_s))
    names = (*PRESSURES, SUPPLY, *TENSIONS, *(f"position_{axis}" for axis in AXES))
    out = {}
    for name in names:
        taken_s = time_s - late_s * (recorded.own.random() + jitter)
        out[name] = np.interp(taken_s, time_s, recorded.data[name]) - recorded.data[name]
    return out


def other_filter(recorded: Recorded) -> Changes:
    """Another low-pass before all pressures' converters: first to fourth order, 40 to 200 Hz."""
    order = int(recorded.own.integers(1, 5))
    corner_hz = float(np.exp(recorded.own.uniform(*np.log([40.0, 200.0])))) / recorded.size
    if corner_hz > MOST_OF_NYQUIST * 0.5 * recorded.rate_hz:
        return {}
    b, a = butter(order, corner_hz, fs=recorded.rate_hz)
    out = {}
    for name in (*PRESSURES, SUPPLY):
        values = recorded.data[name]
        out[name] = lfilter(b, a, values, zi=lfilter_zi(b, a) * values[0])[0] - values
    return out


def encoders(recorded: Recorded) -> Changes:
    """Backlash of 0.1 mm and a wave of 0.02 to 0.06 mm every 2 to 10 mm, at the piston; in whole
    counts.
    """
    names = [f"position_{axis}" for axis in AXES]
    joints = np.column_stack([recorded.smoothed(name) for name in names])
    extension, arm = recorded.robot.linkages.rods(joints)
    own, count = recorded.own, len(names)
    play = 0.5e-4 * own.uniform(0.5, 1.5, count)
    pitch, phase = own.uniform(2e-3, 10e-3, count), own.uniform(0.0, 2.0 * np.pi, count)
    wave = own.uniform(2e-5, 6e-5, count) * np.sin(2.0 * np.pi * extension / pitch + phase)
    change = recorded.size * (wave - play * elastic(extension, play)) / np.abs(arm)
    sensor, out = recorded.sensor, {}
    turn = 2.0 * np.pi / sensor.encoder_counts_per_turn
    for k, name in enumerate(names):
        step = turn if k in ROTATION else sensor.encoder_linear_m
        counts = recorded.data[name] / step
        out[name] = step * (np.round(counts + change[:, k] / step) - np.round(counts))
    return out


def ripple(recorded: Recorded) -> Changes:
    """A pump's strokes: 0.3 to 1.5 bar at 150 to 300 Hz in the supply, a fifth of it in a chamber
    whose port is open.
    """
    own = recorded.own
    angle = 2.0 * np.pi * own.uniform(150.0, 300.0) * recorded.time_s
    size_pa = recorded.size * own.uniform(3e4, 1.5e5)
    wave = size_pa * np.sin(angle + recorded.passing.uniform(0.0, 6.0))
    out = {SUPPLY: wave}
    for axis in AXES:
        open_ = np.abs(recorded.data[f"valve_{axis}"]) > 0.03
        for chamber in "ab":
            out[f"pressure_{chamber}_{axis}"] = own.uniform(0.1, 0.3) * wave * open_
    return out


def rope_friction(recorded: Recorded) -> Changes:
    """Load pins that read up to 0.1 to 0.4 % of the pull more or less by friction beside them."""
    out = {}
    for name in TENSIONS:
        read = recorded.smoothed(name)[:, None]
        held = recorded.size * float(recorded.own.uniform(1e-3, 4e-3) * np.mean(read))
        out[name] = -held * elastic(read, 2.0 * held)[:, 0]
    return out


KINDS: Mapping[str, Kind] = {
    kind.__name__: kind
    for kind in (
        *(coloured_noise, coarse_counts, hysteresis, hum, uneven_clock, other_filter, encoders),
        *(ripple, rope_friction),
    )
}


def change_of(kind: str, recorded: Recorded) -> Changes:
    """Column -> (n,) by which it is another one with sensors of this kind; none where it has no
    size.
    """
    return KINDS[kind](recorded) if recorded.size > 0.0 else {}
