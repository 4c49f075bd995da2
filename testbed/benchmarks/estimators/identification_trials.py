"""Simulated identifications: a leg in the air with known friction, 0.1 mm encoder and noisy
pressures.

The motion is the paper's figure 8: constant speeds in both directions, joined by soft reversals.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from testbed.estimation.calibration import (
    A_SD,
    B_SD_V,
    LOAD_SD,
    PRESSURE_SD_M2,
    Calibrated,
)
from testbed.estimation.friction.declared_numbers import ASYMMETRY
from testbed.estimation.friction.identification import identify
from testbed.estimation.friction.posterior import curve
from testbed.formats.arrays import Array
from testbed.recording.axis import Recording
from testbed.recording.axis_header import Calibration, Channel, Header, ReferenceForce
from testbed.recording.known import Known
from testbed.recording.leg_model import Friction

RATE_HZ = 1000.0
PRESSURE_NOISE_PA = 8.0e3
PRESSURE_STEP_PA = 2441.4
RESOLUTION_M = 1e-4
SPEEDS_M_S = (0.002, 0.003, 0.005, 0.008, 0.012, 0.02, 0.035, 0.06, 0.1, 0.14)
UNSEEN_M_S = np.array([0.0025, 0.004, 0.0065, 0.010, 0.015, 0.027, 0.05, 0.08, 0.12])
"""Between the speeds of the motion: friction is predicted there."""
KNOWN = Known(bore_m=0.07, rod_m=0.04, stroke_m=0.5, moving_mass_kg=91.7, inclination_deg=0.0)


def random_friction(rng: np.random.Generator) -> Friction:
    """A plausible set of eight parameters: F_c 300-1500 N, F_s 100-500 N, c_s 3-20 mm/s, sigma 2-8
    kN s/m.
    """
    plus, minus = _side(rng), _side(rng)
    return Friction(
        viscous_plus_n_s_m=plus[0],
        coulomb_plus_n=plus[1],
        stribeck_plus_n=plus[2],
        stribeck_speed_plus_m_s=plus[3],
        viscous_minus_n_s_m=minus[0],
        coulomb_minus_n=minus[1],
        stribeck_minus_n=minus[2],
        stribeck_speed_minus_m_s=minus[3],
    )


def _side(rng: np.random.Generator) -> tuple[float, float, float, float]:
    return (
        rng.uniform(2e3, 8e3),
        rng.uniform(300.0, 1500.0),
        rng.uniform(100.0, 500.0),
        float(np.exp(rng.uniform(np.log(0.003), np.log(0.02)))),
    )


def eight(friction: Friction) -> Array:
    """The eight parameters of (5) in their order: sigma, F_c0, F_s0, c_s for extension, then for
    retraction.
    """
    f = friction
    return np.array(
        [
            f.viscous_plus_n_s_m,
            f.coulomb_plus_n,
            f.stribeck_plus_n,
            f.stribeck_speed_plus_m_s,
            f.viscous_minus_n_s_m,
            f.coulomb_minus_n,
            f.stribeck_minus_n,
            f.stribeck_speed_minus_m_s,
        ]
    )


def speed_profile(
    speeds_m_s: tuple[float, ...] = SPEEDS_M_S, travel_m: float = 0.02, longest_s: float = 3.0
) -> Array:
    """Speeds (n,) at RATE_HZ: each speed out and back for at most `longest_s` or `travel_m`, ramps
    of 0.1 s.
    """
    parts = [np.zeros(200)]
    for speed in speeds_m_s:
        hold = int(RATE_HZ * min(longest_s, max(travel_m / speed, 0.4)))
        parts += [np.full(hold, speed), np.full(hold, -speed)]
    raw = np.concatenate([*parts, np.zeros(200)])
    kernel = np.hanning(102)[1:-1]
    return np.convolve(raw, kernel / kernel.sum(), "same")


def friction_force(friction: Friction, velocity_m_s: Array) -> Array:
    """(5) in N, positive against extension, 0 at rest; velocity (n,)."""
    numbers, speed = eight(friction), np.abs(velocity_m_s)
    return np.where(
        velocity_m_s > 0.0,
        curve(numbers[:4], speed),
        np.where(velocity_m_s < 0.0, -curve(numbers[4:], speed), 0.0),
    )


def air_recording(
    friction: Friction, seed: int, v: Array | None = None, known: Known = KNOWN
) -> Recording:
    """A recording with the foot in the air, made from the law itself: pA follows from F_f + m a - m
    g.
    """
    rng = np.random.default_rng(seed)
    v = speed_profile() if v is None else v
    time_s = np.arange(v.size) / RATE_HZ
    pb = 2.0e6 + 2.0e5 * np.sin(2.0 * np.pi * 0.05 * time_s) + 0.3e6 * (v < 0.0)
    pb = np.convolve(np.pad(pb, 50, "edge"), np.ones(101) / 101, "valid")
    pa = (
        friction_force(friction, v) + frame_force(v, known) + pb * known.area_b_m2
    ) / known.area_a_m2
    position_m = 0.2 + rng.uniform(0.0, 1e-3) + (np.cumsum(v) - 0.5 * v) / RATE_HZ
    return recording_of(
        time_s,
        position_m,
        _measured(pa, rng),
        _measured(pb, rng),
        np.zeros_like(time_s),
        known,
        "foot-in-air",
    )


def frame_force(velocity_m_s: Array, known: Known) -> Array:
    """M a - m g cos(inclination), N, of the inner frame moving at a velocity (n,) at RATE_HZ."""
    mass = known.moving_mass_kg or 0.0
    return np.asarray(mass * (np.gradient(velocity_m_s) * RATE_HZ - known.gravity_along_axis_m_s2))


def _measured(pressure: Array, rng: np.random.Generator) -> Array:
    noisy = pressure + rng.normal(0.0, PRESSURE_NOISE_PA, pressure.size)
    return np.asarray(np.round(noisy / PRESSURE_STEP_PA) * PRESSURE_STEP_PA)


def recording_of(
    time_s: Array,
    position_m: Array,
    pa: Array,
    pb: Array,
    reference: Array,
    known: Known,
    kind: str,
) -> Recording:
    """A recording in memory, as if read from a folder: position m (to be rounded to the
    encoder's step), pa, pb Pa, N.
    """
    unit = Calibration(k_pa_per_v=2.0e6, a=1.0, b=0.0)

    def pressure(column: str) -> Channel:
        return Channel(column=column, unit="Pa", range_pa=(0.0, 1.0e7), calibration=unit)

    header = Header(
        format="roboclimber-recording/1",
        rig="vertical-leg",
        data="data.parquet",
        sample_rate_hz=RATE_HZ,
        channels={
            "time": Channel(column="t", unit="s"),
            "position": Channel(column="x", unit="m", resolution=RESOLUTION_M),
            "pressure_a": pressure("pA"),
            "pressure_b": pressure("pB"),
        },
        known=known,
        reference_force=ReferenceForce.model_validate(
            {"kind": kind} | ({"column": "F_ref", "unit": "N"} if kind == "load-cell" else {})
        ),
    )
    never = np.zeros(time_s.size, dtype=np.bool_)
    rounded = np.round(position_m / RESOLUTION_M) * RESOLUTION_M
    return Recording(
        "simulated",
        Path("simulated"),
        header,
        time_s,
        rounded,
        None,
        pa,
        pb,
        None,
        None,
        None,
        reference,
        never,
        never,
    )


def coverage(trials: int, v: Array | None = None) -> tuple[NDArray[np.int64], float]:
    """(trials in which the 90 % interval holds the truth (8,), largest relative error at unseen
    speeds).
    """
    held, worst = np.zeros(8, dtype=np.int64), 0.0
    v = speed_profile() if v is None else v
    for seed in range(trials):
        friction = random_friction(np.random.default_rng([7, seed]))
        true = eight(friction)
        found = identify([air_recording(friction, seed, v)], KNOWN)
        held += [
            parameter.interval90[0] <= truth <= parameter.interval90[1]
            for parameter, truth in zip(found.parameters, true, strict=True)
        ]
        value = eight(found.model.friction)
        for side in (slice(0, 4), slice(4, 8)):
            error = curve(value[side], UNSEEN_M_S) / curve(true[side], UNSEEN_M_S) - 1.0
            worst = max(worst, float(np.abs(error).max()))
    return held, worst


# Simulated calibrations: a leg that presses on a load cell while it moves to and fro, with known a
# and b.
#
# What is unknown is drawn from what the calibration expects beforehand (its priors), so that its 95
# % regions ought to hold the truth in 95 of 100 trials.

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
    return (rest + sign * (of_load * load + of_pressure * pb)) / (
        KNOWN.area_a_m2 - sign * of_pressure
    )


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
