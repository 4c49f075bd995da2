"""Both chambers of every cylinder over one substep: a linearly implicit step of second order, oil counted exactly.

With W the oil in a chamber (standard volume, oil.py), x the extension, q the flow through an edge:

    W_A' = q_PA + q_TA - C_i (pA - pB) - C_o (pA - pt) - hose,   W_A nu(pA) = dead volume + A_A x
    W_B' = q_PB + q_TB + C_i (pA - pB) - C_o (pB - pt) - hose,   W_B nu(pB) = dead volume + A_B (stroke - x)
    hose: capacity ph' = capacity (p - ph) / time

The step is the Rosenbrock method ROS2 (Verwer, Spee, Blom, Hundsdorfer 1999), two stages, L-stable with
g = 1 - 1 / sqrt(2):

    (1 - g h J) k1 = f(t, W) + g h f_t,   (1 - g h J) k2 = f(t + h, W + h k1) - 2 k1 - g h f_t,
    W += h (3 k1 + k2) / 2

It stays of second order for any J, so slopes are taken where they are at hand. Every flow is followed through both
stages by itself, so that what leaves one place enters another to the last bit. Pressures follow from oil and volume
after each stage. The axes meet in the supply: each first solves for its rates as y + u q, linear in the rate q of the
supply's pressure; the supply then finds q; the axes fill it in.
"""

from __future__ import annotations

import math
from typing import Any

from testbed.laws import columns as c
from testbed.laws.compiling import njit_law
from testbed.laws.oil import (
    ATMOSPHERE_PA,
    POLYTROPIC,
    VAPOUR_PA,
    enthalpy,
    enthalpy_with_gas,
    gas_volume,
    pressure_near,
    pressure_of,
    vapour_volume,
)
from testbed.laws.orifice import orifice

GAMMA = 1.0 - 1.0 / math.sqrt(2.0)

# --- working numbers of an axis within one call (n x WORK) ----------------------------------------------------
(
    VOLUME_A,
    VOLUME_B,
    GROWTH_A,
    GROWTH_B,
    OUTER_LEAK,
    INNER_LEAK,
    EDGE,
    NU_V,
    CAP_A,
    CAP_B,
    KEEP,
    HOSE_0_A,
    HOSE_0_B,
    GAS_A,
    GAS_B,
    STIFF_A,
    STIFF_B,
    RAMP_A,
    RAMP_B,
    H_A,
    H_B,
    FROM_S_A,
    FROM_S_B,
    INV_AA,
    INV_AB,
    INV_BA,
    INV_BB,
    U_A,
    U_B,
    Y_A,
    Y_B,
    DRAWN,
    RISE,
    CHANGE_A,
    CHANGE_B,
    HOSE_IN_A,
    HOSE_IN_B,
    GUESS_A,
    GUESS_B,
    K_A,
    K_B,
    KH_A,
    KH_B,
    K_DRAWN,
    PER_A,
    PER_B,
    PER_BULK,
    INVERSE_A,
    INVERSE_B,
    EDGE_P,
    WORK,
) = range(51)


@njit_law(forceinline=True)
def port(
    p: float,
    ps: float,
    pt: float,
    k_supply: float,
    k_tank: float,
    leak_p: float,
    leak: float,
    o: float,
    o_next: float,
) -> tuple[float, float, float, float, float, float]:
    """One port at pressure p: flow into it from the supply and from the tank (m3/s), the slopes of both by their
    pressure drops (m3/(s Pa)), and how both grow until the opening is `o_next` (m3/s).

    o > 0 opens the port to the supply, o < 0 to the tank; the open edge is turbulent, both edges leak laminarly:
    leak_p from the supply, leak to the tank.
    """
    if o + o_next > 0.0:
        f, df = orifice(ps - p)
        now = k_supply * (o if o > 0.0 else 0.0)
        then = k_supply * (o_next if o_next > 0.0 else 0.0)
        return (
            now * f + leak_p * (ps - p),
            leak * (pt - p),
            now * df + leak_p,
            leak,
            (then - now) * f,
            0.0,
        )
    if o + o_next < 0.0:
        f, df = orifice(pt - p)
        now = k_tank * (-o if o < 0.0 else 0.0)
        then = k_tank * (-o_next if o_next < 0.0 else 0.0)
        return (
            leak_p * (ps - p),
            now * f + leak * (pt - p),
            leak_p,
            now * df + leak,
            0.0,
            (then - now) * f,
        )
    return leak_p * (ps - p), leak * (pt - p), leak_p, leak, 0.0, 0.0


