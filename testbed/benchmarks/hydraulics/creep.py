"""A piston stuck below break-away behind shut valves: how far it goes, and how much of that its leakage explains.

Explained is the way of an ideal piston: the oil that the leaks carried (their laws integrated over the pressures,
beside the kernel's own books) and the hoses took fixes the chambers' pressures as functions of the extension; the
piston stands where they balance the load and a dry friction that gives like a spring up to its level and no further.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from testbed.benchmarks.hydraulics.balance import STEP_S, Array, machine
from testbed.compiled import njit
from testbed.laws import columns as c
from testbed.laws.friction import stribeck_level
from testbed.laws.hydraulics import hydraulic_step
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


@njit
def loaded_loop(
    axes: Any,
    params: Any,
    supply: Any,
    unit: Any,
    x: Any,
    v: Any,
    load: float,
    steps: int,
    zero: Any,
) -> None:
    """A mass on the rod of a shut axis under `load` (N, inwards), stepped as the engine does: rate, then position."""
    for _ in range(steps):
        hydraulic_step(axes, params, supply, unit, x, v, zero, zero, zero, STEP_S, 2)
        v[0] += STEP_S * (axes[0, c.FORCE] - load) / MASS_KG
        x[0] += STEP_S * v[0]


def creep(seconds: float = 60.0, share: float = 0.5, leakage: bool = True) -> Creep:
    """A vertical axis at rest, then loaded by `share` of its break-away more, valves shut for `seconds`."""
    params, unit = machine()
    params = params[2:3].copy()
    params[0, c.LOCKED] = 1.0
    if not leakage:
        params[0, [c.LEAK_I, c.LEAK_O]] = 0.0
    p, x, v = params[0], np.array([MIDDLE_M]), np.zeros(1)
    axes, supply = start_axes(params, x, np.array([CARRIED_N])), start_supply(unit, 40.0, 0.06)
    extra = share * float(p[c.FC_NEG] + p[c.FS_NEG])
    load = CARRIED_N + extra

    def run(span_s: float) -> None:
        loaded_loop(axes, params, supply, unit, x, v, load, round(span_s / STEP_S), np.zeros(1))

    run(SETTLE_S)
    start, held = float(x[0]), float(axes[0, c.FRICTION])
    hoses = p[[c.HOSE_CAP, c.HOSE_CAP_B]]
    oil, hose = axes[0, [c.OIL_A, c.OIL_B]].copy(), axes[0, [c.HOSE_P, c.HOSE_P_B]].copy()
    leaked, flow, explained, beyond = np.zeros(2), _leaks(axes[0], p, unit), start, 0.0
    for k in range(round(seconds / LOOK_S)):
        run(LOOK_S)
        before, flow = flow, _leaks(axes[0], p, unit)
        leaked += 0.5 * LOOK_S * (before + flow)
        if k % 10 != 9:
            continue
        now = oil + leaked - hoses * (axes[0, [c.HOSE_P, c.HOSE_P_B]] - hose)
        explained = _stands_at(
            now, p, load, held, start, -_level(axes[0], p, float(x[0]), float(v[0]))
        )
        beyond = max(beyond, abs(float(x[0]) - explained))
    return Creep(seconds, extra, float(x[0]) - start, explained - start, beyond)


def _leaks(s: Array, p: Array, unit: Array) -> Array:
    """Leakage into chambers A and B, m3/s: across the piston and outwards, valve and edges shut."""
    across = p[c.LEAK_I] * (s[c.P_A] - s[c.P_B])
    out = p[c.LEAK_O] * (s[[c.P_A, c.P_B]] - unit[c.TANK_P])
    return np.asarray(np.array([-across, across]) - out)


def _level(s: Array, p: Array, x: float, v: float) -> float:
    """The friction at which the piston slides inwards, N: (4) with its parts along the stroke, by pressure, by rest."""
    fc = p[c.FC_NEG] * (1.0 + p[c.FR_POSITION] * (x / p[c.STROKE] - 0.5))
    fc += p[c.FR_PRESSURE] * (s[c.P_A] + s[c.P_B] - 2.0 * ATMOSPHERE_PA)
    return float(
        stribeck_level(abs(v), fc, p[c.FS_NEG] + fc * s[c.DWELL], p[c.CS_NEG])
        + p[c.VISC_NEG] * abs(v)
    )


def _stands_at(oil: Array, p: Array, load: float, held: float, start: float, level: float) -> float:
    """Extension, m, at which the oil of both chambers balances load and friction, by bisection.

    Friction: `held` (N) at `start`, from there a spring with the bristle's stiffness, never beyond `level` (inwards).
    """

    def push(x: float) -> float:
        pa = _pressure((p[c.DEAD_A] + p[c.AREA_A] * x) / oil[0], p)
        pb = _pressure((p[c.DEAD_B] + p[c.AREA_B] * (p[c.STROKE] - x)) / oil[1], p)
        friction = max(held + p[c.BRISTLE_K] * (x - start), level)
        gauge = pa * p[c.AREA_A] - pb * p[c.AREA_B] - (p[c.AREA_A] - p[c.AREA_B]) * ATMOSPHERE_PA
        return float(gauge - friction - load)

    low, high = start - 0.1, start + 0.1
    for _ in range(38):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if push(middle) > 0.0 else (low, middle)
    return 0.5 * (low + high)


def _pressure(nu: float, p: Array) -> float:
    """Absolute pressure, Pa, at which one standard volume takes up `nu`: Newton's iteration."""
    pressure = 5e6
    for _ in range(30):
        found, slope = specific_volume(pressure, p[c.BULK], p[c.AIR])
        step = (nu - found) / slope
        pressure = max(pressure + step, 0.5 * pressure, VAPOUR_PA)
        if abs(step) < 1e-3:
            break
    return float(pressure)
