"""What the detectors look at: one row of signals for four feet from this sample's measurements, causal.

Beside the chain's estimates there is `CARRIED`, a load with the friction of a piston that hardly moves. The oil tells
how far it moves, long before the encoder does: with flows Q of the valve (spool followed from the command) and its
leaks,

    dx = (k_A Q_A dt / A_A - k_B Q_B dt / A_B - dFp) / k_oil,   k_i = beta_i A_i^2 / V_i,   k_oil = k_A + k_B

and friction follows as a spring that slips: F_f = clip(F_f + k_seal dx, -g_minus, g_plus). A foot that has lost more
than twice the break-away force has slipped, so that its friction is known again, whatever it was before.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.estimation.live import encoder
from testbed.estimation.live import leg_columns as k
from testbed.estimation.live.friction_set import published
from testbed.machine.model import Machine

Array = NDArray[np.float64]

SIGNALS = (
    "one_chamber",
    "two_chamber",
    "friction",
    "kbf",
    "modified_kbf",
    "own",
    "own_low",
    "own_high",
    "own_sd",
    "expected",
    "carried",
    "reference",
    "rate",
    "speed",
    "others",
    "turning",
    "balance",
    "velocity",
    "published",
)
(
    ONE_CHAMBER,
    TWO_CHAMBER,
    FRICTION,
    KBF,
    MODIFIED_KBF,
    OWN,
    OWN_LOW,
    OWN_HIGH,
    OWN_SD,
    EXPECTED,
    CARRIED,
    REFERENCE,
    RATE,
    SPEED,
    OTHERS,
    TURNING,
    BALANCE,
    VELOCITY,
    PUBLISHED,
) = range(len(SIGNALS))
"""N; CARRIED as above, REFERENCE its mean over some seconds, RATE its change N/s, SPEED of the piston from the oil
m/s, OTHERS the change of the other feet's load over the last 20 ms N, TURNING rate of the body rad/s, BALANCE the
load with no friction and no inertia N, VELOCITY the encoder's m/s, PUBLISHED the friction (5) at it N."""

# --- state of a leg ---------------------------------------------------------------------------------------------
STARTED, SMOOTH_A, SMOOTH_B, SEAL_N, SPOOL, SPOOL_RATE, FAST, SLOW, MEAN, MOVED, ENCODER = range(11)
STATE_SIZE = ENCODER + encoder.STATE_SIZE
# --- numbers of the machine ---------------------------------------------------------------------------------------
(
    DT,
    RATED,
    DROP,
    EDGE_PA,
    EDGE_AT,
    EDGE_PB,
    EDGE_BT,
    WN,
    ZETA,
    BAND,
    LEAK,
    EDGE_LEAK,
    EDGE_LEAK_P,
    TANK,
    AIR,
    RESOLUTION,
    PARAMETERS,
) = range(17)
SMOOTH_S = 0.0015
ATMOSPHERE_PA, OBSERVER_RAD_S, REST_M_S = 1.0e5, 60.0, 0.001
RATE_FAST_S, RATE_SLOW_S, REFERENCE_S, MOVED_S = 0.005, 0.02, 3.0, 0.02
"""Time constants: pressures; the two means whose difference is RATE; REFERENCE; SPEED from the oil (E)."""


def parameters(machine: Machine, dt_s: float) -> Array:
    """PARAMETERS numbers of the believed machine for a step of `dt_s`."""
    v, oil, unit = machine.valve, machine.oil, machine.power_unit
    out = np.zeros(PARAMETERS)
    out[DT], out[RATED], out[DROP] = (
        dt_s,
        v.rated_flow_vertical_m3_s,
        v.rated_drop_per_edge_pa,
    )
    for column, edge in (
        (EDGE_PA, "edge_pa"),
        (EDGE_AT, "edge_at"),
        (EDGE_PB, "edge_pb"),
        (EDGE_BT, "edge_bt"),
    ):
        out[column] = getattr(v, edge)
    out[WN], out[ZETA], out[BAND] = (
        2.0 * math.pi * v.natural_frequency_hz,
        v.damping,
        v.deadband,
    )
    out[LEAK], out[EDGE_LEAK] = oil.internal_leakage_m3_s_pa, v.edge_leakage_m3_s_pa
    out[EDGE_LEAK_P], out[TANK], out[AIR] = (
        v.edge_leakage_supply_m3_s_pa,
        unit.tank_pressure_pa,
        oil.entrained_air,
    )
    out[RESOLUTION] = machine.sensor.encoder_linear_m
    return out


