"""Figure 8 and Table III: constant speeds both ways in the air, friction identified."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from testbed.benchmarks.estimators.identification_trials import (
    KNOWN,
    eight,
    friction_force,
    recording_of,
)
from testbed.benchmarks.harness import rms
from testbed.benchmarks.paper.experiment import Line, Result
from testbed.benchmarks.paper.figure_06 import in_the_air
from testbed.benchmarks.paper.leg import MASS_KG, RATE_HZ, Trace, chosen, once_per_machine, run
from testbed.estimation.friction.identification import Identification, identify
from testbed.estimation.friction.posterior import curve
from testbed.estimation.leg.motion import smooth
from testbed.formats.arrays import Array
from testbed.laws.friction import stribeck_level
from testbed.machine.names import GRAVITY_M_S2

SPEEDS_M_S = (0.002, 0.004, 0.007, 0.012, 0.02, 0.035, 0.05, 0.07)
PLACES_M = (0.12, 0.25, 0.38)
TRANSIT_M_S = 0.06
PLATEAU_S = 1.5
"""Least duration of a speed."""
VISCOUS_FROM_M_S = 0.015
"""Two Stribeck speeds and more."""


def steady_friction(
    v: float, coulomb_n: float, static_n: float, stribeck_m_s: float, viscous_n_s_m: float
) -> float:
    """Equation (4) at constant speed v != 0, N, with the parameters of v's direction; 0 at v =
    0.
    """
    if v == 0.0:
        return 0.0
    level = stribeck_level(abs(v), coulomb_n, static_n, stribeck_m_s)
    return viscous_n_s_m * v + math.copysign(level, v)


def speeds_both_ways() -> Array:
    """Set points (n), m: each speed out and back at three places of the stroke, soft ramps
    between.
    """
    parts, at = [np.full(500, PLACES_M[0])], PLACES_M[0]
    for place in PLACES_M:
        way = np.linspace(at, place, max(int(abs(place - at) / TRANSIT_M_S * RATE_HZ), 2))
        parts.append(way)
        for speed in SPEEDS_M_S:
            hold = int(RATE_HZ * min(3.0, max(0.02 / speed, PLATEAU_S)))
            out = place + speed * np.arange(hold) / RATE_HZ
            parts += [out, out[::-1], np.full(200, place)]
        at = place
    raw = np.concatenate(parts)
    return np.convolve(np.pad(raw, 50, "edge"), np.ones(101) / 101, "valid")


@dataclass(frozen=True)
class Found:
    """The run and what was identified on it."""

    trace: Trace
    identification: Identification


@once_per_machine
def identified() -> Found:
    """Friction (5) of the declared leg, from its constant speeds."""
    trace = run(speeds_both_ways(), seed=8)
    zero = np.zeros_like(trace.time_s)
    recording = recording_of(
        trace.time_s, trace.position_m, trace.read_a_pa, trace.read_b_pa, zero, KNOWN, "foot-in-air"
    )
    return Found(trace, identify([recording], KNOWN))


def velocity(trace: Trace) -> Array:
    """Speed from the encoder's counts, smoothed with a standard deviation of 8 ms, m/s."""
    return np.asarray(np.gradient(smooth(trace.encoder_m, 8.0)) * RATE_HZ)


def by_speed(trace: Trace) -> tuple[Array, Array, Array]:
    """(speed m/s, friction N, position m) at plateaus: means of 0.1 s in which the set point has
    one speed.

    Friction is (3) plus the frame's weight, as nothing accelerates there.
    """
    wanted = np.gradient(trace.reference_m) * RATE_HZ
    speed, friction, position = [], [], []
    for index in range(0, len(wanted) - 400, 100):
        part = slice(index, index + 400)
        if np.ptp(wanted[part]) < 1e-6 and abs(wanted[index]) > 1e-3:
            late = slice(index + 300, index + 400)
            if abs(np.ptp(trace.position_m[late]) / (0.1 * abs(wanted[index])) - 1.0) > 0.2:
                continue  # has not broken away yet
            speed.append(float(wanted[index]))
            friction.append(float(trace.two_chamber_n[late].mean()) + MASS_KG * GRAVITY_M_S2)
            position.append(float(trace.position_m[late].mean()))
    return np.array(speed), np.array(friction), np.array(position)


