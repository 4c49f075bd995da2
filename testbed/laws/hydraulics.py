"""Twelve differential cylinders with their valves on one supply: the compiled step that runs beside the engine.

Per axis, with x the extension (m), v its rate, absolute pressures, flows in standard volume (oil.py):

    W_A' = Q_A - C_i (pA - pB) - C_o (pA - pt) - q_hose,   W_A nu(pA) = dead volume + A_A x
    W_B' = Q_B + C_i (pA - pB) - C_o (pB - pt),            W_B nu(pB) = dead volume + A_B (stroke - x)
    F = pA A_A - pB A_B - (A_A - A_B) p_atm - friction - cushions - stops        (pushes the rod out)

One linearly implicit step of the two chambers a substep (stable at any volume), oil counted exactly. The supply
pressure is held over a substep and then follows what all axes drew.
"""

from __future__ import annotations

import math
from typing import Any

from numba import njit

from testbed.laws import columns as c
from testbed.laws.friction import bristle_step, stribeck_level
from testbed.laws.oil import ATMOSPHERE_PA, VAPOUR_PA, specific_volume
from testbed.laws.orifice import orifice
from testbed.laws.supply import supply_step
from testbed.laws.valve import opening, play, spool_step


@njit(cache=True)
def valve_step(s: Any, p: Any, command: float, h: float) -> float:
    """Amplifier, hysteresis and spool of one axis over h; returns the opening."""
    s[c.AMPLIFIER] += h / (p[c.AMP_TAU] + h) * (command - s[c.AMPLIFIER])
    s[c.PLAY] = play(s[c.PLAY], s[c.AMPLIFIER], p[c.HYSTERESIS])
    s[c.SPOOL], s[c.SPOOL_RATE] = spool_step(s[c.SPOOL], s[c.SPOOL_RATE], s[c.PLAY], p[c.SPOOL_WN], p[c.SPOOL_ZETA], h)
    return float(opening(s[c.SPOOL], p[c.DEADBAND]))


@njit(cache=True)
def port_flow(
    p_port: float,
    ps: float,
    pt: float,
    k_supply: float,
    k_tank: float,
    leak: float,
    to_supply: bool,
    o: float,
) -> tuple[float, float, float, float]:
    """Flow into a port (m3/s), its slope by the port's pressure, and the parts drawn from supply and its slope.

    The open edge (supply where `to_supply`, else tank) is turbulent with opening |o|; both edges leak laminarly.
    """
    open_from = ps if to_supply else pt
    gain = (k_supply if to_supply else k_tank) * o
    f, df = orifice(open_from - p_port)
    from_supply = leak * (ps - p_port)
    drawn_slope = leak
    if to_supply:
        from_supply += gain * f
        drawn_slope += gain * df
        return from_supply + leak * (pt - p_port), -gain * df - 2.0 * leak, from_supply, drawn_slope
    return gain * f + leak * (pt - p_port) + from_supply, -gain * df - 2.0 * leak, from_supply, drawn_slope


