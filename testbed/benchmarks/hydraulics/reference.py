"""The laws of the hydraulics once more, as one continuous right-hand side for SciPy's stiff
solvers.

Written apart from the kernel: states are scaled oil volumes, pressures come from a bracketed root,
the amplifier and the play operator from their closed form on a held command. Units inside: volumes
in cm3, else SI.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.formats.arrays import Array
from testbed.formats.records import Records
from testbed.laws.axis_records import AxisParameters
from testbed.laws.supply import PowerUnit
from testbed.machine.build import build_machine
from testbed.machine.model import Machine
from testbed.machine.provenance import SetName

if TYPE_CHECKING:
    from testbed.benchmarks.hydraulics.benchmark import Manoeuvre

P0, PV, CM3 = 1.0e5, 1.0e3, 1.0e-6
SET: SetName = "original"
"""The machine whose laws stand here: its supply is constant and its valves hold no load."""
SEAL = ("seal.elastic_share",)
OIL = ("oil.bulk_modulus_pa", "oil.hose_elasticity_m3_pa", "oil.hose_elasticity_b_m3_pa")
"""Numbers of the default machine that it has all the same."""
N_AXIS = 9
"""States of an axis: oil A, B (cm3), hose pressures A, B (MPa), spool, spool rate / 100, bristle
(mm), dwell, integral of the force (N s / 100)."""
N_SUPPLY = 2
"""States of the unit: oil in the line (cm3), pump stroke."""


def machine_of_both(hoses: bool = True) -> Machine:
    """The machine on which kernel and reference are compared, the widening of its hoses apart from
    its oil or within the bulk modulus.
    """
    default, shared = build_machine(), (*SEAL, *OIL) if hoses else SEAL
    return build_machine({path: default.quantity(path).value for path in shared}, of_set=SET)


@njit
def volume_of_one(p: float, bulk: float, air: float) -> float:
    """nu(p)."""
    x = (p - P0) / bulk
    return float((1.0 - air) * (1.0 - x + x * x / 2.0) + air * (P0 / p) ** (1.0 / 1.4))


@njit
def chamber_pressure(volume: float, oil: float, fluid: tuple[float, float], hose: float) -> float:
    """Root of oil nu(p) = volume + hose (p - p0) in ln p, by Newton inside a bracket; vapour
    pressure in a void. `fluid`: bulk modulus and air; hose: its elasticity, m3/Pa.
    """
    bulk, air = fluid
    if volume + hose * (PV - P0) >= oil * volume_of_one(PV, bulk, air):
        return PV
    low, high = math.log(PV), math.log(1.0e9)
    y = math.log(5.0e6)
    for _ in range(200):
        p = math.exp(y)
        f = volume_of_one(p, bulk, air) - (volume + hose * (p - P0)) / oil
        if f > 0.0:
            low = y
        else:
            high = y
        slope = p * (-(1.0 - air) * (1.0 - (p - P0) / bulk) / bulk) - air / 1.4 * (P0 / p) ** (
            1.0 / 1.4
        )
        slope -= p * hose / oil
        new = y - f / slope
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - y) < 1e-15 * abs(y):
            break
        y = new
    return math.exp(y)


@njit
def line_pressure(oil: float, u: PowerUnit) -> float:
    """Pressure of the supply line that holds `oil` m3: bisection and secant on a monotone
    function.
    """
    low, high = PV, 1.0e8
    for _ in range(200):
        p = 0.5 * (low + high)
        acc = (
            u.accumulator_volume * (1.0 - u.accumulator_precharge / p)
            if p > u.accumulator_precharge
            else 0.0
        )
        if (u.line_volume + acc) / volume_of_one(p, u.oil.bulk_modulus, u.oil.air) > oil:
            high = p
        else:
            low = p
        if high - low < 1e-9 * p:
            break
    return 0.5 * (low + high)


@njit
def enthalpy_between(p1: float, p2: float, bulk: float, air: float) -> float:
    """Integral of nu from p1 to p2, J/m3."""
    x1, x2, k = (p1 - P0) / bulk, (p2 - P0) / bulk, 1.0 - 1.0 / 1.4
    liquid = bulk * (1.0 - air) * ((x2 - x1) - (x2**2 - x1**2) / 2.0 + (x2**3 - x1**3) / 6.0)
    return float(liquid + air * P0 / k * ((p2 / P0) ** k - (p1 / P0) ** k))


@njit
def edge(k: float, drop: float) -> float:
    """K sign(drop) sqrt|drop|, smoothed below 0.2 bar as the kernel's."""
    return float(k * drop / (drop * drop + 4.0e8) ** 0.25)


