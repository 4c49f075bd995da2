"""Random rigs of the reference leg: geometry, friction, sensors, motions and what is hidden in
them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from testbed.benchmarks.reference_leg.leg import parameters, simulate
from testbed.formats.arrays import Array
from testbed.formats.yaml_files import read_mapping
from testbed.recording.axis import Recording, Rig
from testbed.recording.axis_header import Header
from testbed.recording.known import Known

Hides = Mapping[str, Any]
"""An effect as this leg has it: see hidden.yaml."""


@cache
def hides(group: str) -> Mapping[str, Hides]:
    """The effects of a group of hidden.yaml (kernel, sensors, outside) by name."""
    found: Mapping[str, Hides] = read_mapping(Path(__file__).with_name("hidden.yaml"))[group]
    return found


def named() -> Mapping[str, Hides]:
    """All effects that have a name."""
    return {**hides("kernel"), **hides("sensors")}


def drawn(rng: np.random.Generator, strength: float, how: Mapping[str, Any]) -> float:
    """One number of an effect at a strength; `how` as in hidden.yaml."""
    match how:
        case {"of": count}:
            return float(rng.integers(0, count))
        case {"between": (low, high)}:
            return float(rng.uniform(low, high))
        case {"hz": (low, high)}:
            return float(2.0 * np.pi * rng.uniform(low, high))
        case {"signed": size}:
            return float(rng.choice([-1.0, 1.0])) * float(size) * strength
        case {"over": size}:
            return float(size) / strength
    return float(how["times"]) * strength + float(how.get("plus", 0.0))


def answers() -> Mapping[str, tuple[str, str]]:
    """Effect -> (parameter, the rig's hidden number that it should be found with)."""
    return {
        name: (effect["parameter"], f"{_prefix(name)}{effect['number']}")
        for name, effect in named().items()
        if "parameter" in effect
    }


def _prefix(name: str) -> str:
    """What a hidden number's name begins with: both sensors have the same numbers."""
    return f"{name}:" if name in hides("sensors") else ""


@dataclass(frozen=True)
class Hidden:
    """What is in a rig that its `known` does not say."""

    names: tuple[str, ...]
    strengths: tuple[float, ...]
    numbers: dict[str, float] = field(default_factory=dict)
    forms: tuple[int, ...] = ()


def draw_hidden(rng: np.random.Generator, kind: str) -> Hidden:
    """`kind`: clean, single, double, outside. Strengths run log-uniformly over a factor of 16."""
    pool, names = named(), list[str]()
    if kind in ("single", "double"):
        count = 2 if kind == "double" else 1
        names = [str(name) for name in rng.choice(sorted(pool), count, replace=False)]
    elif kind == "outside":
        pool = hides("outside")
        names = [str(rng.choice(sorted(pool)))]
    strengths = [float(np.exp(rng.uniform(np.log(0.1), np.log(1.6)))) for _ in names]
    if kind == "outside":
        strengths = [max(strength, 0.3) for strength in strengths]
    numbers: dict[str, float] = {}
    forms = []
    for name, strength in zip(names, strengths, strict=True):
        found = {key: drawn(rng, strength, how) for key, how in pool[name]["drawn"].items()}
        forms.append(int(next((value for key, value in found.items() if key.endswith("form")), 0)))
        numbers |= {f"{_prefix(name)}{key}": value for key, value in found.items()}
    return Hidden(tuple(names), tuple(strengths), numbers, tuple(forms))


def draw_known(rng: np.random.Generator) -> Known:
    """A random rig's declaration."""
    bore, rod = [(0.063, 0.036), (0.07, 0.036), (0.07, 0.04), (0.08, 0.05), (0.08, 0.045)][
        int(rng.integers(5))
    ]
    return Known(
        bore_m=bore,
        rod_m=rod,
        stroke_m=float(rng.choice([0.4, 0.5, 0.6], p=[0.15, 0.7, 0.15])),
        moving_mass_kg=float(rng.uniform(75.0, 130.0)),
        inclination_deg=float(rng.choice([0.0, 15.0, 30.0, 40.0])),
        supply_pressure_nominal_pa=float(rng.choice([7.5e6, 8.5e6, 9e6])),
        tank_pressure_pa=2e5,
        dead_volume_a_m3=4e-4,
        dead_volume_b_m3=4e-4,
        bulk_modulus_pa=float(rng.choice([1.0e9, 1.2e9, 1.4e9])),
        valve_rated_flow_m3_s=float(rng.choice([25.0, 32.0])) / 6e4,
        valve_rated_drop_per_edge_pa=3.5e6,
        valve_natural_frequency_hz=float(rng.choice([20.0, 30.0])),
        valve_damping=0.9,
        valve_deadband=0.03,
        internal_leakage_m3_s_pa=5e-14,
        cushion_length_m=0.03,
    )


def make_rig(seed: int, kind: str, sound: bool = False) -> tuple[Rig, Hidden]:
    """A whole rig in memory, and what is hidden in it. The same seed gives the same rig.

    `sound`: its twin, the same in everything but without what is hidden.
    """
    rng = np.random.default_rng([seed, 7])
    known = draw_known(rng)
    hidden = draw_hidden(rng, kind)
    rate = float(rng.choice([500.0, 1000.0]))
    leg = _leg_numbers(known, rng)
    numbers = {} if sound else hidden.numbers
    leg |= {
        name: number
        for name, number in numbers.items()
        if ":" not in name and name not in _RECORDER
    }
    recorder = {
        name: number for name, number in numbers.items() if ":" in name or name in _RECORDER
    }
    level = rng.uniform(14.0, 35.0)
    isothermal = rng.uniform() < 0.25
    parts: dict[str, list[Recording]] = {"identify": [], "verify": []}
    for part, motions in (("identify", IDENTIFY), ("verify", VERIFY)):
        for motion in motions:
            warmth = (level + rng.uniform(-8.0, 8.0), 0.0 if isothermal else rng.uniform(0.2, 0.35))
            parts[part].append(
                _record(f"{part}/{motion}", motion, known, leg, recorder, rate, warmth, rng)
            )
    folder = Path(f"reference-{seed:05d}")
    return Rig(folder.name, folder, tuple(parts["identify"]), tuple(parts["verify"])), hidden


_RECORDER = ("line_a", "encoder_wave", "encoder_length", "warm_zero_b")


def _leg_numbers(known: Known, rng: np.random.Generator) -> dict[str, float]:
    k = known
    assert k.valve_natural_frequency_hz and k.moving_mass_kg
    side = rng.uniform(0.75, 1.3)
    coulomb = rng.uniform(300.0, 700.0)
    return {
        "area_a": k.area_a_m2,
        "area_b": k.area_b_m2,
        "stroke": k.stroke_m or 0.5,
        "mass": k.moving_mass_kg,
        "gravity": k.gravity_along_axis_m_s2,
        "dead_a": k.dead_volume_a_m3 or 0.0,
        "dead_b": k.dead_volume_b_m3 or 0.0,
        "beta": k.bulk_modulus_pa or 1e9,
        "leak": k.internal_leakage_m3_s_pa or 0.0,
        "supply": k.supply_pressure_nominal_pa or 8e6,
        "tank": k.tank_pressure_pa or 0.0,
        "rated": k.valve_rated_flow_m3_s or 4e-4,
        "drop": k.valve_rated_drop_per_edge_pa or 3.5e6,
        "valve_w": 2.0 * np.pi * k.valve_natural_frequency_hz,
        "valve_damping": k.valve_damping or 0.9,
        "deadband": k.valve_deadband or 0.0,
        "edge_smooth": float(rng.uniform(1e4, 1.5e5)),
        "sigma_p": rng.uniform(1500.0, 4500.0),
        "coulomb_p": coulomb,
        "stribeck_p": rng.uniform(30.0, 300.0),
        "speed_p": rng.uniform(0.005, 0.025),
        "sigma_m": rng.uniform(1500.0, 4500.0),
        "coulomb_m": coulomb * side,
        "stribeck_m": rng.uniform(30.0, 300.0),
        "speed_m": rng.uniform(0.005, 0.025),
        "bend": rng.uniform(0.9, 1.2),
        "bristle": 10.0 ** rng.uniform(7.0, 7.6),
        "bristle_damping": rng.uniform(500.0, 3000.0),
        "gain": rng.uniform(25.0, 40.0),
        "feed": rng.uniform(2.0, 6.0),
        "ground_damping": rng.uniform(3e3, 2e4),
        "ground_at": (k.stroke_m or 0.5) * rng.uniform(0.38, 0.5),
    }


def _record(
    name: str,
    motion: str,
    known: Known,
    leg: dict[str, float],
    recorder: dict[str, float],
    rate: float,
    warmth: tuple[float, float],
    rng: np.random.Generator,
) -> Recording:
    """Simulate one motion and read it through the rig's sensors."""
    load_cell = motion.startswith("press")
    seconds = DURATION_S[motion] * (0.67 if name == "verify/shake" else 1.0)
    aim = target(motion, seconds + 0.6, rate, leg["stroke"], leg["ground_at"], rng)
    temperature = np.asarray(warmth[0] + warmth[1] * np.arange(len(aim)) / rate, dtype=np.float64)
    numbers = leg | ({"ground": rng.uniform(4e6, 8e6)} if load_cell else {})
    speed = np.gradient(aim) * rate
    speed = np.clip(speed, -0.2, 0.2)
    substeps = 12 if rate < 700.0 else 6
    rows = simulate(
        parameters(numbers), aim, speed, temperature, 1.0 / rate, substeps, float(aim[0])
    )
    first = round(0.3 * rate)
    from testbed.benchmarks.reference_leg.sensors import read

    return read(name, rows[first:], temperature[first:], rate, known, recorder, load_cell, rng)


def header(known: Known, rate: float, load_cell: bool) -> Header:
    """The declaration of a reference recording."""
    channels: dict[str, Any] = {
        "time": {"column": "t", "unit": "s"},
        "valve_command": {"column": "u", "unit": "1"},
        "position": {"column": "x", "unit": "m", "resolution": 1e-4},
        "pressure_a": {"column": "pA", "unit": "Pa", "range_pa": [0.0, 1e7]},
        "pressure_b": {"column": "pB", "unit": "Pa", "range_pa": [0.0, 1e7]},
        "supply_pressure": {"column": "ps", "unit": "Pa"},
        "oil_temperature": {"column": "T", "unit": "degC"},
    }
    reference = (
        {"kind": "foot-in-air"}
        if not load_cell
        else {
            "kind": "load-cell",
            "column": "F_ref",
            "unit": "N",
            "standard_deviation": 1.7,
            "resolution": 10.0,
        }
    )
    return Header.model_validate(
        {
            "format": "roboclimber-recording/1",
            "rig": "vertical-leg",
            "data": "data.parquet",
            "sample_rate_hz": rate,
            "channels": channels,
            "known": known.model_dump(),
            "reference_force": reference,
        }
    )


# Motions of the reference rigs: what a bench engineer would drive, drawn at random within the
# stroke.

DURATION_S = {
    "multisine": 30.0,
    "press": 40.0,
    "ramps": 60.0,
    "shake": 15.0,
    "press_sine": 30.0,
    "sine": 20.0,
    "steps": 25.0,
}
IDENTIFY = ("multisine", "press", "ramps", "shake")
VERIFY = ("press_sine", "shake", "sine", "steps")


def target(
    kind: str,
    seconds: float,
    rate_hz: float,
    stroke_m: float,
    ground_m: float,
    rng: np.random.Generator,
) -> Array:
    """Desired position in m, one a sample, shape (n,). `ground_m`: where the load cell is met in
    press motions.
    """
    time_s = np.arange(round(seconds * rate_hz)) / rate_hz
    middle = stroke_m * rng.uniform(0.4, 0.6)
    if kind == "multisine":
        x = np.zeros_like(time_s)
        for f in rng.uniform(0.06, 0.9, 7):
            x += (
                rng.uniform(0.4, 1.0)
                / (1.0 + 4.0 * f)
                * np.sin(2.0 * np.pi * (f * time_s + rng.uniform()))
            )
        return np.asarray(middle + 0.16 * stroke_m * x / np.abs(x).max(), dtype=np.float64)
    if kind == "shake":
        slow = 0.11 * stroke_m * np.sin(2.0 * np.pi * time_s / rng.uniform(8.0, 13.0))
        fast = 0.006 * rng.uniform(0.5, 1.2) * np.sin(2.0 * np.pi * rng.uniform(1.5, 3.0) * time_s)
        other = 0.004 * rng.uniform(0.5, 1.2) * np.sin(2.0 * np.pi * rng.uniform(2.5, 4.5) * time_s)
        return np.asarray(middle + slow + fast + other, dtype=np.float64)
    if kind == "sine":
        f, size = rng.uniform(0.12, 0.3), rng.uniform(0.08, 0.16) * stroke_m
        return np.asarray(
            middle + size * np.sin(2.0 * np.pi * (f * time_s + rng.uniform())), dtype=np.float64
        )
    if kind == "ramps":
        return _ramps(time_s, stroke_m, rng)
    if kind == "steps":
        return _held(time_s, stroke_m * rng.uniform(0.18, 0.8, 12), rng.uniform(1.0, 4.0, 12))
    return _press(time_s, ground_m, rng, kind == "press_sine")


def _held(time_s: Array, levels: Array, times: Array) -> Array:
    index = np.minimum(np.searchsorted(np.cumsum(times), time_s), len(levels) - 1)
    return np.asarray(levels[index], dtype=np.float64)


def _ramps(time_s: Array, stroke_m: float, rng: np.random.Generator) -> Array:
    """Constant speeds, slow to fast, both ways."""
    x, out, direction = stroke_m * 0.25, np.empty_like(time_s), 1.0
    period, left = time_s[1] - time_s[0], 0.0
    speed = 0.005
    for index in range(len(time_s)):
        if left <= 0.0:
            direction = -direction if index else 1.0
            speed = float(np.exp(rng.uniform(np.log(0.002), np.log(0.1))))
            left = float(np.clip(rng.uniform(0.03, 0.25) / speed, 1.5, 7.0))
        nxt = x + direction * speed * period
        if not 0.22 * stroke_m < nxt < 0.78 * stroke_m:
            direction, left = -direction, max(left, 1.0)
            nxt = x + direction * speed * period
        x, left = nxt, left - period
        out[index] = x
    return out


def _press(time_s: Array, ground_m: float, rng: np.random.Generator, wave: bool) -> Array:
    """Down onto the load cell, some loads, up again."""
    count = 24
    above = ground_m - rng.uniform(0.012, 0.022)
    levels, times = [], []
    for _ in range(count):
        levels += [above, *(ground_m + rng.uniform(0.0006, 0.0045, 3))]
        times += [rng.uniform(1.5, 3.0), *rng.uniform(1.0, 3.5, 3)]
    x = _held(time_s, np.array(levels), np.array(times))
    if wave:
        x = x + 0.0006 * np.sin(2.0 * np.pi * rng.uniform(0.2, 0.5) * time_s) * (x > ground_m)
    return np.asarray(x, dtype=np.float64)
