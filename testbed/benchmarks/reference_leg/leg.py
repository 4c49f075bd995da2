"""A second, independent simulator of one vertical leg: the source of rigs for testing the diagnosis blind.

It shares no law with `testbed.laws` or `testbed.effects`: friction is an elasto-plastic bristle with a bent Stribeck
curve, the orifice is smoothed in another way, oil is counted in semi-implicit steps of their own length, and every
effect exists in two forms, the contract's formula and another.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from testbed.compiled import njit

Array = npt.NDArray[np.float64]

FIELDS = (
    # geometry, mass, oil
    "area_a",
    "area_b",
    "stroke",
    "mass",
    "gravity",
    "dead_a",
    "dead_b",
    "beta",
    "leak",
    "supply",
    "tank",
    "rated",
    "drop",
    "valve_w",
    "valve_damping",
    "deadband",
    "edge_smooth",
    # friction, plus and minus
    "sigma_p",
    "coulomb_p",
    "stribeck_p",
    "speed_p",
    "sigma_m",
    "coulomb_m",
    "stribeck_m",
    "speed_m",
    "bend",
    "bristle",
    "bristle_damping",
    # ground under the load cell
    "ground",
    "ground_damping",
    "ground_at",
    # controller
    "gain",
    "feed",
    # effects: strength, second number, form (0 contract, 1 other)
    "fpos",
    "fpos_form",
    "fpres",
    "fpres_form",
    "fload",
    "fload_form",
    "pre_k",
    "pre_c",
    "pre_form",
    "temp",
    "temp_form",
    "mass_add",
    "mass_form",
    "spring",
    "spring_rest",
    "spring_form",
    "per_amp",
    "per_w",
    "per_form",
    "cush",
    "cush_start",
    "cush_form",
    "leak_form",
    "air",
    "air_form",
    "hose",
    "hose_time",
    "hose_form",
    "droop",
    "droop_time",
    "droop_form",
    "dead_form",
    # effects outside the list
    "drag",
    "ripple",
    "ripple_wave",
    "sigma_pos",
    "edge_gain",
    "external_leak",
    "dwell",
    "dwell_time",
    "valve_delay",
    "tank_rise",
)
INDEX = {name: i for i, name in enumerate(FIELDS)}


def parameters(values: dict[str, float]) -> Array:
    """The flat vector that the kernel takes; what is not named is 0. Raises KeyError for an unknown name."""
    out = np.zeros(len(FIELDS))
    for name, value in values.items():
        out[INDEX[name]] = value
    return out


(
    AREA_A,
    AREA_B,
    STROKE,
    MASS,
    GRAVITY,
    DEAD_A,
    DEAD_B,
    BETA,
    LEAK,
    SUPPLY,
    TANK,
    RATED,
    DROP,
    VALVE_W,
    VALVE_DAMPING,
    DEADBAND,
    EDGE_SMOOTH,
    SIGMA_P,
    COULOMB_P,
    STRIBECK_P,
    SPEED_P,
    SIGMA_M,
    COULOMB_M,
    STRIBECK_M,
    SPEED_M,
    BEND,
    BRISTLE,
    BRISTLE_DAMPING,
    GROUND,
    GROUND_DAMPING,
    GROUND_AT,
    GAIN,
    FEED,
    FPOS,
    FPOS_FORM,
    FPRES,
    FPRES_FORM,
    FLOAD,
    FLOAD_FORM,
    PRE_K,
    PRE_C,
    PRE_FORM,
    TEMP,
    TEMP_FORM,
    MASS_ADD,
    MASS_FORM,
    SPRING,
    SPRING_REST,
    SPRING_FORM,
    PER_AMP,
    PER_W,
    PER_FORM,
    CUSH,
    CUSH_START,
    CUSH_FORM,
    LEAK_FORM,
    AIR,
    AIR_FORM,
    HOSE,
    HOSE_TIME,
    HOSE_FORM,
    DROOP,
    DROOP_TIME,
    DROOP_FORM,
    DEAD_FORM,
    DRAG,
    RIPPLE,
    RIPPLE_WAVE,
    SIGMA_POS,
    EDGE_GAIN,
    EXTERNAL_LEAK,
    DWELL,
    DWELL_TIME,
    VALVE_DELAY,
    TANK_RISE,
) = range(len(FIELDS))
COLUMNS = ("position", "velocity", "pressure_a", "pressure_b", "supply", "force", "command")
"""What a row holds, SI."""


@njit
def _root(drop: float, smooth: float) -> float:
    return float(drop / np.sqrt(np.sqrt(drop * drop + smooth * smooth)))


@njit
def _coulomb_scale(p: Array, x: float) -> float:
    xi = (x - 0.5 * p[STROKE]) / p[STROKE]
    if p[FPOS] == 0.0:
        return 1.0
    if p[FPOS_FORM] == 0.0:
        return float(max(0.05, 1.0 + p[FPOS] * xi))
    if p[FPOS_FORM] == 1.0:
        return float(max(0.05, 1.0 + 0.5 * p[FPOS] * np.tanh(4.0 * xi)))
    return float(max(0.05, 1.0 + p[FPOS] * 0.6 * np.sin(4.0 * xi + 0.7)))


@njit
def _coulomb_add(p: Array, pa: float, pb: float, load: float) -> float:
    add = 0.0
    if p[FPRES] != 0.0:
        total = max(pa, 0.0) + max(pb, 0.0)
        add += p[FPRES] * (total if p[FPRES_FORM] == 0.0 else 9e6 * (total / 9e6) ** 1.5)
    if p[FLOAD] != 0.0 and load > 0.0:
        add += p[FLOAD] * (load if p[FLOAD_FORM] == 0.0 else 1.4 * load / (1.0 + load / 2.5e4))
    return add


@njit
def _valve(p: Array, s: float, sd: float, acting: float, h: float) -> tuple[float, float, float]:
    """(spool, its rate, opening) one semi-implicit step later."""
    sd += h * (p[VALVE_W] ** 2 * (acting - s) - 2.0 * p[VALVE_DAMPING] * p[VALVE_W] * sd)
    s += h * sd
    size = max(abs(s) - p[DEADBAND], 0.0) / (1.0 - p[DEADBAND])
    if p[DEAD_FORM] == 1.0 and size > 0.0:
        size = size * size / (size + 0.02)
    return s, sd, size


@njit
def _edges(
    p: Array, s: float, size: float, pa: float, pb: float, supply: float, drawn: float
) -> tuple[float, float, float]:
    """(flow into A, flow into B, flow drawn from the supply), m3/s; `drawn` before."""
    per = size * p[RATED] / np.sqrt(p[DROP])
    tank = p[TANK] + p[TANK_RISE] * drawn**2
    if s > 0.0:
        drawn = per * _root(supply - pa, p[EDGE_SMOOTH])
        return drawn, -per * (1.0 - p[EDGE_GAIN]) * _root(pb - tank, p[EDGE_SMOOTH]), drawn
    drawn = per * _root(supply - pb, p[EDGE_SMOOTH])
    return -per * (1.0 - p[EDGE_GAIN]) * _root(pa - tank, p[EDGE_SMOOTH]), drawn, drawn


@njit
def _supply_change(p: Array, supply: float, drawn: float, h: float) -> float:
    if p[DROOP] <= 0.0:
        return 0.0
    fall = p[DROOP] * max(drawn, 0.0)
    if p[DROOP_FORM] == 1.0:
        fall = 1.3 * p[DROOP] * max(drawn, 0.0) ** 1.5 / np.sqrt(4e-4)
    return float(h * ((p[SUPPLY] - supply) - fall) / p[DROOP_TIME])


@njit
def _leak(p: Array, difference: float) -> float:
    if p[LEAK_FORM] == 1.0:
        return float(p[LEAK] * 1.8e6 * np.sign(difference) * np.sqrt(abs(difference) / 1.8e6))
    return float(p[LEAK] * difference)


@njit
def _softness(p: Array, pressure: float) -> float:
    """Compressibility of the oil and its air, 1/Pa."""
    soft = 1.0 / p[BETA]
    if p[AIR] > 0.0:
        up = max(pressure, 0.0) + 1e5
        if p[AIR_FORM] == 0.0:
            soft += p[AIR] / (1.4 * up) * (1e5 / up) ** (1.0 / 1.4)
        else:
            soft += p[AIR] * 1e5 / up**2
    return float(soft)


@njit
def _oil(
    p: Array, x: float, v: float, pa: float, pb: float, hose: float, qa: float, qb: float, h: float
) -> tuple[float, float, float]:
    """(pressure A, pressure B, pressure in the hose) one step later."""
    leak = _leak(p, pa - pb)
    soft_a, soft_b = _softness(p, pa), _softness(p, pb)
    fill = 0.0
    if p[HOSE] > 0.0:
        fill = p[HOSE] * (pa - hose) / p[HOSE_TIME]
        if p[HOSE_FORM] == 1.0:
            fill *= 1.0 / (1.0 + abs(pa - hose) / 2e6)
        hose += h * fill / p[HOSE]
    pa += h * (qa - p[AREA_A] * v - leak - fill) / ((p[DEAD_A] + p[AREA_A] * x) * soft_a)
    volume_b = p[DEAD_B] + p[AREA_B] * (p[STROKE] - x)
    pb += h * (qb + p[AREA_B] * v + leak - p[EXTERNAL_LEAK] * pb) / (volume_b * soft_b)
    return max(pa, -0.9e5), max(pb, -0.9e5), hose


@njit
def _level(p: Array, x: float, v: float, pa: float, pb: float, load: float, aged: float) -> float:
    """Friction of a slip without its viscous part, N; with the effects on it."""
    forward = v >= 0.0
    coulomb = p[COULOMB_P] if forward else p[COULOMB_M]
    stribeck = p[STRIBECK_P] if forward else p[STRIBECK_M]
    speed = p[SPEED_P] if forward else p[SPEED_M]
    level = coulomb * _coulomb_scale(p, x) + _coulomb_add(p, pa, pb, load)
    level += stribeck * np.exp(-((abs(v) / speed) ** p[BEND]))
    if p[DWELL] > 0.0:
        level += p[DWELL] * aged
    return float(max(level, 5.0))


@njit
def _bristle(
    p: Array, v: float, z: float, slip: Array, level: float, h: float
) -> tuple[float, float]:
    """(friction without its viscous part, bend); `slip`: bends of four elements, for the other form."""
    if p[PRE_K] > 0.0 and p[PRE_FORM] == 1.0:
        # Four elements that slip one after the other.
        friction = 0.0
        for e in range(4):
            limit = level * 0.25 / (p[PRE_K] * 0.25 * (0.4 + 0.4 * e))
            slip[e] = min(limit, max(-limit, slip[e] + h * v))
            friction += p[PRE_K] * 0.25 * (0.4 + 0.4 * e) * slip[e]
        return friction + p[PRE_C] * v * 0.05, z
    stiff = p[PRE_K] if p[PRE_K] > 0.0 else p[BRISTLE]
    damp = p[PRE_C] if p[PRE_K] > 0.0 else p[BRISTLE_DAMPING]
    rate = v - stiff * abs(v) * z / level
    z += h * rate
    z = min(level / stiff, max(-level / stiff, z))
    return stiff * z + damp * rate, z


@njit
def _push(p: Array, x: float, time: float) -> float:
    """Forces of the effects on the piston along extension, N."""
    push = 0.0
    if p[SPRING] != 0.0:
        stretch = x - p[SPRING_REST]
        if p[SPRING_FORM] == 0.0:
            push -= p[SPRING] * stretch
        else:
            push -= p[SPRING] * stretch * (0.6 + 12.0 * stretch * stretch)
    if p[PER_AMP] > 0.0:
        wave = np.sin(p[PER_W] * time)
        if p[PER_FORM] == 1.0:
            wave = np.tanh(3.0 * wave) * 1.05
        push += p[PER_AMP] * wave
    if p[CUSH] > 0.0 and x < p[CUSH_START]:
        into = p[CUSH_START] - x
        push += p[CUSH] * (into if p[CUSH_FORM] == 0.0 else into * into / 0.06)
    if p[RIPPLE] > 0.0:
        push += p[RIPPLE] * np.sin(2.0 * np.pi * x / p[RIPPLE_WAVE])
    return float(push)


@njit
def _viscosity(p: Array, temperature: float) -> float:
    """sigma over its value at 20 degC."""
    warm = temperature - 20.0
    return float(
        np.exp(-p[TEMP] * warm) if p[TEMP_FORM] == 0.0 else 1.0 / (1.0 + p[TEMP] * max(warm, -15.0))
    )


@njit
def simulate(
    p: Array,
    target: Array,
    target_rate: Array,
    temperature: Array,
    period: float,
    substeps: int,
    start: float,
) -> Array:
    """One recording: rows of COLUMNS at the sampling instants, shape (n, 7).

    `target`, `target_rate`: desired position m and speed m/s a sample; `temperature`: oil, degC a sample.
    """
    n = len(target)
    out = np.zeros((n, len(COLUMNS)))
    h = period / substeps
    x, v = start, 0.0
    pb = 0.45 * p[SUPPLY]
    pa = max((pb * p[AREA_B] - p[MASS] * p[GRAVITY]) / p[AREA_A], 2e5)
    supply = p[SUPPLY]
    s, sd, z, hose, aged, drawn = 0.0, 0.0, 0.0, pa, 0.0, 0.0
    slip = np.zeros(4)
    queue = np.zeros(64)
    mass = p[MASS] + p[MASS_ADD]
    weight = (p[MASS] + p[MASS_ADD] * (1.0 if p[MASS_FORM] == 0.0 else 0.3)) * p[GRAVITY]
    for i in range(n):
        u = p[GAIN] * (target[i] - np.floor(x / 1e-4) * 1e-4) + p[FEED] * target_rate[i]
        u = min(1.0, max(-1.0, u))
        queue[i % 64] = u
        late = round(p[VALVE_DELAY] / period)
        acting = queue[(i - late) % 64] if i >= late else 0.0
        viscous = _viscosity(p, temperature[i])
        load = 0.0
        for j in range(substeps):
            depth = x - p[GROUND_AT]
            load = 0.0
            if p[GROUND] > 0.0 and depth > 0.0:
                load = max(0.0, p[GROUND] * depth + p[GROUND_DAMPING] * v)
            s, sd, size = _valve(p, s, sd, acting, h)
            qa, qb, drawn = _edges(p, s, size, pa, pb, supply, drawn)
            supply += _supply_change(p, supply, drawn, h)
            pa, pb, hose = _oil(p, x, v, pa, pb, hose, qa, qb, h)
            sigma = (p[SIGMA_P] if v >= 0.0 else p[SIGMA_M]) * viscous
            sigma *= 1.0 + p[SIGMA_POS] * (x / p[STROKE] - 0.5)
            if p[DWELL] > 0.0:
                aged += h * (1.0 - aged * (1.0 + abs(v) / 2e-3)) / p[DWELL_TIME]
            level = _level(p, x, v, pa, pb, load, aged)
            friction, z = _bristle(p, v, z, slip, level, h)
            friction += sigma * v + p[DRAG] * v * abs(v)
            push = _push(p, x, i * period + j * h)
            v += h * (pa * p[AREA_A] - pb * p[AREA_B] + weight + push - friction - load) / mass
            x += h * v
            if x < 0.005 or x > p[STROKE] - 0.005:
                v = 0.0
                x = min(max(x, 0.005), p[STROKE] - 0.005)
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = x, v, pa, pb
        out[i, 4], out[i, 5], out[i, 6] = supply, load, u
    return out
