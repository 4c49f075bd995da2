"""A second, independent simulator of one vertical leg: the source of rigs for testing the diagnosis
blind.

It shares no law with `testbed.laws` or `testbed.effects`: friction is an elasto-plastic bristle
with a bent Stribeck curve, the orifice is smoothed in another way, oil is counted in semi-implicit
steps of their own length, and every effect exists in two forms, the contract's formula and another.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from testbed.compiled import njit
from testbed.formats.arrays import Array
from testbed.formats.records import Record, Records, quantity


class LegParameters(Record):
    """Everything that a simulation of the leg takes; what is not named is 0."""

    # Geometry, mass, oil
    area_a = quantity("m2", "piston area of chamber A")
    area_b = quantity("m2", "piston area of chamber B")
    stroke = quantity("m", "stroke")
    mass = quantity("kg", "what the piston moves")
    gravity = quantity("m/s2", "gravity along extension")
    dead_a = quantity("m3", "dead volume of A, retracted")
    dead_b = quantity("m3", "dead volume of B, extended")
    beta = quantity("Pa", "bulk modulus of the oil")
    leak = quantity("m3/(s Pa)", "leakage from A to B")
    supply = quantity("Pa", "supply pressure at rest")
    tank = quantity("Pa", "tank pressure")
    # Valve
    rated = quantity("m3/s", "flow of a full opening at `drop`")
    drop = quantity("Pa", "pressure drop of an edge at the rated flow")
    valve_w = quantity("rad/s", "natural frequency of the spool")
    valve_damping = quantity("1", "damping ratio of the spool")
    deadband = quantity("1", "overlap, share of the stroke")
    edge_smooth = quantity("Pa", "drop below which the flow is laminar")
    pa_more = quantity("1", "share by which the edge from supply to A is larger than rated")
    at_more = quantity("1", "the same from A to the tank")
    pb_more = quantity("1", "the same from supply to B")
    bt_more = quantity("1", "the same from B to the tank")
    # Friction, out (p) and in (m)
    sigma_p = quantity("N s/m", "viscous")
    coulomb_p = quantity("N", "Coulomb")
    stribeck_p = quantity("N", "break-away over Coulomb")
    speed_p = quantity("m/s", "Stribeck speed")
    sigma_m = quantity("N s/m", "viscous")
    coulomb_m = quantity("N", "Coulomb")
    stribeck_m = quantity("N", "break-away over Coulomb")
    speed_m = quantity("m/s", "Stribeck speed")
    bend = quantity("1", "exponent of the Stribeck curve")
    bristle = quantity("N/m", "stiffness of the bristles")
    bristle_damping = quantity("N s/m", "their damping")
    # Ground under the load cell, and the controller
    ground = quantity("N/m", "stiffness; 0: none")
    ground_damping = quantity("N s/m", "damping")
    ground_at = quantity("m", "extension at which it is met")
    gain = quantity("1/m", "opening per error of position")
    feed = quantity("s/m", "opening per desired speed")
    # Effects: sizes, and the form (0 the contract's formula, 1 and 2 another)
    fpos = quantity("1", "friction by place")
    fpos_form = quantity("1", "form")
    fpres = quantity("m2", "friction by pressure")
    fpres_form = quantity("1", "form")
    fload = quantity("1", "friction by load")
    fload_form = quantity("1", "form")
    pre_k = quantity("N/m", "presliding stiffness")
    pre_c = quantity("N s/m", "presliding damping")
    pre_form = quantity("1", "form")
    temp = quantity("1/K", "viscosity by temperature")
    temp_form = quantity("1", "form")
    mass_add = quantity("kg", "mass that nobody declares")
    mass_form = quantity("1", "form")
    spring = quantity("N/m", "spring")
    spring_rest = quantity("m", "where it pulls no way")
    spring_form = quantity("1", "form")
    per_amp = quantity("N", "periodic force")
    per_w = quantity("rad/s", "its frequency")
    per_form = quantity("1", "form")
    cush = quantity("N/m", "cushion at the end")
    cush_start = quantity("m", "extension below which it acts")
    cush_form = quantity("1", "form")
    leak_form = quantity("1", "form of the leakage")
    air = quantity("1", "air in the oil")
    air_form = quantity("1", "form")
    hose = quantity("m3/Pa", "capacity of a slow hose at A")
    hose_time = quantity("s", "its time constant")
    hose_form = quantity("1", "form")
    droop = quantity("Pa s/m3", "supply's fall by the flow drawn")
    droop_time = quantity("s", "its time constant")
    droop_form = quantity("1", "form")
    dead_form = quantity("1", "form of the deadband")
    # Effects outside the list
    drag = quantity("N s2/m2", "drag by speed squared")
    ripple = quantity("N", "force that repeats along the stroke")
    ripple_wave = quantity("m", "its wavelength")
    sigma_pos = quantity("1", "viscous friction by place")
    edge_gain = quantity("1", "loss of the outlet edges")
    external_leak = quantity("m3/(s Pa)", "leakage from B to outside")
    dwell = quantity("N", "break-away that grows at rest")
    dwell_time = quantity("s", "in which it grows")
    valve_delay = quantity("s", "dead time of the command")
    tank_rise = quantity("Pa s2/m6", "tank pressure by the flow squared")


def parameters(values: Mapping[str, float]) -> Any:
    """One record of the leg's numbers, as an array (1,). Raises KeyError for an unknown name."""
    out = LegParameters.zeros()
    for name, value in values.items():
        if name not in LegParameters.fields:
            raise KeyError(name)
        out[name] = value
    return out