@njit_law
def begin(axes: Any, params: Any, x: Any, v: Any, h: float, work: Any, a: Any, b: Any) -> None:
    """Fill the constants of a call and the pressures at its start, also into a[:, 0] and b[:, 0]."""
    for i in range(axes.shape[0]):
        work[i, VOLUME_A] = params[i, c.DEAD_A] + params[i, c.AREA_A] * x[i]
        work[i, VOLUME_B] = params[i, c.DEAD_B] + params[i, c.AREA_B] * (params[i, c.STROKE] - x[i])
        work[i, GROWTH_A], work[i, GROWTH_B] = (
            params[i, c.AREA_A] * v[i],
            -params[i, c.AREA_B] * v[i],
        )
        shut = params[i, c.LOCKED] != 0.0
        work[i, EDGE] = 0.0 if shut else params[i, c.EDGE_LEAK]
        work[i, EDGE_P] = 0.0 if shut else params[i, c.EDGE_LEAK_P]
        work[i, INNER_LEAK], work[i, OUTER_LEAK] = params[i, c.LEAK_I], params[i, c.LEAK_O]
        work[i, CAP_A] = (
            params[i, c.HOSE_CAP] / params[i, c.HOSE_TIME] if params[i, c.HOSE_CAP] > 0.0 else 0.0
        )
        work[i, CAP_B] = (
            params[i, c.HOSE_CAP_B] / params[i, c.HOSE_TIME]
            if params[i, c.HOSE_CAP_B] > 0.0
            else 0.0
        )
        work[i, KEEP] = 1.0 / (1.0 + GAMMA * h / params[i, c.HOSE_TIME])
        work[i, HOSE_0_A], work[i, HOSE_0_B] = axes[i, c.HOSE_P], axes[i, c.HOSE_P_B]
        work[i, NU_V] = vapour_volume(params[i, c.BULK], params[i, c.AIR])
        work[i, PER_BULK] = 1.0 / params[i, c.BULK]
        pa, pb, air, per_bulk = axes[i, c.P_A], axes[i, c.P_B], params[i, c.AIR], work[i, PER_BULK]
        work[i, GAS_A], work[i, GAS_B] = gas_volume(pa, air), gas_volume(pb, air)
        work[i, PER_A], work[i, INVERSE_A] = inverses(
            pa, axes[i, c.OIL_A], work[i, GAS_A], per_bulk, air
        )
        work[i, PER_B], work[i, INVERSE_B] = inverses(
            pb, axes[i, c.OIL_B], work[i, GAS_B], per_bulk, air
        )
        settle_both(axes, params, work, i, pa, pb, pa, pb)
        a[i, 0], b[i, 0] = axes[i, c.P_A], axes[i, c.P_B]


@njit_law(forceinline=True)
def inverses(p: float, oil: float, gas: float, per_bulk: float, air: float) -> tuple[float, float]:
    """1 / p and 1 / (oil dnu/dp) at the pressure p, in one division; 0 for the latter in a void."""
    falls = oil * (
        (1.0 - air) * (1.0 - (p - ATMOSPHERE_PA) * per_bulk) * per_bulk * p + gas / POLYTROPIC
    )
    both = 1.0 / (p * falls)
    return both * falls, -both * p * p if p > VAPOUR_PA else 0.0


