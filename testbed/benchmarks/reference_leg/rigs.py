"""Random rigs of the reference leg: geometry, friction, sensors, motions and what is hidden in
them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.benchmarks.reference_leg.leg import parameters, simulate
from testbed.benchmarks.reference_leg.motions import DURATION_S, IDENTIFY, VERIFY, target
from testbed.recording.axis import Recording, Rig
from testbed.recording.axis_header import Header
from testbed.recording.known import Known

Array = npt.NDArray[np.float64]
Draw = Callable[[np.random.Generator, float], dict[str, float]]


@dataclass(frozen=True)
class Hides:
    """An effect as this leg has it: the effect's parameter, this leg's number for it, and how its
    numbers are drawn.

    `parameter` is empty where no number of this leg says the same as a parameter of the effect.
    """

    parameter: str
    number: str
    draw: Draw


def _sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


KERNEL: dict[str, Hides] = {
    "friction.position": Hides(
        "slope",
        "fpos",
        lambda g, s: {
            "fpos": _sign(g) * 0.9 * s,
            "fpos_form": float(g.integers(0, 3)),
        },
    ),
    "friction.pressure": Hides(
        "coefficient",
        "fpres",
        lambda g, s: {"fpres": 7e-5 * s, "fpres_form": float(g.integers(0, 2))},
    ),
    "friction.load": Hides(
        "coefficient",
        "fload",
        lambda g, s: {"fload": 0.045 * s, "fload_form": float(g.integers(0, 2))},
    ),
    "friction.presliding": Hides(
        "",
        "",
        lambda g, s: {
            "pre_k": 3e5 / s,
            "pre_c": g.uniform(100.0, 900.0),
            "pre_form": float(g.integers(0, 2)),
        },
    ),
    "friction.temperature": Hides(
        "rate", "temp", lambda g, s: {"temp": 0.025 * s, "temp_form": float(g.integers(0, 2))}
    ),
    "inertia.mass": Hides(
        "mass",
        "mass_add",
        lambda g, s: {"mass_add": 50.0 * s, "mass_form": float(g.integers(0, 2))},
    ),
    "force.spring": Hides(
        "stiffness",
        "spring",
        lambda g, s: {
            "spring": 1800.0 * s,
            "spring_rest": g.uniform(0.1, 0.4),
            "spring_form": float(g.integers(0, 2)),
        },
    ),
    "force.periodic": Hides(
        "amplitude",
        "per_amp",
        lambda g, s: {
            "per_amp": 180.0 * s,
            "per_w": 2 * np.pi * g.uniform(4.0, 16.0),
            "per_form": float(g.integers(0, 2)),
        },
    ),
    "force.cushion": Hides(
        "stiffness",
        "cush",
        lambda g, s: {
            "cush": 6000.0 * s,
            "cush_start": g.uniform(0.18, 0.26),
            "cush_form": float(g.integers(0, 2)),
        },
    ),
    "leakage.internal": Hides(
        "coefficient",
        "leak",
        lambda g, s: {
            "leak": 5e-12 * s + 5e-14,
            "leak_form": float(g.integers(0, 2)),
        },
    ),
    "hydraulics.air": Hides(
        "fraction", "air", lambda g, s: {"air": 0.02 * s, "air_form": float(g.integers(0, 2))}
    ),
    "hydraulics.hose": Hides(
        "capacity",
        "hose",
        lambda g, s: {
            "hose": 2.5e-12 * s,
            "hose_time": g.uniform(0.05, 0.6),
            "hose_form": float(g.integers(0, 2)),
        },
    ),
    "valve.deadband": Hides(
        "deadband",
        "deadband",
        lambda g, s: {
            "deadband": 0.03 + 0.1 * s,
            "dead_form": float(g.integers(0, 2)),
        },
    ),
    "supply.droop": Hides(
        "droop",
        "droop",
        lambda g, s: {
            "droop": 6e9 * s,
            "droop_time": g.uniform(0.05, 0.5),
            "droop_form": float(g.integers(0, 2)),
        },
    ),
}
"""Named effects that live in the physics: numbers for the kernel at a strength (1 = well
visible).
"""

SENSORS: dict[str, Hides] = {
    "sensor.gain_a": Hides(
        "gain_error",
        "gain",
        lambda g, s: {"gain": _sign(g) * 0.04 * s, "form": float(g.integers(0, 2))},
    ),
    "sensor.gain_b": Hides(
        "gain_error",
        "gain",
        lambda g, s: {"gain": _sign(g) * 0.04 * s, "form": float(g.integers(0, 2))},
    ),
    "sensor.drift_a": Hides(
        "rate",
        "drift",
        lambda g, s: {
            "drift": _sign(g) * 1800.0 * s,
            "form": float(g.integers(0, 2)),
        },
    ),
    "sensor.line_b": Hides(
        "natural_frequency",
        "line",
        lambda g, s: {
            "line": 6.0 / s,
            "zeta": g.uniform(0.5, 1.2),
            "form": float(g.integers(0, 2)),
        },
    ),
    "sensor.delay": Hides(
        "delay", "delay", lambda g, s: {"delay": 0.02 * s, "form": float(g.integers(0, 2))}
    ),
}
"""Named effects that live in the sensors."""

ANSWERS: dict[str, tuple[str, str]] = {
    name: (hides.parameter, f"{name}:{hides.number}" if name in SENSORS else hides.number)
    for name, hides in {**KERNEL, **SENSORS}.items()
    if hides.parameter
}
"""Effect -> (parameter, the rig's hidden number that it should be found with)."""

OUTSIDE: dict[str, Draw] = {
    "outside.drag": lambda g, s: {"drag": 4e4 * s},
    "outside.ripple": lambda g, s: {"ripple": 150.0 * s, "ripple_wave": g.uniform(0.01, 0.05)},
    "outside.viscous_along_stroke": lambda g, s: {"sigma_pos": _sign(g) * 1.5 * s},
    "outside.edge_gain": lambda g, s: {"edge_gain": 0.15 * s},
    "outside.external_leak": lambda g, s: {"external_leak": 3e-12 * s},
    "outside.dwell": lambda g, s: {"dwell": 500.0 * s, "dwell_time": g.uniform(0.5, 4.0)},
    "outside.valve_delay": lambda g, s: {"valve_delay": 0.015 * s},
    "outside.tank_rise": lambda g, s: {"tank_rise": 1e13 * s},
    "outside.line_a": lambda g, s: {"line_a": 8.0 / s},
    "outside.encoder_wave": lambda g, s: {
        "encoder_wave": 2e-3 * s,
        "encoder_length": g.uniform(0.03, 0.1),
    },
    "outside.warm_zero_b": lambda g, s: {"warm_zero_b": _sign(g) * 8e3 * s},
}
"""Effects that no name covers."""


@dataclass(frozen=True)
class Hidden:
    """What is in a rig that its `known` does not say."""

    names: tuple[str, ...]
    strengths: tuple[float, ...]
    numbers: dict[str, float] = field(default_factory=dict)
    forms: tuple[int, ...] = ()


def draw_hidden(rng: np.random.Generator, kind: str) -> Hidden:
    """`kind`: clean, single, double, outside. Strengths run log-uniformly over a factor of 16."""
    pool = {name: hides.draw for name, hides in {**KERNEL, **SENSORS}.items()}
    names: list[str] = []
    if kind in ("single", "double"):
        names = [
            str(n) for n in rng.choice(sorted(pool), 2 if kind == "double" else 1, replace=False)
        ]
    elif kind == "outside":
        names, pool = [str(rng.choice(sorted(OUTSIDE)))], OUTSIDE
    strengths = [float(np.exp(rng.uniform(np.log(0.1), np.log(1.6)))) for _ in names]
    if kind == "outside":
        strengths = [max(s, 0.3) for s in strengths]
    numbers: dict[str, float] = {}
    forms = []
    for name, strength in zip(names, strengths, strict=True):
        drawn = pool[name](rng, strength)
        forms.append(int(next((value for key, value in drawn.items() if key.endswith("form")), 0)))
        prefix = f"{name}:" if name in SENSORS else ""
        numbers |= {prefix + key: float(value) for key, value in drawn.items()}
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