COLUMNS = ("position", "velocity", "pressure_a", "pressure_b", "supply", "force", "command")
"""What a row holds, SI."""


@njit
def _root(drop: float, smooth: float) -> float:
    return float(drop / np.sqrt(np.sqrt(drop * drop + smooth * smooth)))


@njit
def _coulomb_scale(p: LegParameters, x: float) -> float:
    xi = (x - 0.5 * p.stroke) / p.stroke
    if p.fpos == 0.0:
        return 1.0
    if p.fpos_form == 0.0:
        return max(0.05, 1.0 + p.fpos * xi)
    if p.fpos_form == 1.0:
        return float(max(0.05, 1.0 + 0.5 * p.fpos * np.tanh(4.0 * xi)))
    return float(max(0.05, 1.0 + p.fpos * 0.6 * np.sin(4.0 * xi + 0.7)))


@njit
def _coulomb_add(p: LegParameters, pa: float, pb: float, load: float) -> float:
    add = 0.0
    if p.fpres != 0.0:
        total = max(pa, 0.0) + max(pb, 0.0)
        add += p.fpres * (total if p.fpres_form == 0.0 else 9e6 * (total / 9e6) ** 1.5)
    if p.fload != 0.0 and load > 0.0:
        add += p.fload * (load if p.fload_form == 0.0 else 1.4 * load / (1.0 + load / 2.5e4))
    return add


@njit
def _valve(
    p: LegParameters, s: float, sd: float, acting: float, h: float
) -> tuple[float, float, float]:
    """(spool, its rate, opening) one semi-implicit step later."""
    sd += h * (p.valve_w**2 * (acting - s) - 2.0 * p.valve_damping * p.valve_w * sd)
    s += h * sd
    size = max(abs(s) - p.deadband, 0.0) / (1.0 - p.deadband)
    if p.dead_form == 1.0 and size > 0.0:
        size = size * size / (size + 0.02)
    return s, sd, size


@njit
def _edges(
    p: LegParameters, s: float, size: float, pa: float, pb: float, supply: float, drawn: float
) -> tuple[float, float, float]:
    """(flow into A, flow into B, flow drawn from the supply), m3/s; `drawn` before."""
    per = size * p.rated / np.sqrt(p.drop)
    tank = p.tank + p.tank_rise * drawn**2
    left = per * (1.0 - p.edge_gain)
    if s > 0.0:
        drawn = per * (1.0 + p.pa_more) * _root(supply - pa, p.edge_smooth)
        return drawn, -left * (1.0 + p.bt_more) * _root(pb - tank, p.edge_smooth), drawn
    drawn = per * (1.0 + p.pb_more) * _root(supply - pb, p.edge_smooth)
    return -left * (1.0 + p.at_more) * _root(pa - tank, p.edge_smooth), drawn, drawn