@njit_law(forceinline=True)
def settle(
    volume: float,
    growth: float,
    oil: float,
    guess: float,
    near: float,
    per_near: float,
    gas_near: float,
    inverse: float,
    bulk: float,
    per_bulk: float,
    air: float,
    nu_vapour: float,
) -> tuple[float, float, float, float, float, float, float]:
    """Pressure of one chamber from its oil and volume, and what follows from it.

    Returns p (Pa), the gas volume there, 1 / p, 1 / (oil dnu/dp), dp/d oil (Pa/m3), dp/dt at constant oil (Pa/s) and
    the enthalpy (J/m3). The other arguments: oil.pressure_near.
    """
    p, gas, nu, holds = pressure_near(
        volume, oil, guess, near, per_near, gas_near, inverse, per_bulk, air
    )
    if not holds:
        nu = volume / oil
        p, gas, _ = pressure_of(nu, guess, near, gas_near, bulk, air, nu_vapour)
    per, inverse = inverses(p, oil, gas, per_bulk, air)
    return (
        p,
        gas,
        per,
        inverse,
        -nu * inverse,
        growth * inverse,
        enthalpy_with_gas(p, gas, per_bulk, air),
    )


@njit_law(forceinline=True)
def settle_both(
    axes: Any,
    params: Any,
    work: Any,
    i: int,
    guess_a: float,
    guess_b: float,
    near_a: float,
    near_b: float,
) -> None:
    """Pressures of both chambers of axis i; GAS and PER of the working numbers belong to near_a, near_b."""
    bulk, per_bulk, air, nu_v = (
        params[i, c.BULK],
        work[i, PER_BULK],
        params[i, c.AIR],
        work[i, NU_V],
    )
    (
        axes[i, c.P_A],
        work[i, GAS_A],
        work[i, PER_A],
        work[i, INVERSE_A],
        work[i, STIFF_A],
        work[i, RAMP_A],
        work[i, H_A],
    ) = settle(
        work[i, VOLUME_A],
        work[i, GROWTH_A],
        axes[i, c.OIL_A],
        guess_a,
        near_a,
        work[i, PER_A],
        work[i, GAS_A],
        work[i, INVERSE_A],
        bulk,
        per_bulk,
        air,
        nu_v,
    )
    (
        axes[i, c.P_B],
        work[i, GAS_B],
        work[i, PER_B],
        work[i, INVERSE_B],
        work[i, STIFF_B],
        work[i, RAMP_B],
        work[i, H_B],
    ) = settle(
        work[i, VOLUME_B],
        work[i, GROWTH_B],
        axes[i, c.OIL_B],
        guess_b,
        near_b,
        work[i, PER_B],
        work[i, GAS_B],
        work[i, INVERSE_B],
        bulk,
        per_bulk,
        air,
        nu_v,
    )


