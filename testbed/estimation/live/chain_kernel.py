"""The compiled step of the live chain (see chain.py): four legs, one call, nothing allocated."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.estimation.detectors import combined, signals
from testbed.estimation.filters import kbf, modified_kbf, persistent
from testbed.estimation.live import contact, encoder, friction_at_rest
from testbed.estimation.live.friction_set import FRICTION_SIZE, friction_set, published
from testbed.estimation.live.leg_columns import (
    AREA_A,
    AREA_B,
    BULK,
    CUSHION,
    CUSHION_START,
    DEAD_A,
    DEAD_B,
    DEADBAND,
    DRIFT_A,
    EXTRA_MASS,
    GAIN_A,
    GAIN_B,
    LOAD_COEFFICIENT,
    MASS,
    OFFSET,
    PRESSURE_COEFFICIENT,
    RATE,
    REFERENCE,
    SEAL,
    SLOPE,
    SPRING,
    SPRING_REST,
    STROKE,
    ZERO_A,
    ZERO_B,
)
from testbed.estimation.live.own_kernel import OUT_ROWS, step_own

Array = NDArray[np.float64]

METHODS = ("one_chamber", "two_chamber", "friction", "kbf", "modified_kbf", "own")
FOOT = ("own_x", "own_y", "own_z", "own_x_sd", "own_y_sd", "own_z_sd")
"""The force of the ground on the foot in the body frame, N, and its standard deviations, N."""
OUTPUTS = (*METHODS, "own_low", "own_high", "own_sd", "velocity", "acceleration", "contact", *FOOT)
"""Rows of the output [len(OUTPUTS), 4]: N; N; N; m/s; m/s2; 0 or 1; N."""

# what is common to the legs
DT, RESOLUTION, OBSERVER, REST, SLIDE, PRESSURE_SD, FRICTION_SD, SPEED_SD, ACCELERATION_SD, OIL = (
    range(10)
)
FILTER = 10  # Q, R, e_max, hold
CONTACT = 14  # on, off, dwell on, dwell off
SUPPLY = 18  # measured, Pa
COMBINED = 19  # numbers of the combined detector
WATCH = COMBINED + combined.NUMBERS  # numbers of detectors/signals.py
# a leg's state: encoder, the three filters, contact, friction at rest, time
ENCODER = 0
KBF = ENCODER + encoder.STATE_SIZE
MODIFIED = KBF + kbf.STATE_SIZE
OWN = MODIFIED + kbf.STATE_SIZE
WORD = OWN + persistent.STATE_SIZE
AT_REST = WORD + contact.STATE_SIZE
TIME = AT_REST + friction_at_rest.STATE_SIZE
SLID = TIME + 1
FACTOR = SLID + 1  # work space: this leg's friction (5) at the oil's temperature
WATCHED = FACTOR + FRICTION_SIZE
MIXED = WATCHED + signals.STATE_SIZE
STATE_COLUMNS = MIXED + combined.STATE_SIZE


@njit
def step_leg(
    measured_a: float,
    measured_b: float,
    reading: float,
    gravity_along: float,
    command: float,
    leg: Array,
    c: Array,
    s: Array,
    o: Array,
) -> None:
    """One leg, one step: pressures Pa, encoder m, gravity along extension m/s2, valve command -> o[OUTPUTS].

    Corrects the pressures for believed sensor errors first; published columns (1), (3) use them corrected too.
    """
    dt = c[DT]
    pa = (measured_a - leg[ZERO_A] - leg[DRIFT_A] * s[TIME]) / (1.0 + leg[GAIN_A])
    pb = (measured_b - leg[ZERO_B]) / (1.0 + leg[GAIN_B])
    s[TIME] += dt
    e = s[ENCODER:KBF]
    encoder.observe(e, reading, c[RESOLUTION], dt, c[OBSERVER])
    v, a = encoder.bounded_speed(e, c[RESOLUTION], c[REST]), e[encoder.A]
    slides = encoder.sliding(e, c[RESOLUTION], c[REST], c[SLIDE])

    f = s[FACTOR:WATCHED]
    for k in range(FRICTION_SIZE):
        f[k] = leg[k]
    if leg[RATE] != 0.0:
        thinning = math.exp(-leg[RATE] * (c[OIL] - leg[REFERENCE]))
        f[0] *= thinning
        f[4] *= thinning
    x = e[encoder.X]
    factor = 1.0 + leg[SLOPE] * (x / leg[STROKE] - 0.5)
    extra = leg[PRESSURE_COEFFICIENT] * (pa + pb) + leg[LOAD_COEFFICIENT] * max(s[OWN], 0.0)

    two = pa * leg[AREA_A] - pb * leg[AREA_B]
    balance = two + (leg[MASS] + leg[EXTRA_MASS]) * (gravity_along - a) + leg[OFFSET]
    balance += leg[CUSHION] * max(leg[CUSHION_START] - x, 0.0) - leg[SPRING] * (
        x - leg[SPRING_REST]
    )
    simple = balance - published(v, f, extra, factor)
    low_f, high_f = friction_set(v, e[encoder.DIRECTION], slides, f, extra, factor)
    low, high = balance - high_f, balance - low_f
    k_oil = friction_at_rest.oil_stiffness(
        x, leg[STROKE], leg[AREA_A], leg[AREA_B], leg[DEAD_A], leg[DEAD_B], leg[BULK]
    )
    push = 0.0 if abs(command) < leg[DEADBAND] else 1.0 if command > 0.0 else -1.0
    if slides > 0.0 and s[SLID] == 0.0:
        s[OWN + persistent.LIVELY] = (
            1.0  # the set has just collapsed: what follows is news, not a spike
        )
    s[SLID] = slides
    friction = friction_at_rest.step(
        s[AT_REST:TIME], two, low_f, high_f, slides, push, leg[SEAL] / k_oil, dt
    )

    p = c[FILTER:CONTACT]
    o[0] = pa * leg[AREA_A]
    o[1] = two
    o[2] = simple
    o[3] = kbf.step(s[KBF:MODIFIED], simple, p)
    o[4] = modified_kbf.step(s[MODIFIED:OWN], simple, p)
    o[5] = persistent.step(s[OWN:WORD], balance - friction, p)
    o[6], o[7] = low, high
    o[8] = _standard_deviation(low, high, v, s[OWN + 1], f, leg, c)
    o[9], o[10] = v, a
    o[12] = o[13] = o[15] = o[16] = 0.0
    o[14], o[17] = o[5], o[8]


@njit
def _standard_deviation(
    low: float, high: float, v: float, variance: float, f: Array, leg: Array, c: Array
) -> float:
    """Of `own`, N: sensors' accuracy through the areas, friction's uncertainty, speed, acceleration, the set's width.

    At rest friction spreads over its set by friction_at_rest.SPREAD of the half width.
    """
    sensors = c[PRESSURE_SD] ** 2 * (leg[AREA_A] ** 2 + leg[AREA_B] ** 2)
    slope = f[0] if v >= 0.0 else f[4]
    friction = (c[FRICTION_SD] * 0.5 * (f[1] + f[5])) ** 2 + (slope * c[SPEED_SD]) ** 2
    inertia = ((leg[MASS] + leg[EXTRA_MASS]) * c[ACCELERATION_SD]) ** 2
    return math.sqrt(
        sensors
        + friction
        + inertia
        + variance
        + (0.5 * friction_at_rest.SPREAD * (high - low)) ** 2
    )


@njit(apart=True)
def step_chain(
    pa: Array,
    pb: Array,
    q: Array,
    gravity: Array,
    u: Array,
    rope: Array,
    attitude: Array,
    inertial: Array,
    carrying: Array,
    drill: Array,
    legs: Array,
    c: Array,
    state: Array,
    body: Array,
    own: Array,
    out: Array,
) -> None:
    """All four legs, one step: pa, pb, q, u [12] by axis, gravity [3] in the body frame, out [len(OUTPUTS), 4].

    rope [2] N, attitude [3] rad, inertial [6] rad/s and m/s2, carrying [4] 0 or 1 and drill [KNOWN]
    (laws/drill.py) serve the whole body's balance (own_kernel.py), where `body` believes in one. The vertical joint
    extends along -z of the body, so that gravity along extension is -gravity[2].
    """
    for leg in range(4):
        i = 3 * leg + 2
        step_leg(pa[i], pb[i], q[i], -gravity[2], u[i], legs[leg], c, state[leg], out[:, leg])
    if body.size > 0:
        found = np.empty((OUT_ROWS, 4))
        step_own(
            pa,
            pb,
            q,
            gravity,
            u,
            c[OIL],
            rope,
            attitude,
            inertial,
            carrying,
            drill,
            body,
            own,
            found,
        )
        for leg in range(4):
            for k in range(4):
                out[5 + k, leg] = found[k, leg]
            for k in range(6):
                out[12 + k, leg] = found[4 + k, leg]
    contact_words(pa, pb, q, gravity, u, legs, c, state, out)


@njit
def contact_words(
    pa: Array,
    pb: Array,
    q: Array,
    gravity: Array,
    u: Array,
    legs: Array,
    c: Array,
    state: Array,
    out: Array,
) -> None:
    """The best detector of detectors/table.py, live: its load through hysteresis and dwell into out[11]."""
    seen, score = np.empty((len(signals.SIGNALS), 4)), np.empty(4)
    for leg in range(4):
        i, one = 3 * leg + 2, legs[leg]
        a = (pa[i] - one[ZERO_A]) / (1.0 + one[GAIN_A])
        b = (pb[i] - one[ZERO_B]) / (1.0 + one[GAIN_B])
        seen[signals.OWN, leg] = out[5, leg]
        signals.step_leg(
            a,
            b,
            q[i],
            u[i],
            c[SUPPLY],
            -gravity[2],
            one,
            c[WATCH:],
            state[leg, WATCHED:MIXED],
            seen,
            leg,
        )
    combined.step(seen, state[:, MIXED:STATE_COLUMNS], c[COMBINED:WATCH], score)
    for leg in range(4):
        out[11, leg] = contact.step(state[leg, WORD:AT_REST], -score[leg], c[DT], c[CONTACT:SUPPLY])


@njit
def replay_chain(
    pa: Array,
    pb: Array,
    q: Array,
    gravity: Array,
    u: Array,
    oil: Array,
    supply: Array,
    rope: Array,
    attitude: Array,
    inertial: Array,
    carrying: Array,
    drill: Array,
    legs: Array,
    c: Array,
    state: Array,
    body: Array,
    own: Array,
    out: Array,
) -> None:
    """`step_chain` over n rows: measured arguments with a first dimension n, oil [n] degC, supply [n] Pa."""
    for k in range(pa.shape[0]):
        c[OIL], c[SUPPLY] = oil[k], supply[k]
        step_chain(
            pa[k],
            pb[k],
            q[k],
            gravity[k],
            u[k],
            rope[k],
            attitude[k],
            inertial[k],
            carrying[k],
            drill[k],
            legs,
            c,
            state,
            body,
            own,
            out[k],
        )
