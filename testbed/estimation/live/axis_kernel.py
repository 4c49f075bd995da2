"""One cylinder, live and compiled: pressures, encoder and command -> its force without friction, and friction as a set.

The piston's force less friction drives the joint: F = pA A_A - pB A_B + F_end - F_f. Friction is (5), thinned by the
oil's warmth, with what the machine's file declares beside it: more of it out on the stroke, under pressure, under side
load and after a rest. Where the piston may be at rest it is a set; friction_at_rest.py names the likeliest value in it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import fill, njit
from testbed.estimation.live import encoder, friction_at_rest
from testbed.estimation.live.friction_set import FRICTION_SIZE, friction_set, magnitude

Array = NDArray[np.float64]

# --- what is believed of an axis: friction (5)[8], then these (columns of 12 x AXIS_BELIEFS) ---------------------
(
    AREA_A,
    AREA_B,
    STROKE,
    RESOLUTION,
    SLOPE,
    PRESSURE,
    SIDE,
    LOAD,
    WARMTH_RATE,
    WARMTH_REFERENCE,
    DWELL_GAIN,
    DWELL_TIME,
    SEAL,
    DEAD_A,
    DEAD_B,
    BULK,
    DEADBAND,
    CUSHION_LENGTH,
    CUSHION_DAMPING,
    GAIN_A,
    GAIN_B,
    ZERO_A,
    ZERO_B,
    DRIFT_A,
    SPRING,
    SPRING_REST,
    CUSHION,
    CUSHION_START,
    OFFSET,
    THERMAL_N_K,
    ZERO_SD,
    AXIS_BELIEFS,
) = range(FRICTION_SIZE, FRICTION_SIZE + 32)
"""m2; m2; m; m; 1; m2; 1; 1; 1/K; degC; 1; s; N/m; m3; m3; Pa; 1; m; N s/m; 1; 1; Pa; Pa; Pa/s; N/m; m; N/m; m; N;
standard deviation of the zero's drift N/K and of the calibration itself N."""

# --- state of an axis (columns of 12 x AXIS_STATES) --------------------------------------------------------------
ENCODER = 0
AT_REST = encoder.STATE_SIZE
(
    DWELL,
    TIME,
    FORCE,
    FRICTION,
    LOW,
    HIGH,
    SPREAD,
    SLIDES,
    SENSE,
    SPEED,
    ACCELERATION,
    EXTENSION,
    CHANGED,
) = range(AT_REST + friction_at_rest.STATE_SIZE, AT_REST + friction_at_rest.STATE_SIZE + 13)
"""Dwell 1; time s; force without friction N; likeliest friction N, its set's ends N and its standard deviation N;
how surely it slides 0..1; -1, 0, 1: the way it slid last; m/s; m/s2; m; 1 where the set has just become another."""
THINNED = CHANGED + 1  # work space: friction (5) at the oil's temperature
AXIS_STATES = THINNED + FRICTION_SIZE

# --- how the chain decides (common to the axes) ------------------------------------------------------------------
(
    DT,
    OBSERVER,
    REST,
    SLIDE,
    FRICTION_SHARE,
    SPEED_SD,
    REST_SHARE,
    RICH,
    HISTORY,
    AXIS_COMMON,
) = range(10)
"""s; rad/s; m/s; m/s; uncertainty of sliding friction 1; of the speed m/s; one standard deviation at rest as a share
of the set's half width; switches 0/1: friction beyond (5), and the memory of friction at rest."""
END_ZONE_M = 1.0e-3
"""Nearer to a stop than this the stop may carry any load."""
END_FORCE_N = 4.0e4


@njit
def cushion_n(x_m: float, v_m_s: float, b: Array) -> float:
    """Declared end cushion, N along extension: a damper growing over the last stretch before either end."""
    length = b[CUSHION_LENGTH]
    if length <= 0.0:
        return 0.0
    if v_m_s < 0.0 and x_m < length:
        return float(-b[CUSHION_DAMPING] * v_m_s * (length - max(x_m, 0.0)) / length)
    left = b[STROKE] - x_m
    if v_m_s > 0.0 and left < length:
        return float(-b[CUSHION_DAMPING] * v_m_s * (length - max(left, 0.0)) / length)
    return 0.0