@njit
def _supply_change(p: LegParameters, supply: float, drawn: float, h: float) -> float:
    if p.droop <= 0.0:
        return 0.0
    fall = p.droop * max(drawn, 0.0)
    if p.droop_form == 1.0:
        fall = 1.3 * p.droop * max(drawn, 0.0) ** 1.5 / np.sqrt(4e-4)
    return h * ((p.supply - supply) - fall) / p.droop_time


@njit
def _leak(p: LegParameters, difference: float) -> float:
    if p.leak_form == 1.0:
        return float(p.leak * 1.8e6 * np.sign(difference) * np.sqrt(abs(difference) / 1.8e6))
    return p.leak * difference


@njit
def _softness(p: LegParameters, pressure: float) -> float:
    """Compressibility of the oil and its air, 1/Pa."""
    soft = 1.0 / p.beta
    if p.air > 0.0:
        up = max(pressure, 0.0) + 1e5
        if p.air_form == 0.0:
            soft += p.air / (1.4 * up) * (1e5 / up) ** (1.0 / 1.4)
        else:
            soft += p.air * 1e5 / up**2
    return soft


@njit
def _oil(
    p: LegParameters,
    x: float,
    v: float,
    pressures: tuple[float, float, float],
    flows: tuple[float, float],
    h: float,
) -> tuple[float, float, float]:
    """`pressures` (of A, of B, in the hose) one step `h` later, with `flows` into A and B."""
    pa, pb, hose = pressures
    qa, qb = flows
    leak = _leak(p, pa - pb)
    soft_a, soft_b = _softness(p, pa), _softness(p, pb)
    fill = 0.0
    if p.hose > 0.0:
        fill = p.hose * (pa - hose) / p.hose_time
        if p.hose_form == 1.0:
            fill *= 1.0 / (1.0 + abs(pa - hose) / 2e6)
        hose += h * fill / p.hose
    pa += h * (qa - p.area_a * v - leak - fill) / ((p.dead_a + p.area_a * x) * soft_a)
    volume_b = p.dead_b + p.area_b * (p.stroke - x)
    pb += h * (qb + p.area_b * v + leak - p.external_leak * pb) / (volume_b * soft_b)
    return max(pa, -0.9e5), max(pb, -0.9e5), hose


@njit
def _level(
    p: LegParameters, x: float, v: float, pa: float, pb: float, load: float, aged: float
) -> float:
    """Friction of a slip without its viscous part, N; with the effects on it."""
    forward = v >= 0.0
    coulomb = p.coulomb_p if forward else p.coulomb_m
    stribeck = p.stribeck_p if forward else p.stribeck_m
    speed = p.speed_p if forward else p.speed_m
    level = coulomb * _coulomb_scale(p, x) + _coulomb_add(p, pa, pb, load)
    level += stribeck * np.exp(-((abs(v) / speed) ** p.bend))
    if p.dwell > 0.0:
        level += p.dwell * aged
    return float(max(level, 5.0))


@njit
def _bristle(
    p: LegParameters, v: float, z: float, slip: Array, level: float, h: float
) -> tuple[float, float]:
    """(friction without its viscous part, bend); `slip`: bends of four elements, for the other
    form.
    """
    if p.pre_k > 0.0 and p.pre_form == 1.0:
        # Four elements that slip one after the other.
        friction = 0.0
        for index in range(4):
            limit = level * 0.25 / (p.pre_k * 0.25 * (0.4 + 0.4 * index))
            slip[index] = min(limit, max(-limit, slip[index] + h * v))
            friction += p.pre_k * 0.25 * (0.4 + 0.4 * index) * slip[index]
        return friction + p.pre_c * v * 0.05, z
    stiff = p.pre_k if p.pre_k > 0.0 else p.bristle
    damp = p.pre_c if p.pre_k > 0.0 else p.bristle_damping
    rate = v - stiff * abs(v) * z / level
    z += h * rate
    z = min(level / stiff, max(-level / stiff, z))
    return stiff * z + damp * rate, z