@njit_law
def first_stage(
    axes: Any, params: Any, work: Any, openings: Any, k: int, ps: float, pt: float, h: float
) -> tuple[float, float]:
    """Flows and slopes of all axes at the substep's start; rates as y + u q.

    Returns what they draw from the supply, m3/s, and its slope by q, the rate of the supply's pressure.
    """
    gh = GAMMA * h
    total = rise = 0.0
    for i in range(axes.shape[0]):
        pa, pb, ci, co = axes[i, c.P_A], axes[i, c.P_B], work[i, INNER_LEAK], work[i, OUTER_LEAK]
        o, o_next = openings[i, k], openings[i, k + 1]
        sa, ta, esa, eta, gsa, gta = port(
            pa,
            ps,
            pt,
            params[i, c.K_PA],
            params[i, c.K_AT],
            work[i, EDGE_P],
            work[i, EDGE],
            o,
            o_next,
        )
        sb, tb, esb, etb, gsb, gtb = port(
            pb,
            ps,
            pt,
            params[i, c.K_PB],
            params[i, c.K_BT],
            work[i, EDGE_P],
            work[i, EDGE],
            -o,
            -o_next,
        )
        out_a, out_b = esa + eta + ci + co, esb + etb + ci + co
        # how the flows change in time at constant oil, over g h
        work[i, CHANGE_A] = gh * (ci * work[i, RAMP_B] - out_a * work[i, RAMP_A]) + GAMMA * (
            gsa + gta
        )
        work[i, CHANGE_B] = gh * (ci * work[i, RAMP_A] - out_b * work[i, RAMP_B]) + GAMMA * (
            gsb + gtb
        )
        change = GAMMA * (gsa + gsb) - gh * (esa * work[i, RAMP_A] + esb * work[i, RAMP_B])
        work[i, HOSE_IN_A] = (
            work[i, KEEP] * work[i, CAP_A] * (pa - axes[i, c.HOSE_P] + gh * work[i, RAMP_A])
        )
        work[i, HOSE_IN_B] = (
            work[i, KEEP] * work[i, CAP_B] * (pb - axes[i, c.HOSE_P_B] + gh * work[i, RAMP_B])
        )
        cross = ci * (pa - pb)
        ra = sa + ta - cross - co * (pa - pt) + work[i, CHANGE_A] - work[i, HOSE_IN_A]
        rb = sb + tb + cross - co * (pb - pt) + work[i, CHANGE_B] - work[i, HOSE_IN_B]
        ga, gb = gh * work[i, STIFF_A], gh * work[i, STIFF_B]
        maa = 1.0 + ga * (out_a + work[i, KEEP] * work[i, CAP_A])
        mbb = 1.0 + gb * (out_b + work[i, KEEP] * work[i, CAP_B])
        inverse = 1.0 / (maa * mbb - ga * gb * ci * ci)
        work[i, INV_AA], work[i, INV_AB], work[i, INV_BA], work[i, INV_BB] = (
            mbb * inverse,
            gb * ci * inverse,
            ga * ci * inverse,
            maa * inverse,
        )
        work[i, U_A] = gh * (work[i, INV_AA] * esa + work[i, INV_AB] * esb)
        work[i, U_B] = gh * (work[i, INV_BA] * esa + work[i, INV_BB] * esb)
        work[i, Y_A] = work[i, INV_AA] * ra + work[i, INV_AB] * rb
        work[i, Y_B] = work[i, INV_BA] * ra + work[i, INV_BB] * rb
        work[i, FROM_S_A], work[i, FROM_S_B] = gh * esa, gh * esb
        work[i, K_DRAWN] = change  # kept for the second stage
        work[i, DRAWN] = (
            sa
            + sb
            + change
            - work[i, FROM_S_A] * work[i, STIFF_A] * work[i, Y_A]
            - work[i, FROM_S_B] * work[i, STIFF_B] * work[i, Y_B]
        )
        work[i, RISE] = work[i, FROM_S_A] * (1.0 - work[i, STIFF_A] * work[i, U_A]) + work[
            i, FROM_S_B
        ] * (1.0 - work[i, STIFF_B] * work[i, U_B])
        total += work[i, DRAWN]
        rise += work[i, RISE]
    return total, rise


