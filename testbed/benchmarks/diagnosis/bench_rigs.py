"""Simulated benches with one chamber and a load cell, and drives, each with a listed effect, one
outside the list, or none.

The motion is prescribed, so force and pressure follow from the laws alone. Rigs differ in friction,
mass, travel, sample rate, encoder step and in what their force sensor's noise is like: white,
coloured, quantised or with outliers.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from testbed.benchmarks.diagnosis.bench_laws import (
    AS_LARGE_AS_FRICTION,
    ON_A_CYLINDER,
    ON_A_DRIVE,
    OUTSIDE,
    Law,
    Motion,
)
from testbed.estimation.leg.balance import MOVING_M_S
from testbed.formats.arrays import Array
from testbed.recording.axis import Recording, Rig
from testbed.recording.axis_header import Channel, Header, ReferenceForce
from testbed.recording.known import Known

NOISES = ("white", "coloured", "quantised", "outliers")
RATES_HZ = (200.0, 500.0, 1000.0)
KINDS = ("outside", "listed", "clean", "outside", "listed", "outside")
"""In turn, so that every prefix holds every kind."""
LARGEST = 1.5
SIZES = (3.0, 12.0)
"""What a law is worth beyond what friction (5), a mass and a zero can make of it, RMS over the
sensor's noise.
"""
LEVELS_PA = (1e5, 3e5, 7e5, 5e5)
"""Of a bench's recordings, the last one kept back."""


@dataclass(frozen=True)
class Hidden:
    """What is in a rig: `kind` outside, listed or clean; `law`; `size_n` of it; `noise`, the
    sensor's.
    """

    kind: str
    law: str
    size_n: float
    noise: str


@dataclass(frozen=True)
class _Build:
    """What the recordings of a rig have in common."""

    seed: int
    drive: bool
    rate_hz: float
    noise: str
    noise_n: float
    law: Law | None
    size_n: float
    known: Known
    mass_kg: float
    area_m2: float
    level_n: float
    viscous_n_s_m: float
    zero_n: float
    step_m: float
    current_recorded: bool