@njit
def held_play(t: float, a0: float, u: float, r0: float, width: float, tau: float) -> float:
    """Output of amplifier and play t after the command became u: r0 unless the amplifier's band has
    left it behind.
    """
    a = u + (a0 - u) * math.exp(-t / tau)
    return min(max(r0, a - width), a + width)


@njit
def held_plays(t: float, a0: Array, u: Array, r0: Array, params: Records[AxisParameters]) -> Array:
    """`held_play` of n axes, (n)."""
    out = np.empty(len(u))
    for index in range(len(u)):
        out[index] = held_play(
            t,
            a0[index],
            u[index],
            r0[index],
            params[index].valve.hysteresis,
            params[index].valve.amplifier_lag,
        )
    return out


@njit
def friction_rates(
    p: AxisParameters, x: float, v: float, pa: float, pb: float, z: float, dwell: float, warm: float
) -> tuple[float, float, float]:
    """Friction force (N), dz/dt (m/s), d dwell/dt (1/s): equation (5) with a bristle state."""
    if v >= 0.0:
        fc, fs, cs, sigma = (
            p.seal.outward.coulomb,
            p.seal.outward.static,
            p.seal.outward.stribeck_speed,
            p.seal.outward.viscous,
        )
    else:
        fc, fs, cs, sigma = (
            p.seal.inward.coulomb,
            p.seal.inward.static,
            p.seal.inward.stribeck_speed,
            p.seal.inward.viscous,
        )
    fc = fc * (1.0 + p.seal.position_slope * (x / p.stroke - 0.5)) + p.seal.pressure_coefficient * (
        pa + pb - 2.0 * P0
    )
    fc = max(fc, 1.0e-3)
    rate = 0.0
    if p.seal.dwell_gain > 0.0:
        rate = (p.seal.dwell_gain - dwell) / p.seal.dwell_time - abs(
            v
        ) * p.seal.bristle_stiffness / fc * dwell
        fs = fs + fc * dwell
    g = fc + fs * math.exp(-abs(v) / cs)
    bend = p.seal.bristle_stiffness * abs(z) / g
    share = p.seal.elastic_share
    slip = bend
    if share > 0.0:
        slip = (bend - share) / (1.0 - share) if bend > share and v * z > 0.0 else 0.0
    dz = v - abs(v) * slip * (1.0 if z >= 0.0 else -1.0)
    return p.seal.bristle_stiffness * z + p.seal.bristle_damping * dz + sigma * warm * v, dz, rate


@njit
def stop_force(p: AxisParameters, x: float, v: float) -> float:
    """Cushion and stop at both ends, N, along +x."""
    force = 0.0
    for side in (1.0, -1.0):
        gap = x if side > 0.0 else p.stroke - x
        towards = -side * v
        push = 0.0
        if gap < p.ends.cushion_length and towards > 0.0:
            push += p.ends.cushion_damping * towards * (1.0 - gap / p.ends.cushion_length)
        if gap < 0.0:
            push += max(0.0, -p.ends.stop_stiffness * gap + p.ends.stop_damping * towards)
        force += side * push
    return force