def slopes_apart(speed: Array, friction: Array) -> float:
    """Difference of the slopes of |friction| (N) over |speed| (m/s) out and in, over its standard
    error, 1.

    Of plateaus above VISCOUS_FROM_M_S, where the Stribeck part has faded.
    """
    found = []
    for way in (1.0, -1.0):
        fast = way * speed > VISCOUS_FROM_M_S
        line, covariance = np.polyfit(way * speed[fast], way * friction[fast], 1, cov=True)
        found.append((line[0], covariance[0, 0]))
    (out, out_variance), (back, back_variance) = found
    return float(abs(out - back) / np.sqrt(out_variance + back_variance))


def stribeck_drop(parameters: Array) -> float:
    """Friction of one side at 1 mm/s less its minimum up to 0.12 m/s, N: above 0 where the curve
    first falls.
    """
    speeds = np.linspace(0.001, 0.12, 400)
    level = curve(parameters, speeds)
    return float(level[0] - level.min())


def declared_friction() -> list[float]:
    """(5)'s numbers as the machine has them: viscous, Coulomb, static, Stribeck; out, then in."""
    cylinder = chosen().machine().vertical_cylinder
    units = {"viscous": "n_s_m", "coulomb": "n", "static": "n", "stribeck": "m_s"}
    return [
        float(getattr(cylinder, f"{name}_{way}_{unit}"))
        for way in ("out", "in")
        for name, unit in units.items()
    ]


def _row(found: Any, true: float) -> list[str]:
    """A number as identified, and as declared."""
    low, high = found.interval90
    interval = f"{low:.4g} to {high:.4g}"
    shown = found.why or "yes"
    return [found.name, f"{found.value:.4g}", interval, f"{true:.4g}", found.unit, shown]


def experiment() -> Result:
    """Identify, compare with the declared friction and with a motion that was not used."""
    found = identified()
    values = eight(found.identification.model.friction)
    parameters = found.identification.parameters
    v, friction, position = by_speed(found.trace)
    slope = parameters[0].value, parameters[4].value
    spread = _spread_by_position(v, friction, position)
    sine = in_the_air()
    fast = np.abs(velocity(sine)) > 5e-3
    said = friction_force(found.identification.model.friction, velocity(sine))
    error = rms((said - sine.friction_n)[fast]) / rms(sine.friction_n[fast])
    true = declared_friction()
    grid = np.linspace(0.001, 0.125, 200)
    declared = [
        np.array(
            [steady_friction(sign * speed, coulomb, static, stribeck, viscous) for speed in grid]
        )
        for sign, (viscous, coulomb, static, stribeck) in ((1.0, true[:4]), (-1.0, true[4:]))
    ]
    return Result(
        {
            "drop_out": stribeck_drop(values[:4]),
            "drop_in": stribeck_drop(values[4:]),
            "slopes": slopes_apart(v, friction),
            "spread": spread,
            "sinusoid": float(error),
        },
        {
            "speeds": [
                Line(v * 1e3, friction, "plateaus", 0, "."),
                Line(grid * 1e3, curve(values[:4], grid), "identified (5)", 1),
                Line(-grid * 1e3, -curve(values[4:], grid), "", 1),
                Line(grid * 1e3, declared[0], "declared, mid-stroke, without pressure", 3, "--"),
                Line(-grid * 1e3, declared[1], "", 3, "--"),
            ],
            "places": [
                Line(position[at], friction[at], f"out, {speed} mm/s", colour, ".")
                for colour, speed in enumerate((4, 20))
                for at in [np.abs(v / (1e-3 * speed) - 1.0) < 0.03]
            ],
        },
        {"parameters": [_row(*pair) for pair in zip(parameters, true, strict=True)]},
        {
            "speeds": len(SPEEDS_M_S),
            "slowest_mm_s": SPEEDS_M_S[0] * 1e3,
            "fastest_mm_s": SPEEDS_M_S[-1] * 1e3,
            "places": len(PLACES_M),
            "slope_out": slope[0],
            "slope_in": slope[1],
        },
    )


def _spread_by_position(speeds: Array, friction: Array, position: Array) -> float:
    """Median over speeds of (range of |friction| between the three places) / mean."""
    out = []
    for speed in np.unique(np.round(speeds, 4)):
        at = np.abs(speeds - speed) < 1e-4
        means = [
            np.abs(friction[at & (np.abs(position - place - 0.02) < 0.05)]).mean()
            for place in PLACES_M
            if (at & (np.abs(position - place - 0.02) < 0.05)).any()
        ]
        if len(means) == len(PLACES_M):
            out.append(float(np.ptp(means) / np.mean(means)))
    return float(np.median(out)) if out else float("nan")