def make_bench(seed: int) -> tuple[Rig, Hidden]:
    """The rig of a seed: even seeds are drives, odd ones benches; in every third a current rides
    along, of a damper or of something else.
    """
    rng = np.random.default_rng([77, seed])
    drive, kind = seed % 2 == 0, KINDS[(seed // 2) % len(KINDS)]
    listed = ON_A_DRIVE if drive else ON_A_CYLINDER
    laws = {"outside": OUTSIDE, "listed": listed, "clean": {}}[kind]
    law = str(rng.choice(list(laws))) if laws else ""
    with_current = seed % 3 == 0 or seed % 5 == 0
    noise = NOISES[int(rng.integers(len(NOISES)))]
    level = float(rng.uniform(15.0, 45.0))
    noise_n = level * float(rng.uniform(0.01, 0.03))
    size_n = float(rng.uniform(*SIZES)) * noise_n if law else 0.0
    bore, mass = 0.025, float(rng.uniform(40.0, 120.0))
    known = (
        Known(moving_mass_kg=mass, inclination_deg=90.0)
        if drive
        else Known(bore_m=bore, inclination_deg=90.0)
    )
    off = 1.0 + 0.01 * float(rng.standard_normal())
    build = _Build(
        seed,
        drive,
        float(rng.choice(RATES_HZ)) if drive else 100.0,
        noise,
        noise_n,
        ({**OUTSIDE, **listed})[law] if law else None,
        size_n,
        known,
        mass * off if drive else 0.0,
        0.25 * np.pi * bore**2 * off**2,
        level,
        float(rng.uniform(80.0, 300.0)),
        0.0 if drive else float(rng.uniform(-10.0, 10.0)),
        float(rng.choice([1e-6, 5e-6, 2e-5])),
        with_current,
    )
    if build.law is not None and law not in AS_LARGE_AS_FRICTION:
        build = replace(build, size_n=_scaled(_motion(build, 0), build, size_n))
    made = [_recording(build, index) for index in range(4)]
    rig = Rig(f"bench-{seed}", Path(f"bench-{seed}"), tuple(made[:3]), tuple(made[3:]))
    return rig, Hidden(kind, law, size_n, noise)


def _motion(build: _Build, number: int) -> Motion:
    rng = np.random.default_rng([78, build.seed, number])
    seconds = 14.0 if build.drive else 40.0
    time_s = np.arange(round(seconds * build.rate_hz)) / build.rate_hz
    stroke = 0.25 if build.drive else 0.06
    period = float(rng.uniform(2.0, 4.0)) if build.drive else float(rng.uniform(6.0, 10.0))
    slow = 0.32 * (2.0 / np.pi) * np.arcsin(0.995 * np.sin(2.0 * np.pi * time_s / period))
    drift = 0.06 * np.sin(2.0 * np.pi * time_s / seconds + rng.uniform(0.0, 6.0))
    quick = 0.03 if build.drive else 0.01
    fast = quick * np.sin(2.0 * np.pi * time_s / period * (4.0 + rng.uniform(0.0, 1.0)))
    share = np.sin(2.0 * np.pi * time_s / seconds * rng.uniform(2.0, 5.0))
    position_m = stroke * (0.5 + slow + drift + fast * (1.0 if build.drive else (share > 0.0)))
    position_m = _smoothed(position_m, 0.02 * build.rate_hz)
    velocity_m_s = np.gradient(position_m, time_s)
    pressure = np.zeros_like(time_s)
    if not build.drive:
        pressure = LEVELS_PA[number] * (1.0 + 0.04 * np.sin(2.0 * np.pi * time_s / 3.0))
    current = 0.5 + 0.5 * np.sin(
        2.0 * np.pi * time_s / rng.uniform(3.0, 7.0) + rng.uniform(0.0, 6.0)
    )
    return Motion(
        time_s,
        position_m,
        velocity_m_s,
        np.gradient(velocity_m_s, time_s),
        pressure,
        current,
        build.level_n,
        stroke,
    )


def _scaled(motion: Motion, build: _Build, size_n: float) -> float:
    """The law's size with which RMS `size_n` is left once friction (5), a mass and a zero have
    taken up what they can; less where the law as a whole would be larger than friction by LARGEST.
    """
    assert build.law is not None
    plus, speed = motion.velocity_m_s > 0.0, np.abs(motion.velocity_m_s)
    one, bump = np.ones_like(speed), np.exp(-speed / 0.01)
    each_way = [column * way for column in (one, speed, bump) for way in (plus, ~plus)]
    shared = np.column_stack([*each_way, motion.acceleration_m_s2])
    force = build.law(motion, 1.0, np.random.default_rng([79, build.seed]))
    moving = speed > MOVING_M_S
    left = force - shared @ np.linalg.lstsq(shared[moving], force[moving], rcond=None)[0]
    beyond, whole = (float(np.sqrt(np.mean(part[moving] ** 2))) for part in (left, force))
    return min(size_n / beyond, LARGEST * build.level_n / whole)


def _smoothed(values: Array, samples: float) -> Array:
    from scipy.ndimage import gaussian_filter1d

    return np.asarray(gaussian_filter1d(values, samples, mode="nearest"))


def _noise(build: _Build, rng: np.random.Generator, clean: Array) -> Array:
    """The force as its sensor reads it, N."""
    white = rng.standard_normal(len(clean))
    if build.noise == "coloured":
        share = 0.5 ** (200.0 / build.rate_hz)
        out = np.empty_like(white)
        last = 0.0
        for index, shock in enumerate(white):
            last = share * last + np.sqrt(1.0 - share**2) * shock
            out[index] = last
        return clean + build.noise_n * out
    if build.noise == "quantised":
        step = 2.0 * build.noise_n
        return np.round((clean + 0.5 * build.noise_n * white) / step) * step
    if build.noise == "outliers":
        spikes = (rng.random(len(clean)) < 0.005) * rng.normal(0.0, 12.0, len(clean))
        return clean + build.noise_n * (white + spikes)
    return clean + build.noise_n * white


def _recording(build: _Build, number: int) -> Recording:
    motion = _motion(build, number)
    same = np.random.default_rng([79, build.seed])
    friction = build.viscous_n_s_m * motion.velocity_m_s + build.level_n * motion.direction
    friction = friction + 0.3 * build.level_n * motion.direction * np.exp(
        -np.abs(motion.velocity_m_s) / 0.01
    )
    if build.law is not None:
        friction = friction + build.law(motion, build.size_n, same)
    rng = np.random.default_rng([80, build.seed, number])
    if build.drive:
        force = _noise(build, rng, build.mass_kg * motion.acceleration_m_s2 + friction)
        return _as_recording(build, number, motion, force, rng)
    reference = build.area_m2 * motion.pressure_pa - friction - build.zero_n
    return _as_recording(build, number, motion, _noise(build, rng, reference), rng)


def _as_recording(
    build: _Build, number: int, motion: Motion, force: Array, rng: np.random.Generator
) -> Recording:
    channels = {
        "time": Channel(column="t", unit="s"),
        "position": Channel(column="x", unit="m", resolution=build.step_m),
    }
    if build.drive:
        channels["actuator_force"] = Channel(column="F", unit="N")
        cell = ReferenceForce(kind="free")
    else:
        channels["pressure_a"] = Channel(column="pA", unit="Pa")
        cell = ReferenceForce(kind="load-cell", column="F_ref", unit="N")
    extra = {"current": motion.current} if build.current_recorded else {}
    channels |= {name: Channel(column=name, unit="A") for name in extra}
    header = Header(
        format="roboclimber-recording/1",
        rig="drive" if build.drive else "cylinder",
        data="data.parquet",
        sample_rate_hz=build.rate_hz,
        channels=channels,
        known=build.known,
        reference_force=cell,
    )
    never = np.zeros(len(motion.time_s), dtype=np.bool_)
    read_pa = motion.pressure_pa + rng.normal(0.0, 100.0, len(never))
    return Recording(
        name=f"run{number}",
        folder=Path(f"run{number}"),
        header=header,
        time_s=motion.time_s,
        position_m=np.round(motion.position_m / build.step_m) * build.step_m,
        valve_command=None,
        pressure_a_pa=None if build.drive else read_pa,
        pressure_b_pa=None,
        supply_pressure_pa=None,
        oil_temperature_degc=None,
        actuator_force_n=force if build.drive else None,
        reference_force_n=np.zeros(len(never)) if build.drive else force,
        saturated_a=never,
        saturated_b=never,
        extra=extra,
    )