@njit
def air_compliance(gauge_pa: float, fraction: float) -> float:
    """What free air adds to 1/beta, 1/Pa (the law of hydraulics.air)."""
    share = ATMOSPHERE_PA / (max(gauge_pa, 0.0) + ATMOSPHERE_PA)
    return float(fraction / 1.4 * share / ATMOSPHERE_PA * share ** (1.0 / 1.4))


@njit
def orifice(opening: float, drop_pa: float, p: Array) -> float:
    """Flow through an edge, m3/s: rated |o| sqrt(dp / rated drop), signed by dp."""
    size = p[RATED] * abs(opening) * math.sqrt(abs(drop_pa) / p[DROP])
    return float(size if drop_pa >= 0.0 else -size)


@njit
def flows(spool: float, pa: float, pb: float, supply: float, p: Array) -> tuple[float, float]:
    """Flow into A and into B, m3/s, from spool position, gauge pressures and leaks."""
    leak = p[LEAK] * (pa - pb)
    qa = p[EDGE_LEAK_P] * (supply - pa) - p[EDGE_LEAK] * (pa - p[TANK]) - leak
    qb = p[EDGE_LEAK_P] * (supply - pb) - p[EDGE_LEAK] * (pb - p[TANK]) + leak
    o = max(abs(spool) - p[BAND], 0.0) / (1.0 - p[BAND])
    if spool > 0.0:
        qa += p[EDGE_PA] * orifice(o, supply - pa, p)
        qb -= p[EDGE_BT] * orifice(o, pb - p[TANK], p)
    else:
        qa -= p[EDGE_AT] * orifice(o, pa - p[TANK], p)
        qb += p[EDGE_PB] * orifice(o, supply - pb, p)
    return qa, qb


@njit
def oil_travel(
    da: float,
    db: float,
    pa: float,
    pb: float,
    supply: float,
    x: float,
    spool: float,
    leg: Array,
    p: Array,
) -> float:
    """How far (m) the piston moved while the pressures changed by da, db (Pa): see the module's docstring."""
    inside = min(max(x, 0.0), leg[k.STROKE])
    va, vb = (
        leg[k.DEAD_A] + leg[k.AREA_A] * inside,
        leg[k.DEAD_B] + leg[k.AREA_B] * (leg[k.STROKE] - inside),
    )
    soft = 1.0 / leg[k.BULK]
    ka = leg[k.AREA_A] ** 2 / (va * (soft + air_compliance(pa, p[AIR])))
    kb = leg[k.AREA_B] ** 2 / (vb * (soft + air_compliance(pb, p[AIR])))
    qa, qb = flows(spool, pa, pb, supply, p)
    fed = p[DT] * (ka * qa / leg[k.AREA_A] - kb * qb / leg[k.AREA_B])
    return float((fed - (da * leg[k.AREA_A] - db * leg[k.AREA_B])) / (ka + kb))