@njit_law
def second_stage(
    axes: Any,
    params: Any,
    work: Any,
    openings: Any,
    k: int,
    q: float,
    ps: float,
    pt: float,
    h: float,
) -> float:
    """Fill in q, then the flows at the substep's end on the first stage's prediction; returns what they draw, m3/s."""
    gh = GAMMA * h
    total = 0.0
    for i in range(axes.shape[0]):
        ka, kb = work[i, Y_A] + work[i, U_A] * q, work[i, Y_B] + work[i, U_B] * q
        kha = work[i, HOSE_IN_A] + work[i, KEEP] * work[i, CAP_A] * gh * work[i, STIFF_A] * ka
        khb = work[i, HOSE_IN_B] + work[i, KEEP] * work[i, CAP_B] * gh * work[i, STIFF_B] * kb
        drawn = work[i, DRAWN] + work[i, RISE] * q
        pa, pb = predicted(axes, params, work, i, ka, kb, h)
        work[i, GUESS_A], work[i, GUESS_B] = pa, pb
        ci, co, o = work[i, INNER_LEAK], work[i, OUTER_LEAK], openings[i, k + 1]
        sa, ta, _, _, _, _ = port(
            pa, ps, pt, params[i, c.K_PA], params[i, c.K_AT], work[i, EDGE_P], work[i, EDGE], o, o
        )
        sb, tb, _, _, _, _ = port(
            pb, ps, pt, params[i, c.K_PB], params[i, c.K_BT], work[i, EDGE_P], work[i, EDGE], -o, -o
        )
        hose_a, hose_b = axes[i, c.HOSE_P], axes[i, c.HOSE_P_B]
        if work[i, CAP_A] > 0.0:
            hose_a += h * kha / params[i, c.HOSE_CAP]
        if work[i, CAP_B] > 0.0:
            hose_b += h * khb / params[i, c.HOSE_CAP_B]
        work[i, HOSE_IN_A] = work[i, KEEP] * (
            work[i, CAP_A] * (pa - hose_a - gh * work[i, RAMP_A]) - 2.0 * kha
        )
        work[i, HOSE_IN_B] = work[i, KEEP] * (
            work[i, CAP_B] * (pb - hose_b - gh * work[i, RAMP_B]) - 2.0 * khb
        )
        cross = ci * (pa - pb)
        ra = (
            sa
            + ta
            - cross
            - co * (pa - pt)
            - 2.0 * (ka + kha)
            - work[i, CHANGE_A]
            - work[i, HOSE_IN_A]
        )
        rb = (
            sb
            + tb
            + cross
            - co * (pb - pt)
            - 2.0 * (kb + khb)
            - work[i, CHANGE_B]
            - work[i, HOSE_IN_B]
        )
        work[i, Y_A] = work[i, INV_AA] * ra + work[i, INV_AB] * rb
        work[i, Y_B] = work[i, INV_BA] * ra + work[i, INV_BB] * rb
        work[i, DRAWN] = (
            sa
            + sb
            - 2.0 * drawn
            - work[i, K_DRAWN]
            - work[i, FROM_S_A] * work[i, STIFF_A] * work[i, Y_A]
            - work[i, FROM_S_B] * work[i, STIFF_B] * work[i, Y_B]
        )
        work[i, K_A], work[i, K_B], work[i, KH_A], work[i, KH_B], work[i, K_DRAWN] = (
            ka,
            kb,
            kha,
            khb,
            drawn,
        )
        total += work[i, DRAWN]
    return total


@njit_law(forceinline=True)
def predicted(
    axes: Any, params: Any, work: Any, i: int, ka: float, kb: float, h: float
) -> tuple[float, float]:
    """Pressures of both chambers of axis i at the substep's end if the rates ka, kb hold; volumes advance."""
    bulk, per_bulk, air, nu_v = (
        params[i, c.BULK],
        work[i, PER_BULK],
        params[i, c.AIR],
        work[i, NU_V],
    )
    work[i, VOLUME_A] += h * work[i, GROWTH_A]
    work[i, VOLUME_B] += h * work[i, GROWTH_B]
    near_a, near_b = axes[i, c.P_A], axes[i, c.P_B]
    oil_a, oil_b = axes[i, c.OIL_A] + h * ka, axes[i, c.OIL_B] + h * kb
    guess_a = near_a + h * (work[i, STIFF_A] * ka + work[i, RAMP_A])
    guess_b = near_b + h * (work[i, STIFF_B] * kb + work[i, RAMP_B])
    pa, _, _, holds_a = pressure_near(
        work[i, VOLUME_A],
        oil_a,
        guess_a,
        near_a,
        work[i, PER_A],
        work[i, GAS_A],
        work[i, INVERSE_A],
        per_bulk,
        air,
    )
    pb, _, _, holds_b = pressure_near(
        work[i, VOLUME_B],
        oil_b,
        guess_b,
        near_b,
        work[i, PER_B],
        work[i, GAS_B],
        work[i, INVERSE_B],
        per_bulk,
        air,
    )
    if not holds_a:
        pa, _, _ = pressure_of(
            work[i, VOLUME_A] / oil_a, guess_a, near_a, work[i, GAS_A], bulk, air, nu_v
        )
    if not holds_b:
        pb, _, _ = pressure_of(
            work[i, VOLUME_B] / oil_b, guess_b, near_b, work[i, GAS_B], bulk, air, nu_v
        )
    return pa, pb