@njit
def step_axis(
    measured_a: float,
    measured_b: float,
    reading_m: float,
    command: float,
    load_n: float,
    side_n: float,
    oil_degc: float,
    remembers: bool,
    c: Array,
    b: Array,
    s: Array,
) -> None:
    """One cylinder, one step: pressures Pa, extension m, valve command 1, load along and across the rod N, oil degC;
    whether friction at rest is followed by its history (else the middle of its set counts as likeliest).

    c[AXIS_COMMON], b[AXIS_BELIEFS]; results in s[AXIS_STATES]: FORCE, FRICTION with LOW, HIGH and SPREAD, and motion.
    """
    dt = c[DT]
    pa = (measured_a - b[ZERO_A] - b[DRIFT_A] * s[TIME]) / (1.0 + b[GAIN_A])
    pb = (measured_b - b[ZERO_B]) / (1.0 + b[GAIN_B])
    s[TIME] += dt
    e = s[ENCODER:AT_REST]
    encoder.observe(e, reading_m, b[RESOLUTION], dt, c[OBSERVER])
    v = encoder.bounded_speed(e, b[RESOLUTION], c[REST])
    slides = encoder.sliding(e, b[RESOLUTION], c[REST], c[SLIDE])
    x = e[encoder.X]
    s[SPEED], s[EXTENSION] = v, x
    s[ACCELERATION] = e[encoder.A] if slides > 0.0 else 0.0
    piston = pa * b[AREA_A] - pb * b[AREA_B]
    force = piston + cushion_n(x, v, b) + b[OFFSET] - b[SPRING] * (x - b[SPRING_REST])
    s[FORCE] = force + b[CUSHION] * max(b[CUSHION_START] - x, 0.0)

    f = s[THINNED:AXIS_STATES]
    fill(f[:FRICTION_SIZE], b)
    factor, extra = 1.0, 0.0
    if c[RICH] != 0.0:
        thinning = math.exp(-b[WARMTH_RATE] * (oil_degc - b[WARMTH_REFERENCE]))
        f[0] *= thinning
        f[4] *= thinning
        factor += b[SLOPE] * (x / b[STROKE] - 0.5)
        together = pa + pb if math.isfinite(pa + pb) else 0.0  # a sample is missing
        extra = b[PRESSURE] * together + b[SIDE] * side_n + b[LOAD] * max(load_n, 0.0)
        aim = b[DWELL_GAIN] if slides <= 0.0 else 0.0
        s[DWELL] += (aim - s[DWELL]) * min(dt / b[DWELL_TIME] if slides <= 0.0 else 1.0, 1.0)
        f[2] += s[DWELL] * (f[1] * factor + extra)
        f[6] += s[DWELL] * (f[5] * factor + extra)
    sense = e[encoder.DIRECTION]
    low, high = friction_set(v, sense, slides, f, extra, factor)
    k_oil = friction_at_rest.oil_stiffness(
        x, b[STROKE], b[AREA_A], b[AREA_B], b[DEAD_A], b[DEAD_B], b[BULK]
    )
    push = 0.0 if abs(command) < b[DEADBAND] else 1.0 if command > 0.0 else -1.0
    memory = s[AT_REST:DWELL]
    likely = friction_at_rest.step(memory, piston, low, high, slides, push, b[SEAL] / k_oil, dt)
    if c[HISTORY] == 0.0 or not remembers:
        likely = 0.5 * (low + high)
    level = 0.5 * (
        magnitude(abs(v), True, f, extra, factor) + magnitude(abs(v), False, f, extra, factor)
    )
    sliding_sd = math.sqrt((c[FRICTION_SHARE] * level) ** 2 + (max(f[0], f[4]) * c[SPEED_SD]) ** 2)
    spread = math.sqrt(sliding_sd**2 + (0.5 * c[REST_SHARE] * (high - low)) ** 2)
    if (
        x < END_ZONE_M or x > b[STROKE] - END_ZONE_M
    ):  # the stop pushes as the load asks for: nothing is known
        low, high, spread = low - END_FORCE_N, high + END_FORCE_N, END_FORCE_N
    now = sense if slides >= 1.0 else 0.0
    if now != 0.0 and now != s[SENSE]:
        s[SENSE], s[CHANGED] = now, 1.0
    elif slides <= 0.0 and s[SLIDES] > 0.0:
        s[SENSE] = 0.0
    s[SLIDES], s[FRICTION], s[LOW], s[HIGH], s[SPREAD] = slides, likely, low, high, spread