@njit
def axis_rates(
    y: Array,
    dy: Array,
    p: AxisParameters,
    x: float,
    v: float,
    target: float,
    ends: tuple[float, float],
    by_warmth: tuple[float, float],
) -> float:
    """Rates of one axis's states; returns what it draws from the supply, m3/s. `ends`: supply's and
    tank's pressure; by_warmth: viscous friction and leakage over the declared.
    """
    ps, pt = ends
    warm, thin = by_warmth
    fluid = p.oil.bulk_modulus, p.oil.air
    room_a = p.a.dead_volume + p.a.area * x
    room_b = p.b.dead_volume + p.b.area * (p.stroke - x)
    pa = chamber_pressure(room_a, y[0] * CM3, fluid, p.a.hose_elasticity)
    pb = chamber_pressure(room_b, y[1] * CM3, fluid, p.b.hose_elasticity)
    o = math.copysign(max(abs(y[4]) - p.valve.dead_band, 0.0), y[4]) / (1.0 - p.valve.dead_band)
    up, down = max(o, 0.0), max(-o, 0.0)
    from_supply_a = edge(p.a.from_supply * up, ps - pa) + thin * p.a.leak_from_supply * (ps - pa)
    from_supply_b = edge(p.b.from_supply * down, ps - pb) + thin * p.b.leak_from_supply * (ps - pb)
    to_tank_a = edge(p.a.to_tank * down, pa - pt) + thin * p.a.leak_to_tank * (pa - pt)
    to_tank_b = edge(p.b.to_tank * up, pb - pt) + thin * p.b.leak_to_tank * (pb - pt)
    inner, outer = thin * p.inner_leakage * (pa - pb), thin * p.outer_leakage
    dy[2] = (pa / 1e6 - y[2]) / p.hose_time
    dy[3] = (pb / 1e6 - y[3]) / p.hose_time
    hose_a, hose_b = p.a.hose_capacity * dy[2] * 1e6, p.b.hose_capacity * dy[3] * 1e6
    dy[0] = (from_supply_a - to_tank_a - inner - outer * (pa - pt) - hose_a) / CM3
    dy[1] = (from_supply_b - to_tank_b + inner - outer * (pb - pt) - hose_b) / CM3
    wn = p.valve.frequency
    dy[4] = 100.0 * y[5]
    dy[5] = (wn * wn * (target - y[4]) - 2.0 * p.valve.damping * wn * 100.0 * y[5]) / 100.0
    friction, dz, dy[7] = friction_rates(p, x, v, pa, pb, y[6] / 1e3, y[7], warm)
    dy[6] = 1e3 * dz
    rod = pa * p.a.area - pb * p.b.area - (p.a.area - p.b.area) * P0
    dy[8] = (rod - friction + stop_force(p, x, v)) / 100.0
    return from_supply_a + from_supply_b


@njit
def unit_rates(y: Array, dy: Array, u: PowerUnit, ps: float, drawn: float, taken: float) -> None:
    """Rates of the power unit's states: y = oil in the line (cm3), pump stroke."""
    pt = u.tank_pressure
    wanted = min(max((u.set_pressure - ps) / u.compensator_band, 0.0), 1.0)
    dy[1] = (wanted - y[1]) / u.compensator_lag
    flow = y[1] * u.pump_flow * u.pump_on
    power = flow * enthalpy_between(pt, ps, u.oil.bulk_modulus, u.oil.air)
    if power > u.pump_power:
        flow *= u.pump_power / power
    relief = max(ps - u.relief_pressure, 0.0) + min(ps - pt, 0.0)
    traction = taken * min(max((ps - pt) / 1.0e5, 0.0), 1.0)
    dy[0] = (flow - drawn - u.relief_slope * relief - u.case_leakage * (ps - pt) - traction) / CM3


@njit
def rates(
    y: Array,
    params: Records[AxisParameters],
    u: PowerUnit,
    x: Array,
    v: Array,
    target: Array,
    taken: float,
    warmth: float,
) -> Array:
    """dy/dt of n axes and the unit; x, v, target (n): extension, rate, what the spool follows."""
    n = x.shape[0]
    dy = np.empty_like(y)
    ps = line_pressure(y[N_AXIS * n] * CM3, u)
    drawn, thin = 0.0, math.exp(u.viscosity_rate * (warmth + u.viscosity_reference - u.declared_at))
    for index in range(n):
        warm = math.exp(-(u.viscosity_rate + params[index].seal.viscosity_rate) * warmth)
        part = slice(N_AXIS * index, N_AXIS * (index + 1))
        drawn += axis_rates(
            y[part],
            dy[part],
            params[index],
            x[index],
            v[index],
            target[index],
            (ps, u.tank_pressure),
            (warm, thin),
        )
    unit_rates(y[N_AXIS * n :], dy[N_AXIS * n :], u, ps, drawn, taken)
    return dy


