"""When a piston behind a valve sticks and slips: the condition, and a map of it beside the
simulation.

The valve sets the mean speed v; mass m rides on the oil's spring k. Sliding, a small change of
speed dv meets friction with the bristle's lag (friction.py, linear in dv; s = i w, lambda = K v /
g, g(v) the Stribeck curve, K, D stiffness and damping of the bristle, sigma the viscous part):

    dF / dv = sigma + g'(v) (lambda / (s + lambda)) (1 + s D / K)

At the resonance w = sqrt(k / m) its real part, with the oil's own damping, is the net damping

    N(v) = sigma + c_oil + g'(v) (lambda^2 + lambda w^2 D / K) / (lambda^2 + w^2),   c_oil = sum_i
    k_i^2 C_i / (A_i w)^2

C_i: leakage and valve slope of chamber i, k_i its spring. Stick-slip grows where N < 0: the falling
curve must be steeper than viscous friction and oil damping, |g'| > sigma + c_oil, and the bristle
must follow within a swing, lambda > w: the piston has to pass the pre-sliding length g / K in less
than m's swing on the oil takes per radian. The first bounds the speed from above, the second from
below. N < 0 is necessary for it; whether the swing grows until the piston stands is up to the
position loop, the hoses and the valve, which N leaves out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from testbed.benchmarks.paper.leg import COLD_DEGC, MASS_KG, chosen, run
from testbed.benchmarks.paper.leg import RATE_HZ as RATE
from testbed.formats.arrays import Array
from testbed.laws.oil import ATMOSPHERE_PA, effective_bulk_modulus
from testbed.machine.model import Machine
from testbed.machine.names import GRAVITY_M_S2
from testbed.report.page import Table
from testbed.world.hydraulic_parameters import bulk_modulus_pa

SPEEDS_M_S = (1.0e-3, 2.0e-3, 3.0e-3, 4.0e-3, 5.0e-3, 7.0e-3, 10.0e-3)
PRE_SLIDING_M = (2.7e-5, 1.0e-5, 5.0e-6, 3.0e-6)
"""Way over which friction builds up: g / K, at G_N."""
G_N = 800.0
STATIC_N = (100.0, 180.0, 300.0, 450.0)
MIDDLE_M = 0.25
"""Where along the stroke."""
SOME = 3
"""Slips in one way of four wanted millimetres a second from which they count as sustained."""


def slow_reversals(cycles: int = 2, speed_m_s: float = 1.0e-3, travel_m: float = 0.010) -> Array:
    """Set points (n), m: out and back at an even speed, after a second at rest."""
    way = np.arange(0.0, travel_m, speed_m_s / RATE)
    return np.concatenate([np.full(1000, MIDDLE_M), *[MIDDLE_M + np.r_[way, way[-2::-1]]] * cycles])


def stick_slips(speed_m_s: Array, wanted_m_s: float) -> int:
    """Times at which the piston stands (below 10 % of the wanted speed) and then slips (above 200 %
    of it).
    """
    count, stuck = 0, False
    for v in np.abs(speed_m_s) / wanted_m_s:
        if v < 0.1:
            stuck = True
        elif v > 2.0 and stuck:
            count, stuck = count + 1, False
    return count


def slips_at(
    speed_m_s: float, changes: Mapping[str, float] | None = None, seconds: float = 4.0
) -> int:
    """Stick-slips while the leg goes out for `seconds` and back once at `speed_m_s`, true speed,
    the start left out.
    """
    trace = run(slow_reversals(1, speed_m_s, seconds * speed_m_s), changes, seed=9).after(1.5)
    return stick_slips(trace.speed_m_s, speed_m_s)


def back_pressures_pa(machine: Machine) -> tuple[float, float]:
    """Gauge pressures of A and B while the frame goes out in the air at an even speed, friction
    left out.

    The same opening meters A_A v from the supply and A_B v to the tank: pB - pt = ratio^2 (ps -
    pA), while pA A_A - pB A_B = -m g.
    """
    unit, valve, cylinder = machine.power_unit, machine.valve, machine.vertical_cylinder
    area_a = cylinder.areas_m2[0]
    alpha = 1.0 - (cylinder.rod_m / cylinder.bore_m) ** 2
    hangs = MASS_KG * GRAVITY_M_S2 / area_a
    ratio = (alpha * valve.edge_pa / valve.edge_bt) ** 2
    supply = unit.ready_pressure_pa
    back_b = (unit.tank_pressure_pa + ratio * (supply + hangs)) / (1.0 + ratio * alpha)
    back_a = alpha * back_b - hangs
    if unit.load_sensing and back_a + unit.load_sensing_margin_pa > supply:
        back_b = unit.tank_pressure_pa + ratio * unit.load_sensing_margin_pa
        back_a = alpha * back_b - hangs
    return max(back_a, 0.0), back_b


def net_damping_n_s_m(speed_m_s: float, changes: Mapping[str, float] | None = None) -> float:
    """N(v) of the vertical cylinder going out, N s/m; negative: steady sliding gives way to
    stick-slip.
    """
    p = chosen().machine(changes)
    cyl, seal, oil, valve = p.vertical_cylinder, p.seal, p.oil, p.valve
    area_a = math.pi / 4 * cyl.bore_m**2
    areas = area_a, area_a - math.pi / 4 * cyl.rod_m**2
    volumes = (
        cyl.dead_volume_a_m3 + areas[0] * MIDDLE_M,
        cyl.dead_volume_b_m3 + areas[1] * (cyl.stroke_m - MIDDLE_M),
    )
    back_a, back_b = back_pressures_pa(p)
    pressure_a, pressure_b = back_a + ATMOSPHERE_PA, back_b + ATMOSPHERE_PA
    springs, oil_damping = 0.0, 0.0
    bulk = bulk_modulus_pa(oil, COLD_DEGC)
    leaks = (
        valve.edge_pa_leakage_m3_s_pa + valve.edge_at_leakage_m3_s_pa,
        valve.edge_pb_leakage_m3_s_pa + valve.edge_bt_leakage_m3_s_pa,
    )
    pressures = pressure_a, pressure_b
    for area, volume, pressure, leak in zip(areas, volumes, pressures, leaks, strict=True):
        soft = volume / effective_bulk_modulus(pressure, bulk, oil.entrained_air)
        k = area**2 / (soft + oil.hose_elasticity_m3_pa)
        # an edge that passes q at the drop d has the slope q / (2 d)
        c = oil.internal_leakage_m3_s_pa + oil.outer_leakage_m3_s_pa + leak
        c *= math.exp(seal.viscosity_rate_1_k * (COLD_DEGC - oil.declared_at_degc))
        c += area * speed_m_s / (2.0 * max(pressure - ATMOSPHERE_PA, ATMOSPHERE_PA))
        springs, oil_damping = springs + k, oil_damping + k**2 * c / area**2
    w2 = springs / MASS_KG
    coulomb, static, c_s = cyl.coulomb_out_n, cyl.static_out_n, cyl.stribeck_out_m_s
    coulomb += seal.pressure_coefficient_m2 * (pressure_a + pressure_b - 2.0 * ATMOSPHERE_PA)
    falling = static * math.exp(-speed_m_s / c_s)
    rate = seal.bristle_stiffness_n_m * speed_m_s / (coulomb + falling)
    lag = (rate**2 + rate * w2 * seal.bristle_damping_n_s_m / seal.bristle_stiffness_n_m) / (
        rate**2 + w2
    )
    return float(cyl.viscous_out_n_s_m + oil_damping / w2 - falling / c_s * lag)


def seal_of(pre_sliding_m: float, static_n: float) -> dict[str, float]:
    """Changes of roboclimber.yaml: pre-sliding length at G_N, and break-away above Coulomb friction
    both ways.
    """
    return {
        "seal.bristle_stiffness_n_m": G_N / pre_sliding_m,
        "vertical_cylinder.static_out_n": static_n,
        "vertical_cylinder.static_in_n": static_n * 160.0 / 180.0,
    }


def sensitivity(oil: Mapping[str, float], title: str) -> Table:
    """Speeds with sustained stick-slip, simulated and by the condition, over pre-sliding length and
    break-away.
    """
    rows = []
    for pre in PRE_SLIDING_M:
        row = [f"{pre * 1e6:.0f}"]
        for static in STATIC_N:
            changes = seal_of(pre, static) | dict(oil)
            seen = [v for v in SPEEDS_M_S if slips_at(v, changes) >= SOME]
            said = [v for v in SPEEDS_M_S if net_damping_n_s_m(v, changes) < 0.0]
            row.append(f"{_span(seen)} ({_span(said)})")
        rows.append(row)
    return Table(title, ["pre-sliding [um]", *(f"break-away +{s:.0f} N" for s in STATIC_N)], rows)


def _span(speeds: list[float]) -> str:
    """A set of speeds as its ends in mm/s."""
    if not speeds:
        return "none"
    low, high = (f"{v * 1e3:g}" for v in (speeds[0], speeds[-1]))
    return low if low == high else f"{low} to {high}"
