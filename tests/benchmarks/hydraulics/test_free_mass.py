"""Hydraulics and a mass that moves freely: no damper of the coupling's own, the oil column's
frequency, Radau.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from testbed.benchmarks.hydraulics.free_mass import (
    FRAME_KG,
    FREE_MOTIONS,
    QUARTER_KG,
    FreeDifference,
    FreeRig,
    compare_free,
)
from testbed.laws.oil import effective_bulk_modulus
from testbed.machine.names import GRAVITY_M_S2

LOSSLESS = ("friction", "leakage", "hose")


def _sealed(mass_kg: float, position_m: float, hoses: bool = False) -> FreeRig:
    """A leg with shut valves and nothing that takes energy, moving at 1 mm/s: 1 t rests on it, the
    frame hangs.
    """
    load = (mass_kg if mass_kg == QUARTER_KG else -mass_kg) * GRAVITY_M_S2
    rig = FreeRig.at_rest(mass_kg, load, position_m, LOSSLESS, hoses)
    rig.params["valve"]["locked"] = 1.0
    rig.masses["rate"] = 1e-3
    return rig


def _oil_stiffness(rig: FreeRig) -> float:
    """A^2 / (V / K + E) of both chambers with their hoses, N/m."""
    p, axis, x = rig.params[0], rig.axes[0], float(rig.masses[0].position)
    total = 0.0
    for own, chamber, length in ((p.a, axis.a, x), (p.b, axis.b, p.stroke - x)):
        bulk = effective_bulk_modulus(chamber.pressure, p.oil.bulk_modulus, p.oil.air)
        room = own.dead_volume + own.area * length
        total += own.area**2 / (room / bulk + own.hose_elasticity)
    return total


def _ringing(rig: FreeRig, dt: float, seconds: float = 2.0) -> tuple[float, float]:
    """Frequency (Hz) and damping (N s/m) of the free mass, from the peaks of its swing."""
    steps = round(seconds / dt)
    load = float(rig.masses[0].load)
    swing: Any = rig.run(np.zeros(steps), np.full(steps, load), dt)["position"]
    swing = swing - swing.mean()
    before, peak, after = swing[:-2], swing[1:-1], swing[2:]
    at = np.flatnonzero((peak > before) & (peak >= after))
    off = 0.5 * (before - after)[at] / (before - 2.0 * peak + after)[at]
    times = dt * (at + off)
    heights = peak[at] - 0.25 * (before - after)[at] * off
    decay = -np.polyfit(times, np.log(heights), 1)[0]
    return (len(at) - 1) / (times[-1] - times[0]), 2.0 * float(rig.masses[0].mass) * decay


@pytest.mark.parametrize("position_m", [0.05, 0.25, 0.45])
@pytest.mark.parametrize(("mass_kg", "allowed"), [(QUARTER_KG, 300.0), (FRAME_KG, 600.0)])
def test_a_frictionless_sealed_leg_rings_undamped(
    mass_kg: float, allowed: float, position_m: float
) -> None:
    _, damping = _ringing(_sealed(mass_kg, position_m), 1e-3)
    assert abs(damping) < 0.02 * allowed


@pytest.mark.parametrize("hoses", [False, True])
@pytest.mark.parametrize("position_m", [0.05, 0.25, 0.45])
def test_a_tonne_rings_at_the_oil_column_s_frequency(position_m: float, hoses: bool) -> None:
    rig = _sealed(QUARTER_KG, position_m, hoses)
    expected = math.sqrt(_oil_stiffness(rig) / QUARTER_KG) / (2.0 * math.pi)
    found, _ = _ringing(rig, 1e-3)
    assert found == pytest.approx(expected, rel=5e-3)
    assert 15.0 < found < 40.0


def test_the_frame_s_frequency_is_a_leapfrog_s() -> None:
    """Near a tenth of the step's rate a leapfrog rings faster: w = 2 / dt asin(w0 dt / 2)."""
    rig = _sealed(FRAME_KG, 0.25)
    true = math.sqrt(_oil_stiffness(rig) / FRAME_KG)
    expected = 2.0 / 1e-3 * math.asin(0.5e-3 * true) / (2.0 * math.pi)
    assert _ringing(rig, 1e-3)[0] == pytest.approx(expected, rel=2e-3)


def test_viscous_friction_is_the_only_damper_that_is_declared() -> None:
    rig = _sealed(QUARTER_KG, 0.25)
    for way in ("outward", "inward"):
        rig.params["seal"][way]["viscous"] = 5000.0
    _, damping = _ringing(rig, 1e-3, 0.6)
    # Read off the peaks it is 1.1 % too much; the rate told ahead adds 3/8 (w dt)^2.
    assert damping == pytest.approx(5000.0 * float(rig.axes[0].thinning), rel=0.025)


@pytest.mark.parametrize("end", [-1.0, 1.0])
def test_the_frame_alone_comes_to_rest_on_a_stop(end: float) -> None:
    """The stiffest contact on the smallest mass: what tells its rate ahead must not drive it."""
    weight = -FRAME_KG * GRAVITY_M_S2
    rig = FreeRig.at_rest(FRAME_KG, weight, 0.01 if end < 0.0 else 0.49, hoses=True)
    steps = 1500
    forces = rig.run(np.full(steps, end), np.full(steps, weight))["force"]
    assert float(rig.masses[0].position) < 0.0 if end < 0.0 else rig.masses[0].position > 0.5
    assert np.abs(forces).max() > 2000.0
    assert np.ptp(forces[-100:]) < 1.0


@pytest.mark.slow
@pytest.mark.parametrize("name", FREE_MOTIONS)
def test_a_free_mass_moves_as_in_radau(name: str) -> None:
    found = compare_free(name)
    assert found.holds, found


@pytest.mark.slow
def test_stuck_ramps_converge_with_the_step() -> None:
    whole, half = compare_free("stuck ramps"), compare_free("stuck ramps", 5e-4)
    assert whole.holds
    assert half.rms_n < 0.6 * whole.rms_n


def test_a_worse_coupling_would_not_pass() -> None:
    good = FreeDifference(10.0, 60.0, 1e-6)
    assert good.holds
    assert not replace(good, rms_n=21.0).holds
    assert not replace(good, worst_n=121.0).holds