@njit
def held_rates(
    t: float,
    y: Array,
    params: Records[AxisParameters],
    units: Records[PowerUnit],
    motion: tuple[Array, Array],
    valves: tuple[Array, Array, Array],
    oil: tuple[float, float],
) -> Array:
    """`rates` where the pistons' rates and the commands are held from t = 0 on; units: (1).

    motion: extensions and rates; valves: amplifier, command and play; oil: what traction takes, and
    the warmth.
    """
    (x, v), (amplifier, command, play), (taken, warmth) = motion, valves, oil
    played = held_plays(t, amplifier, command, play, params)
    return rates(y, params, units[0], x + v * t, v, played, taken, warmth)


def pack(axes: NDArray[Any], supply: Any) -> Array:
    """The kernel's state as the reference's."""
    y = np.zeros(N_AXIS * len(axes) + N_SUPPLY)
    for index, axis in enumerate(axes):
        y[N_AXIS * index : N_AXIS * (index + 1)] = (
            axis.a.oil / CM3,
            axis.b.oil / CM3,
            axis.a.hose_pressure / 1e6,
            axis.b.hose_pressure / 1e6,
            axis.valve.spool,
            axis.valve.spool_rate / 100.0,
            axis.seal.bristle * 1e3,
            axis.seal.dwell,
            0.0,
        )
    y[-2:] = supply.oil / CM3, supply.pump_stroke
    return y


@dataclass
class Amplifiers:
    """Amplifier and play operator of n axes on commands held over whole segments."""

    params: NDArray[Any]
    amplifier: Array
    played: Array

    def after(self, t: float, command: Array) -> tuple[Array, Array]:
        """Amplifier and play t seconds after `command` was given, (n) each."""
        out = held_plays(t, self.amplifier, command, self.played, self.params)
        return command + (self.amplifier - command) * np.exp(
            -t / self.params["valve"]["amplifier_lag"]
        ), np.asarray(out)


def solve(
    manoeuvre: Manoeuvre,
    hold_s: float,
    step_s: float,
    *,
    method: str = "Radau",
    rtol: float = 1e-9,
    atol: float = 1e-9,
) -> Array:
    """Mean force of each axis over every `step_s`, N, (steps, n), by SciPy; its commands are held
    `hold_s`.
    """
    from scipy.integrate import solve_ivp

    axes, params, supply, unit = manoeuvre.axes, manoeuvre.params, manoeuvre.supply, manoeuvre.unit
    y = pack(axes, supply)
    amplifiers = Amplifiers(params, axes["valve"]["amplifier"].copy(), axes["valve"]["play"].copy())
    n, per_segment = len(axes), round(hold_s / step_s)
    warmth = float(supply.temperature - unit.viscosity_reference)
    taken = float(supply.traction_flow)
    integral = [y[8 : N_AXIS * n : N_AXIS].copy()]
    for index, command in enumerate(manoeuvre.commands):
        start = index * hold_s

        def slope(t: float, y: Array, command: Array = command, start: float = start) -> Array:
            x, v = manoeuvre.motion(start + t)
            return np.asarray(
                rates(y, params, unit, x, v, amplifiers.after(t, command)[1], taken, warmth)
            )

        grid = np.linspace(0.0, hold_s, per_segment + 1)
        answer = solve_ivp(
            slope,
            (0.0, hold_s),
            y,
            method=method,
            t_eval=grid,
            rtol=rtol,
            atol=atol,
            max_step=hold_s,
        )
        if not answer.success:
            raise RuntimeError(f"the reference solver gave up: {answer.message}")
        integral.extend(answer.y[8 : N_AXIS * n : N_AXIS, 1:].T)
        y = answer.y[:, -1]
        amplifiers.amplifier, amplifiers.played = amplifiers.after(hold_s, command)
    return np.asarray(np.diff(np.array(integral), axis=0) * 100.0 / step_s)
