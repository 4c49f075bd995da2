"""What the machine's sensors make of the truth: gain, zero, drift, noise, counts, range, delay."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.laws import columns as c
from testbed.laws.oil import ATMOSPHERE_PA
from testbed.machine.model import Machine
from testbed.machine.names import AXES, SIDES
from testbed.scenario.parts import Sensors

Array = NDArray[np.float64]

# --- per pressure transducer (24 x PRESSURE_COLUMNS): A of all axes, then B ------------------------------------
(GAIN, ZERO, DRIFT, THERMAL, NOISE, RESOLUTION, RANGE, DELAY_STEPS, PRESSURE_COLUMNS) = range(9)
# --- common (COMMON_COLUMNS) ------------------------------------------------------------------------------------
(
    COUNT_M,
    COUNT_RAD,
    ROPE_NOISE,
    ATTITUDE_NOISE,
    RATE_NOISE,
    SUPPLY_NOISE,
    TEMPERATURE_STEP,
    CALIBRATED_AT,
    FORCE_NOISE,
    COMMON_COLUMNS,
) = range(10)

# --- one measurement row ------------------------------------------------------------------------------------------
POSITION, PRESSURE_A, PRESSURE_B = slice(1, 13), slice(13, 25), slice(25, 37)
VALVE = slice(37, 49)
SUPPLY, TEMPERATURE = 49, 50
ROPE, ATTITUDE, ANGULAR_RATE, SPECIFIC_FORCE = (
    slice(51, 53),
    slice(53, 56),
    slice(56, 59),
    slice(59, 62),
)
MEASURED_COLUMNS: tuple[str, ...] = (
    "t",
    *(f"position_{a}" for a in AXES),
    *(f"pressure_a_{a}" for a in AXES),
    *(f"pressure_b_{a}" for a in AXES),
    *(f"valve_{a}" for a in AXES),
    "supply_pressure",
    "oil_temperature",
    *(f"rope_tension_{s}" for s in SIDES),
    *(f"attitude_{a}" for a in ("roll", "pitch", "yaw")),
    *(f"angular_rate_{a}" for a in "xyz"),
    *(f"specific_force_{a}" for a in "xyz"),
)
NOISES, ADDED_NOISES = 24 + 2 + 3 + 3 + 1, 3
"""Normal numbers that one sample takes; those of the accelerometers come from a stream of their own."""
DELAY_LENGTH = 256


def sensor_arrays(p: Machine, chosen: Sensors, rng: np.random.Generator) -> tuple[Array, Array]:
    """Transducer numbers (24, PRESSURE_COLUMNS) and common ones; each transducer draws its own thermal zero."""
    s = p.sensor
    t = np.zeros((24, PRESSURE_COLUMNS))
    t[:, GAIN], t[:, RANGE] = 1.0, s.pressure_range_pa
    per_kelvin = s.thermal_zero_share * s.pressure_range_pa / s.thermal_range_k
    draws = rng.uniform(-1.0, 1.0, 24)
    if "pressure" not in chosen.without:
        t[:, NOISE] = s.pressure_noise_pa if chosen.noise else 0.0
        t[:, RESOLUTION] = s.pressure_resolution_pa if chosen.quantisation else 0.0
        t[:, THERMAL] = per_kelvin * draws if chosen.thermal_drift else 0.0
    common = np.zeros(COMMON_COLUMNS)
    noise = float(chosen.noise)
    if chosen.quantisation and "encoder" not in chosen.without:
        common[COUNT_M] = s.encoder_linear_m
        common[COUNT_RAD] = 2 * math.pi / s.encoder_counts_per_turn
    common[ROPE_NOISE] = noise * s.rope_tension_noise_n * ("rope_tension" not in chosen.without)
    common[ATTITUDE_NOISE] = noise * s.attitude_noise_rad * ("inertial" not in chosen.without)
    common[RATE_NOISE] = noise * s.rate_noise_rad_s * ("inertial" not in chosen.without)
    common[FORCE_NOISE] = noise * s.specific_force_noise_m_s2 * ("inertial" not in chosen.without)
    common[SUPPLY_NOISE] = noise * s.supply_noise_pa * ("supply_pressure" not in chosen.without)
    if chosen.quantisation and "oil_temperature" not in chosen.without:
        common[TEMPERATURE_STEP] = s.temperature_resolution_k
    common[CALIBRATED_AT] = s.calibration_temperature_degc
    return t, common


def fail(transducer: Array, reading_pa: float) -> None:
    """Let a transducer (PRESSURE_COLUMNS) show the same reading, Pa gauge, from now on."""
    transducer[[GAIN, DRIFT, THERMAL, NOISE, RESOLUTION]] = 0.0
    transducer[ZERO] = reading_pa


@njit
def counted(value: float, count: float) -> float:
    """A value as a counter of step `count` shows it; unchanged for count 0."""
    return math.floor(value / count + 0.5) * count if count > 0.0 else value


@njit
def transduce(true_pa: float, t: float, warm_k: float, noise: float, s: Any) -> float:
    """One pressure reading, Pa gauge, from the true gauge pressure; s = PRESSURE_COLUMNS of this transducer."""
    value = s[GAIN] * true_pa + s[ZERO] + s[DRIFT] * t + s[THERMAL] * warm_k + s[NOISE] * noise
    value = counted(value, s[RESOLUTION])
    return float(min(max(value, 0.0), s[RANGE]))


@njit
def sense(
    row: Any,
    t: float,
    q: Any,
    base: Any,
    rotation: Any,
    axes: Any,
    supply: Any,
    ropes: Any,
    command: Any,
    transducers: Any,
    common: Any,
    noise: Any,
    late: Any,
    step: int,
    gravity: float,
    gravity_in_body: Any,
    change: Any,
    com: Any,
) -> None:
    """Fill one measurement row (MEASURED_COLUMNS) and gravity in the body frame as the inertial unit believes it.

    `late` (24, DELAY_LENGTH) remembers true pressures for transducers with a delay; `noise` (NOISES + ADDED_NOISES) is
    this sample's; `change` (6): acceleration less gravity of the base's centre of mass `com` (3, body frame), angular
    acceleration, world frame. The inertial unit sits at the body's origin.
    """
    row[0] = t
    n = axes.shape[0]
    warm = supply[c.TEMPERATURE] - common[CALIBRATED_AT]
    slot = step % DELAY_LENGTH
    for i in range(n):
        row[1 + i] = counted(q[i], common[COUNT_RAD] if i % 3 == 0 else common[COUNT_M])
        late[i, slot] = axes[i, c.SENSED_A] - ATMOSPHERE_PA
        late[n + i, slot] = axes[i, c.SENSED_B] - ATMOSPHERE_PA
        row[37 + i] = command[i]
    for k in range(2 * n):
        back = min(int(transducers[k, DELAY_STEPS]), step)
        row[13 + k] = transduce(
            late[k, (step - back) % DELAY_LENGTH], t, warm, noise[k], transducers[k]
        )
    row[49] = (
        supply[c.P_SUPPLY] + supply[c.DROOP_P] - ATMOSPHERE_PA + common[SUPPLY_NOISE] * noise[32]
    )
    row[50] = counted(supply[c.TEMPERATURE], common[TEMPERATURE_STEP])
    for k in range(2):
        row[51 + k] = max(ropes[k, 13] + common[ROPE_NOISE] * noise[24 + k], 0.0)
    a = common[ATTITUDE_NOISE]
    roll = math.atan2(rotation[2, 1], rotation[2, 2]) + a * noise[26]
    pitch = -math.asin(min(1.0, max(-1.0, rotation[2, 0]))) + a * noise[27]
    row[53] = roll
    row[54] = pitch
    row[55] = math.atan2(rotation[1, 0], rotation[0, 0]) + a * noise[28]
    for k in range(3):
        turn = 0.0
        for j in range(3):
            turn += rotation[j, k] * base[10 + j]
        row[56 + k] = turn + common[RATE_NOISE] * noise[29 + k]
    force, twist = np.zeros(3), np.zeros(3)
    for k in range(3):
        for j in range(3):
            force[k] += rotation[j, k] * change[j]
            twist[k] += rotation[j, k] * change[3 + j]
    row[59] = force[0] - (twist[1] * com[2] - twist[2] * com[1]) + common[FORCE_NOISE] * noise[33]
    row[60] = force[1] - (twist[2] * com[0] - twist[0] * com[2]) + common[FORCE_NOISE] * noise[34]
    row[61] = force[2] - (twist[0] * com[1] - twist[1] * com[0]) + common[FORCE_NOISE] * noise[35]
    gravity_in_body[0] = gravity * math.sin(pitch)
    gravity_in_body[1] = -gravity * math.cos(pitch) * math.sin(roll)
    gravity_in_body[2] = -gravity * math.cos(pitch) * math.cos(roll)