@njit
def _push(p: LegParameters, x: float, time: float) -> float:
    """Forces of the effects on the piston along extension, N."""
    push = 0.0
    if p.spring != 0.0:
        stretch = x - p.spring_rest
        if p.spring_form == 0.0:
            push -= p.spring * stretch
        else:
            push -= p.spring * stretch * (0.6 + 12.0 * stretch * stretch)
    if p.per_amp > 0.0:
        wave = np.sin(p.per_w * time)
        if p.per_form == 1.0:
            wave = np.tanh(3.0 * wave) * 1.05
        push += p.per_amp * wave
    if p.cush > 0.0 and x < p.cush_start:
        into = p.cush_start - x
        push += p.cush * (into if p.cush_form == 0.0 else into * into / 0.06)
    if p.ripple > 0.0:
        push += p.ripple * np.sin(2.0 * np.pi * x / p.ripple_wave)
    return push


@njit
def _viscosity(p: LegParameters, temperature: float) -> float:
    """Sigma over its value at 20 degC."""
    warm = temperature - 20.0
    return np.exp(-p.temp * warm) if p.temp_form == 0.0 else 1.0 / (1.0 + p.temp * max(warm, -15.0))


@njit
def simulate(
    leg: Records[LegParameters],
    target: Array,
    target_rate: Array,
    temperature: Array,
    period: float,
    substeps: int,
    start: float,
) -> Array:
    """One recording: rows of COLUMNS at the sampling instants, shape (n, 7).

    `leg`: the record of `parameters`. `target`, `target_rate`: desired position m and speed m/s a
    sample; `temperature`: oil, degC a sample.
    """
    p = leg[0]
    n = len(target)
    out = np.zeros((n, len(COLUMNS)))
    h = period / substeps
    x, v = start, 0.0
    pb = 0.45 * p.supply
    pa = max((pb * p.area_b - p.mass * p.gravity) / p.area_a, 2e5)
    supply = p.supply
    s, sd, z, hose, aged, drawn = 0.0, 0.0, 0.0, pa, 0.0, 0.0
    slip = np.zeros(4)
    queue = np.zeros(64)
    mass = p.mass + p.mass_add
    weight = (p.mass + p.mass_add * (1.0 if p.mass_form == 0.0 else 0.3)) * p.gravity
    for index in range(n):
        u = p.gain * (target[index] - np.floor(x / 1e-4) * 1e-4) + p.feed * target_rate[index]
        u = min(1.0, max(-1.0, u))
        queue[index % 64] = u
        late = round(p.valve_delay / period)
        acting = queue[(index - late) % 64] if index >= late else 0.0
        viscous = _viscosity(p, temperature[index])
        load = 0.0
        for j in range(substeps):
            depth = x - p.ground_at
            load = 0.0
            if p.ground > 0.0 and depth > 0.0:
                load = max(0.0, p.ground * depth + p.ground_damping * v)
            s, sd, size = _valve(p, s, sd, acting, h)
            qa, qb, drawn = _edges(p, s, size, pa, pb, supply, drawn)
            supply += _supply_change(p, supply, drawn, h)
            pa, pb, hose = _oil(p, x, v, (pa, pb, hose), (qa, qb), h)
            sigma = (p.sigma_p if v >= 0.0 else p.sigma_m) * viscous
            sigma *= 1.0 + p.sigma_pos * (x / p.stroke - 0.5)
            if p.dwell > 0.0:
                aged += h * (1.0 - aged * (1.0 + abs(v) / 2e-3)) / p.dwell_time
            level = _level(p, x, v, pa, pb, load, aged)
            friction, z = _bristle(p, v, z, slip, level, h)
            friction += sigma * v + p.drag * v * abs(v)
            push = _push(p, x, index * period + j * h)
            v += h * (pa * p.area_a - pb * p.area_b + weight + push - friction - load) / mass
            x += h * v
            if x < 0.005 or x > p.stroke - 0.005:
                v = 0.0
                x = min(max(x, 0.005), p.stroke - 0.005)
        out[index, 0], out[index, 1], out[index, 2], out[index, 3] = x, v, pa, pb
        out[index, 4], out[index, 5], out[index, 6] = supply, load, u
    return out