@njit(cache=True)
def chamber_step(
    s: Any, p: Any, x: float, o: float, ps: float, pt: float, h: float
) -> tuple[float, float, float, float]:
    """Advance both chambers by h at the new extension x; returns oil drawn (m3/s), its slope, returned, heat (W)."""
    pa, pb = s[c.P_A], s[c.P_B]
    volume_a = p[c.DEAD_A] + p[c.AREA_A] * x
    volume_b = p[c.DEAD_B] + p[c.AREA_B] * (p[c.STROKE] - x)
    drawn_a = drawn_b = slope_a = slope_b = drawn_slope_a = drawn_slope_b = flow_a = flow_b = 0.0
    if p[c.LOCKED] == 0.0:
        leak = p[c.EDGE_LEAK]
        flow_a, slope_a, drawn_a, drawn_slope_a = port_flow(pa, ps, pt, p[c.K_PA], p[c.K_AT], leak, o > 0.0, abs(o))
        flow_b, slope_b, drawn_b, drawn_slope_b = port_flow(pb, ps, pt, p[c.K_PB], p[c.K_BT], leak, o < 0.0, abs(o))
    ci, co = p[c.LEAK_I], p[c.LEAK_O]
    hose = 0.0
    hose_slope = 0.0
    if p[c.HOSE_CAP] > 0.0:
        hose_slope = p[c.HOSE_CAP] / (p[c.HOSE_TIME] + h)
        hose = hose_slope * (pa - s[c.HOSE_P])
    inner = ci * (pa - pb)
    nu_a, dnu_a = specific_volume(pa, p[c.BULK], p[c.AIR])
    nu_b, dnu_b = specific_volume(pb, p[c.BULK], p[c.AIR])
    out_a = co * (pa - pt)
    out_b = co * (pb - pt)
    net_a = flow_a - inner - out_a - hose
    net_b = flow_b + inner - out_b
    g_a = volume_a / nu_a - s[c.OIL_A] - h * net_a
    g_b = volume_b / nu_b - s[c.OIL_B] - h * net_b
    aa = -volume_a * dnu_a / (nu_a * nu_a) - h * (slope_a - ci - co - hose_slope)
    bb = -volume_b * dnu_b / (nu_b * nu_b) - h * (slope_b - ci - co)
    cross = -h * ci
    det = aa * bb - cross * cross
    da = -(g_a * bb - g_b * cross) / det
    db = -(g_b * aa - g_a * cross) / det
    # A chamber that the piston empties faster than oil comes stays at vapour pressure; the void is in the oil count.
    da = da if pa + da > VAPOUR_PA else VAPOUR_PA - pa
    db = db if pb + db > VAPOUR_PA else VAPOUR_PA - pb
    through = ci * (da - db)
    s[c.OIL_A] += h * (net_a + (slope_a - co - hose_slope) * da - through)
    s[c.OIL_B] += h * (net_b + (slope_b - co) * db + through)
    if p[c.HOSE_CAP] > 0.0:
        s[c.HOSE_P] += h * (hose + hose_slope * da) / p[c.HOSE_CAP]
    s[c.P_A], s[c.P_B] = pa + da, pb + db
    flow_a += slope_a * da
    flow_b += slope_b * db
    drawn = drawn_a + drawn_b - drawn_slope_a * da - drawn_slope_b * db
    returned = drawn - flow_a - flow_b + out_a + out_b + co * (da + db)
    heat = (
        drawn * ps - flow_a * s[c.P_A] - flow_b * s[c.P_B] - (drawn - flow_a - flow_b) * pt + inner * (pa - pb)
        + out_a * (pa - pt) + out_b * (pb - pt) + hose * (pa - s[c.HOSE_P])
    )  # fmt: skip
    return drawn, drawn_slope_a + drawn_slope_b, returned, heat


@njit(cache=True)
def friction_step(s: Any, p: Any, x: float, v: float, warm: float, load: float, side: float, h: float) -> float:
    """Friction of one axis over h, N, against +v; bristle and dwell advance. `warm` scales the viscous part."""
    speed = abs(v)
    if v >= 0.0:
        fc, fs, cs, sigma = p[c.FC_POS], p[c.FS_POS], p[c.CS_POS], p[c.VISC_POS]
    else:
        fc, fs, cs, sigma = p[c.FC_NEG], p[c.FS_NEG], p[c.CS_NEG], p[c.VISC_NEG]
    fc *= 1.0 + p[c.FR_POSITION] * (x / p[c.STROKE] - 0.5)
    fc += p[c.FR_PRESSURE] * (s[c.P_A] + s[c.P_B] - 2.0 * ATMOSPHERE_PA)
    fc += p[c.FR_LOAD] * (load if load > 0.0 else 0.0) + p[c.FR_SIDE] * abs(side)
    fc = fc if fc > 1.0 else 1.0
    if p[c.DWELL_GAIN] > 0.0:
        # Rest ages the contact towards DWELL_GAIN with DWELL_TIME; one bristle length of sliding renews it.
        rest = h / p[c.DWELL_TIME]
        slide = h * speed * p[c.BRISTLE_K] / fc
        s[c.DWELL] = (s[c.DWELL] + rest * p[c.DWELL_GAIN]) / (1.0 + rest + slide)
        fs += fc * s[c.DWELL]
    level = stribeck_level(speed, fc, fs, cs)
    s[c.BRISTLE], force = bristle_step(s[c.BRISTLE], v, h, level, p[c.BRISTLE_K], p[c.BRISTLE_D])
    return float(force + sigma * warm * v)


@njit(cache=True)
def end_force(p: Any, x: float, v: float) -> float:
    """Cushions (a damper that grows into the last stretch, against the piston only) and stops, N, along +x."""
    force = 0.0
    from_start, from_end = x, p[c.STROKE] - x
    length = p[c.CUSHION_LENGTH]
    if from_start < length:
        if v < 0.0:
            force -= p[c.CUSHION_D] * v * (1.0 - from_start / length)
        if from_start < 0.0:
            push = -p[c.STOP_K] * from_start - p[c.STOP_D] * v
            force += push if push > 0.0 else 0.0
    if from_end < length:
        if v > 0.0:
            force -= p[c.CUSHION_D] * v * (1.0 - from_end / length)
        if from_end < 0.0:
            push = -p[c.STOP_K] * from_end + p[c.STOP_D] * v
            force -= push if push > 0.0 else 0.0
    return force


