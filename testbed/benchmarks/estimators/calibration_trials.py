"""Simulated calibrations: a leg that presses on a load cell while it moves to and fro, with known a
and b.

What is unknown is drawn from what the calibration expects beforehand (its priors), so that its 95 %
regions ought to hold the truth in 95 of 100 trials.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from testbed.benchmarks.estimators.identification_trials import (
    KNOWN,
    PRESSURE_NOISE_PA,
    RATE_HZ,
    frame_force,
    friction_force,
    random_friction,
    recording_of,
)
from testbed.estimation.calibration import (
    A_SD,
    ASYMMETRY,
    B_SD_V,
    LOAD_SD,
    PRESSURE_SD_M2,
    Calibrated,
    calibrate,
)
from testbed.formats.arrays import Array
from testbed.recording.axis import Recording

K_PA_PER_V = 2.0e6
CONVERTER_V = 5.0 / 4096.0
REGION_95 = 5.991464547
"""95 % quantile of chi-square with two degrees of freedom: the region of (a, b)."""


def press_recording(seed: int, seconds: float = 15.0) -> tuple[Recording, Array]:
    """(recording, true (a, b) of A and B (2, 2)): 1 to 13 kN on the load cell, outliers in one
    sample of a thousand.
    """
    rng = np.random.default_rng([3, seed])
    time_s = np.arange(0.0, seconds, 1.0 / RATE_HZ)
    pace = 2.0 * np.pi * rng.uniform(0.15, 0.25)
    velocity_m_s = 0.010 * pace * np.cos(pace * time_s) + 0.004 * np.cos(3.1 * pace * time_s)
    position_m = 0.2 + np.cumsum(velocity_m_s) / RATE_HZ - 0.5 * velocity_m_s / RATE_HZ
    load = 7000.0 + 6000.0 * np.sin(2.0 * np.pi * 0.07 * time_s + rng.uniform(0.0, 6.0))
    pb = 2.5e6 + 1.0e6 * np.sin(2.0 * np.pi * 0.11 * time_s + rng.uniform(0.0, 6.0))
    pa = _pressure_a(rng, velocity_m_s, load, pb)
    true = np.column_stack([1.0 + A_SD * rng.standard_normal(2), B_SD_V * rng.standard_normal(2)])
    channels = [
        _through_sensor(pressure, ab, rng) for pressure, ab in zip((pa, pb), true, strict=True)
    ]
    reference = np.round((load + rng.normal(0.0, 1.7, time_s.size)) / 10.0) * 10.0
    recording = recording_of(
        time_s, position_m, channels[0], channels[1], reference, KNOWN, "load-cell"
    )
    return replace(recording, name=f"press-{seed}"), true


def _pressure_a(rng: np.random.Generator, velocity_m_s: Array, load: Array, pb: Array) -> Array:
    """PA (n,) that balances load, frame, pB and friction: (5) with a shift delta, and parts from
    load and pressures.
    """
    friction = random_friction(rng)
    level = 0.5 * (friction.coulomb_plus_n + friction.coulomb_minus_n)
    even = friction.model_copy(update={"coulomb_plus_n": level, "coulomb_minus_n": level})
    of_load, of_pressure = (
        abs(LOAD_SD * rng.standard_normal()),
        abs(PRESSURE_SD_M2 * rng.standard_normal()),
    )
    rest = friction_force(even, velocity_m_s) + ASYMMETRY * level * rng.standard_normal()
    rest += load + frame_force(velocity_m_s, KNOWN) + pb * KNOWN.area_b_m2
    sign = np.sign(velocity_m_s)
    # pA stands on both sides: pA A_A = rest + sign (of_load load + of_pressure (pA + pB))
    pa = (rest + sign * (of_load * load + of_pressure * pb)) / (
        KNOWN.area_a_m2 - sign * of_pressure
    )
    return pa


def _through_sensor(pressure: Array, ab: Array, rng: np.random.Generator) -> Array:
    """What a sensor with these a, b reads of a pressure; Pa at nominal a = 1 and b = 0."""
    noisy = pressure + rng.normal(0.0, PRESSURE_NOISE_PA, pressure.size)
    volts = np.round((noisy / K_PA_PER_V - ab[1]) / ab[0] / CONVERTER_V) * CONVERTER_V
    glitch = rng.random(pressure.size) < 1e-3
    volts[glitch] += rng.uniform(-1.0, 1.0, int(glitch.sum()))
    return np.asarray(K_PA_PER_V * volts)


def inside(result: Calibrated, true: Array) -> list[bool]:
    """Whether each sensor's 95 % region holds the true (a, b)."""
    out = []
    for sensor, ab in zip(result.sensors.values(), true, strict=True):
        error = np.array([sensor.a, sensor.b]) - ab
        out.append(bool(error @ np.linalg.solve(sensor.covariance, error) <= REGION_95))
    return out


def coverage(trials: int) -> NDArray[np.int64]:
    """How many of `trials` regions hold the truth, per sensor (2,)."""
    held = [
        inside(calibrate([recording]), true)
        for recording, true in map(press_recording, range(trials))
    ]
    return np.asarray(np.sum(held, axis=0), dtype=np.int64)