@njit_law
def close_step(
    axes: Any,
    params: Any,
    work: Any,
    k: int,
    q: float,
    h_supply: float,
    h_tank: float,
    h: float,
    a: Any,
    b: Any,
) -> tuple[float, float, float]:
    """Fill in the second q and move the oil; pressures at the end into a[:, k + 1], b[:, k + 1].

    h_supply: mean enthalpy of the drawn oil, J/m3. Returns oil drawn and returned to the tank (m3) and heat (J; what
    hoses keep is still in it: `kept_by_hoses`).
    """
    gh = GAMMA * h
    total = back = heat = 0.0
    for i in range(axes.shape[0]):
        ka, kb = work[i, Y_A] + work[i, U_A] * q, work[i, Y_B] + work[i, U_B] * q
        kha = work[i, HOSE_IN_A] + work[i, KEEP] * work[i, CAP_A] * gh * work[i, STIFF_A] * ka
        khb = work[i, HOSE_IN_B] + work[i, KEEP] * work[i, CAP_B] * gh * work[i, STIFF_B] * kb
        drawn = 0.5 * h * (3.0 * work[i, K_DRAWN] + work[i, DRAWN] + work[i, RISE] * q)
        into_a, into_b = 0.5 * h * (3.0 * work[i, K_A] + ka), 0.5 * h * (3.0 * work[i, K_B] + kb)
        hose_a, hose_b = (
            0.5 * h * (3.0 * work[i, KH_A] + kha),
            0.5 * h * (3.0 * work[i, KH_B] + khb),
        )
        if work[i, CAP_A] > 0.0:
            axes[i, c.HOSE_P] += hose_a / params[i, c.HOSE_CAP]
        if work[i, CAP_B] > 0.0:
            axes[i, c.HOSE_P_B] += hose_b / params[i, c.HOSE_CAP_B]
        axes[i, c.OIL_A] += into_a
        axes[i, c.OIL_B] += into_b
        was_a, was_b = work[i, H_A], work[i, H_B]
        # The second stage corrects the first by k1 + k2: start looking from there.
        guess_a = work[i, GUESS_A] + 0.5 * h * work[i, STIFF_A] * (work[i, K_A] + ka)
        guess_b = work[i, GUESS_B] + 0.5 * h * work[i, STIFF_B] * (work[i, K_B] + kb)
        settle_both(axes, params, work, i, guess_a, guess_b, axes[i, c.P_A], axes[i, c.P_B])
        returned = drawn - into_a - into_b - hose_a - hose_b
        total += drawn
        back += returned
        mean_a, mean_b = 0.5 * (was_a + work[i, H_A]), 0.5 * (was_b + work[i, H_B])
        heat += drawn * h_supply - returned * h_tank - (into_a * mean_a + into_b * mean_b)
        a[i, k + 1], b[i, k + 1] = axes[i, c.P_A], axes[i, c.P_B]
    return total, back, heat


@njit_law(forceinline=True)
def kept_by_hoses(axes: Any, params: Any, work: Any, i: int) -> float:
    """Energy that the hoses of one axis took in since `begin`, J."""
    kept = 0.0
    if work[i, CAP_A] > 0.0:
        middle = 0.5 * (axes[i, c.HOSE_P] + work[i, HOSE_0_A])
        kept += (
            params[i, c.HOSE_CAP]
            * (axes[i, c.HOSE_P] - work[i, HOSE_0_A])
            * enthalpy(middle, params[i, c.BULK], params[i, c.AIR])
        )
    if work[i, CAP_B] > 0.0:
        middle = 0.5 * (axes[i, c.HOSE_P_B] + work[i, HOSE_0_B])
        kept += (
            params[i, c.HOSE_CAP_B]
            * (axes[i, c.HOSE_P_B] - work[i, HOSE_0_B])
            * enthalpy(middle, params[i, c.BULK], params[i, c.AIR])
        )
    return kept