@njit(cache=True)
def extra_force(p: Any, x: float, t: float) -> float:
    """Undeclared forces on the piston along +x, N: a spring, a narrow-band force, a cushion long before the stop."""
    force = 0.0
    if p[c.SPRING_K] != 0.0:
        force -= p[c.SPRING_K] * (x - p[c.SPRING_REST])
    if p[c.PERIODIC_N] != 0.0:
        force += p[c.PERIODIC_N] * math.sin(p[c.PERIODIC_W] * t)
    if p[c.XCUSHION_K] != 0.0 and x < p[c.XCUSHION_START]:
        force += p[c.XCUSHION_K] * (p[c.XCUSHION_START] - x)
    return force


@njit(cache=True)
def sense_step(s: Any, p: Any, h: float) -> None:
    """Transducers' first-order lag; B behind its pipe, a second-order line."""
    a = h / (p[c.TRANSDUCER_TAU] + h)
    w = p[c.LINE_WN] * h
    rate = (s[c.LINE_RATE] + p[c.LINE_WN] * w * (s[c.P_B] - s[c.LINE_P])) / (1.0 + 2.0 * p[c.LINE_ZETA] * w + w * w)
    s[c.LINE_RATE] = rate
    s[c.LINE_P] += h * rate
    s[c.SENSED_A] += a * (s[c.P_A] - s[c.SENSED_A])
    s[c.SENSED_B] += a * (s[c.LINE_P] - s[c.SENSED_B])


@njit(cache=True)
def hydraulic_step(
    axes: Any, params: Any, supply: Any, unit: Any, x: Any, v: Any, command: Any, load: Any, side: Any,
    dt: float, substeps: int,
) -> None:  # fmt: skip
    """Advance all axes and the power unit by dt in `substeps`, in place.

    axes (n, AXIS_STATES), params (n, AXIS_PARAMETERS), supply (SUPPLY_STATES), unit (SUPPLY_PARAMETERS): columns.py.
    x, v (n): extension (m) and rate (m/s), the rate taken constant over dt. command (n): -1..1.
    load, side (n): axial and side load on the rod, N, for load-dependent friction.
    Leaves in axes[:, FORCE] the cylinder's mean force on its rod over dt (N, + pushes out), in axes[:, FRICTION]
    the mean friction (N, against + v).
    """
    h = dt / substeps
    n = axes.shape[0]
    pt = unit[c.TANK_P]
    warmth = supply[c.TEMPERATURE] - unit[c.VISC_REFERENCE]
    for i in range(n):
        axes[i, c.FORCE] = 0.0
        axes[i, c.FRICTION] = 0.0
        axes[i, c.WARM] = math.exp(-(unit[c.VISC_RATE] + params[i, c.EXTRA_VISC_RATE]) * warmth)
    for k in range(substeps):
        ps = supply[c.P_SUPPLY] + supply[c.DROOP_P]
        drawn = supply[c.TRACTION_FLOW]
        returned = supply[c.TRACTION_FLOW]
        drawn_slope = 0.0
        heat = 0.0
        for i in range(n):
            s, p = axes[i], params[i]
            xk = x[i] + (k + 1) * h * v[i]
            o = valve_step(s, p, command[i], h)
            q, slope, back, warm_w = chamber_step(s, p, xk, o, ps, pt, h)
            drawn += q
            drawn_slope += slope
            returned += back
            friction = friction_step(s, p, xk, v[i], s[c.WARM], load[i], side[i], h)
            heat += warm_w + friction * v[i]
            force = s[c.P_A] * p[c.AREA_A] - s[c.P_B] * p[c.AREA_B] - (p[c.AREA_A] - p[c.AREA_B]) * ATMOSPHERE_PA
            force += end_force(p, xk, v[i]) + extra_force(p, xk, supply[c.TIME])
            s[c.FORCE] += (force - friction) / substeps
            s[c.FRICTION] += friction / substeps
            sense_step(s, p, h)
        if unit[c.DROOP] > 0.0:
            supply[c.DROOP_P] += h * (
                -supply[c.DROOP_P] / unit[c.DROOP_TIME] - unit[c.DROOP] * drawn / unit[c.DROOP_TIME]
            )
        supply_step(supply, unit, drawn, drawn_slope, returned, heat, h)