@njit
def step_leg(
    pa: float,
    pb: float,
    x: float,
    command: float,
    supply: float,
    gravity_along: float,
    leg: Array,
    p: Array,
    s: Array,
    out: Array,
    i: int,
) -> None:
    """One leg: its CARRIED, REFERENCE, RATE and SPEED into column i of `out`."""
    if not (math.isfinite(pa) and math.isfinite(pb)):
        return
    dt = p[DT]
    if s[STARTED] == 0.0:
        s[SMOOTH_A], s[SMOOTH_B], s[SPOOL], s[STARTED] = pa, pb, command, 1.0
    share = min(dt / (SMOOTH_S + dt), 1.0)
    da, db = share * (pa - s[SMOOTH_A]), share * (pb - s[SMOOTH_B])
    s[SMOOTH_A] += da
    s[SMOOTH_B] += db
    w = p[WN]
    s[SPOOL_RATE] += dt * (w * w * (command - s[SPOOL]) - 2.0 * p[ZETA] * w * s[SPOOL_RATE])
    s[SPOOL] += dt * s[SPOOL_RATE]
    dx = oil_travel(da, db, s[SMOOTH_A], s[SMOOTH_B], supply, x, s[SPOOL], leg, p)
    s[MOVED] += (dx / dt - s[MOVED]) * min(dt / MOVED_S, 1.0)
    seen = s[ENCODER:STATE_SIZE]
    encoder.observe(seen, x, p[RESOLUTION], dt, OBSERVER_RAD_S)
    v = encoder.bounded_speed(seen, p[RESOLUTION], REST_M_S)
    extra = leg[k.PRESSURE_COEFFICIENT] * (pa + pb) + leg[k.LOAD_COEFFICIENT] * max(
        out[OWN, i], 0.0
    )
    factor = 1.0 + leg[k.SLOPE] * (x / leg[k.STROKE] - 0.5)
    high = leg[1] * factor + leg[2] + extra
    low = -(leg[5] * factor + leg[6] + extra)
    s[SEAL_N] = min(max(s[SEAL_N] + leg[k.SEAL] * dx, low), high)
    viscous = v * (leg[0] if v >= 0.0 else leg[4])
    weight = (leg[k.MASS] + leg[k.EXTRA_MASS]) * gravity_along
    balance = s[SMOOTH_A] * leg[k.AREA_A] - s[SMOOTH_B] * leg[k.AREA_B] + weight + leg[k.OFFSET]
    load = balance - s[SEAL_N] - viscous
    if s[STARTED] == 1.0:
        s[FAST] = s[SLOW] = s[MEAN] = load
        s[STARTED] = 2.0
    s[FAST] += (load - s[FAST]) * min(dt / RATE_FAST_S, 1.0)
    s[SLOW] += (load - s[SLOW]) * min(dt / RATE_SLOW_S, 1.0)
    s[MEAN] += (load - s[MEAN]) * min(dt / REFERENCE_S, 1.0)
    out[CARRIED, i], out[REFERENCE, i] = load, s[MEAN]
    out[RATE, i] = (s[FAST] - s[SLOW]) / (RATE_SLOW_S - RATE_FAST_S)
    out[SPEED, i], out[BALANCE, i], out[VELOCITY, i] = s[MOVED], balance, v
    out[PUBLISHED, i] = published(v, leg[:8], extra, factor)


@njit
def step(
    pa: Array,
    pb: Array,
    q: Array,
    u: Array,
    supply: float,
    gravity: Array,
    turning: Array,
    estimates: Array,
    expected: Array,
    legs: Array,
    p: Array,
    state: Array,
    out: Array,
) -> None:
    """One sample. pa, pb (Pa), q, u [12] by axis; supply Pa; gravity, turning [3] in the body frame; the chain's
    estimates [9, 4]; expected [4]; legs of chain.py; p; state [4, STATE_SIZE] -> out [SIGNALS, 4]."""
    total = 0.0
    for leg in range(4):
        for row in range(9):
            out[row, leg] = estimates[row, leg]
        out[EXPECTED, leg] = expected[leg]
        out[TURNING, leg] = math.sqrt(turning[0] ** 2 + turning[1] ** 2)
        i = 3 * leg + 2
        one = legs[leg]
        a = (pa[i] - one[k.ZERO_A]) / (1.0 + one[k.GAIN_A])
        b = (pb[i] - one[k.ZERO_B]) / (1.0 + one[k.GAIN_B])
        step_leg(a, b, q[i], u[i], supply, -gravity[2], one, p, state[leg], out, leg)
        total += state[leg, FAST] - state[leg, SLOW]
    for leg in range(4):
        out[OTHERS, leg] = total - (state[leg, FAST] - state[leg, SLOW])


@njit
def run(data: Array, columns: Array, legs: Array, p: Array, state: Array, out: Array) -> None:
    """`step` over the rows of a run's data (n, columns of data.parquet) -> out [n, SIGNALS, 4].

    `columns`: where position, pressure_a, pressure_b, valve, supply_pressure, the estimates, expected, attitude and
    angular_rate begin.
    """
    q, a, b, u, supply = columns[0], columns[1], columns[2], columns[3], columns[4]
    estimate, expected, attitude, turn = columns[5], columns[6], columns[7], columns[8]
    estimates, gravity = np.empty((9, 4)), np.empty(3)
    for row in range(data.shape[0]):
        d = data[row]
        for i in range(9):
            for leg in range(4):
                estimates[i, leg] = d[estimate + 4 * i + leg]
        roll, pitch = d[attitude], d[attitude + 1]
        gravity[0] = 9.81 * math.sin(pitch)
        gravity[1] = -9.81 * math.cos(pitch) * math.sin(roll)
        gravity[2] = -9.81 * math.cos(pitch) * math.cos(roll)
        step(
            d[a : a + 12],
            d[b : b + 12],
            d[q : q + 12],
            d[u : u + 12],
            d[supply],
            gravity,
            d[turn : turn + 3],
            estimates,
            d[expected : expected + 4],
            legs,
            p,
            state,
            out[row],
        )
