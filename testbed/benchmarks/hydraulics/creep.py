"""A piston stuck below break-away behind shut valves: how far it goes, and how much of that its
leakage explains.

Explained is the way of an ideal piston: the oil that the leaks carried (their laws integrated over
the pressures, beside the kernel's own books) and the hoses took fixes the chambers' pressures as
functions of the extension; the piston stands where they balance the load and a dry friction that
gives like a spring up to its level and no further.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from testbed.benchmarks.hydraulics.balance import STEP_S, machine
from testbed.benchmarks.hydraulics.free_mass import FreeRig, Mass
from testbed.formats.arrays import Array
from testbed.laws.friction import stribeck_level
from testbed.laws.initial import start_axes, start_supply
from testbed.laws.oil import ATMOSPHERE_PA, VAPOUR_PA, specific_volume

CARRIED_N, MASS_KG, SETTLE_S, LOOK_S = 7000.0, 100.0, 1.0, 0.01
MIDDLE_M = 0.25


@dataclass(frozen=True)
class Creep:
    """A piston stuck below break-away behind shut valves, watched for `seconds`; + out."""

    seconds: float
    load_n: float
    """Added to what it carried in equilibrium, against its friction."""
    moved_m: float
    leakage_explains_m: float
    beyond_m: float
    """How far it went otherwise than leakage explains (the largest of all times)."""


def creep(seconds: float = 60.0, share: float = 0.5, leakage: bool = True) -> Creep:
    """A vertical axis at rest, then loaded by `share` of its break-away more, valves shut for
    `seconds`.
    """
    params, unit = machine()
    params = params[2:3].copy()
    p = params[0]
    p.valve.locked = 1.0
    if not leakage:
        p.inner_leakage = p.outer_leakage = 0.0
    masses = Mass.zeros()
    masses["mass"], masses["position"] = MASS_KG, MIDDLE_M
    axes = start_axes(params, masses["position"], np.array([CARRIED_N]))
    rig = FreeRig(axes, params, start_supply(unit, 40.0, 0.06), unit, masses)
    axis, rod = axes[0], masses[0]
    extra = share * float(p.seal.inward.coulomb + p.seal.inward.static)
    load = CARRIED_N + extra

    def run(span_s: float) -> None:
        steps = round(span_s / STEP_S)
        rig.run(np.zeros(steps), np.full(steps, load))

    run(SETTLE_S)
    start, held = float(rod.position), float(axis.friction)
    hoses = np.array([p.a.hose_capacity, p.b.hose_capacity])
    oil, hose = _both(axis, "oil"), _both(axis, "hose_pressure")
    leaked, flow, explained, beyond = np.zeros(2), _leaks(axis, p, unit), start, 0.0
    for index in range(round(seconds / LOOK_S)):
        run(LOOK_S)
        before, flow = flow, _leaks(axis, p, unit)
        leaked += 0.5 * LOOK_S * (before + flow)
        if index % 10 != 9:
            continue
        now = oil + leaked - hoses * (_both(axis, "hose_pressure") - hose)
        level = _level(axis, p, float(rod.position), float(rod.rate))
        explained = _stands_at(now, p, load, held, start, -level)
        beyond = max(beyond, abs(float(rod.position) - explained))
    return Creep(seconds, extra, float(rod.position) - start, explained - start, beyond)


def _both(axis: Any, name: str) -> Array:
    """A quantity of both chambers, (2)."""
    return np.array([axis.a[name], axis.b[name]])


def _leaks(s: Any, p: Any, unit: Any) -> Array:
    """Leakage into chambers A and B, m3/s: across the piston and outwards, valve and edges shut."""
    across = s.leaking * p.inner_leakage * (s.a.pressure - s.b.pressure)
    out = s.leaking * p.outer_leakage * (_both(s, "pressure") - unit.tank_pressure)
    return np.asarray(np.array([-across, across]) - out)


def _level(s: Any, p: Any, x: float, v: float) -> float:
    """The friction at which the piston slides inwards, N: (4) with its parts along the stroke, by
    pressure, by rest.
    """
    fc = p.seal.inward.coulomb * (1.0 + p.seal.position_slope * (x / p.stroke - 0.5))
    fc += p.seal.pressure_coefficient * (s.a.pressure + s.b.pressure - 2.0 * ATMOSPHERE_PA)
    return float(
        stribeck_level(
            abs(v), fc, p.seal.inward.static + fc * s.seal.dwell, p.seal.inward.stribeck_speed
        )
        + p.seal.inward.viscous * abs(v)
    )


def _stands_at(oil: Array, p: Any, load: float, held: float, start: float, level: float) -> float:
    """Extension, m, at which the oil of both chambers balances load and friction, by bisection.

    Friction: `held` (N) at `start`, from there a spring with the bristle's stiffness, never beyond
    `level` (inwards).
    """

    def push(x: float) -> float:
        pa = _pressure(p.a.dead_volume + p.a.area * x, oil[0], p.a.hose_elasticity, p)
        left = p.stroke - x
        pb = _pressure(p.b.dead_volume + p.b.area * left, oil[1], p.b.hose_elasticity, p)
        friction = max(held + p.seal.bristle_stiffness * (x - start), level)
        gauge = pa * p.a.area - pb * p.b.area - (p.a.area - p.b.area) * ATMOSPHERE_PA
        return float(gauge - friction - load)

    low, high = start - 0.1, start + 0.1
    for _ in range(38):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if push(middle) > 0.0 else (low, middle)
    return 0.5 * (low + high)


def _pressure(volume: float, oil: float, elasticity: float, p: Any) -> float:
    """Absolute pressure, Pa, of `oil` in a volume whose hose widens, m3: Newton's iteration."""
    pressure = 5e6
    for _ in range(30):
        found, slope = specific_volume(pressure, p.oil.bulk_modulus, p.oil.air)
        room = volume + elasticity * (pressure - ATMOSPHERE_PA)
        step = (room - oil * found) / (oil * slope - elasticity)
        pressure = max(pressure + step, 0.5 * pressure, VAPOUR_PA)
        if abs(step) < 1e-3:
            break
    return float(pressure)
