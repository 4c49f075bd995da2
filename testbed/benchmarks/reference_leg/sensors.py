"""The sensors of the reference rigs: noise, converter steps, range, encoder, and the sensor
effects.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from testbed.benchmarks.reference_leg.leg import COLUMNS
from testbed.benchmarks.reference_leg.rigs import header
from testbed.formats.arrays import Array
from testbed.recording.axis import Recording
from testbed.recording.known import Known

NOISE_PA = (2.5e3, 4.5e3)
"""A rig's pressure noise is drawn from here, standard deviation."""
RANGE_PA, CONVERTER_STEPS = 1e7, 4096
"""The end of a transducer's range, and into how many steps the converter cuts it."""
ENCODER_M = 1e-4
CELL_SD_N, CELL_STEP_N = 1.7, 10.0
SUPPLY_SD_PA, SUPPLY_STEP_PA = 3e3, 1e3
TEMPERATURE_SD_K = 0.1
BENT_AT_PA = 6e6
"""Pressure over which a bent gain error grows from 0.6 to 1.4 of its size."""
SETTLES_S = 25.0
"""In which a drift that settles has gone most of its way."""
WARM_DEGC = 25.0
"""Oil temperature at which a zero that moves with it is 0."""


def read(
    name: str,
    rows: Array,
    temperature: Array,
    rate: float,
    known: Known,
    hidden: dict[str, float],
    load_cell: bool,
    rng: np.random.Generator,
) -> Recording:
    """Rows (n, COLUMNS) of the kernel, `rate` a second, as a recording; temperature (n) degC;
    `hidden` holds the sensor effects of the rig.
    """
    time_s = np.arange(len(rows)) / rate
    true = dict(zip(COLUMNS, rows.T, strict=True))
    position = true["position"]
    pressure_a, pressure_b = _sensor_effects(
        time_s, true["pressure_a"], true["pressure_b"], temperature, rate, hidden
    )
    if "encoder_wave" in hidden:
        length_m = hidden["encoder_length"]
        wave = 2.0 * np.pi * position / length_m
        position = position + hidden["encoder_wave"] * length_m / (2.0 * np.pi) * np.sin(wave)
    noise_pa = rng.uniform(*NOISE_PA)

    def noisy(values: Array, sd: float) -> Array:
        return np.asarray(values + sd * rng.standard_normal(len(values)))

    def converter(pressure: Array) -> Array:
        step = RANGE_PA / CONVERTER_STEPS
        return np.clip(np.round(noisy(pressure, noise_pa) / step) * step, 0.0, RANGE_PA)

    force = np.round(noisy(true["force"], CELL_SD_N) / CELL_STEP_N) * CELL_STEP_N
    never = np.zeros(len(time_s), dtype=np.bool_)
    return Recording(
        name=name.split("/")[1],
        folder=Path(name),
        header=header(known, rate, load_cell),
        time_s=time_s,
        position_m=np.round(np.floor(position / ENCODER_M) * ENCODER_M, 7),
        valve_command=np.round(true["command"], 4),
        pressure_a_pa=converter(pressure_a),
        pressure_b_pa=converter(pressure_b),
        supply_pressure_pa=np.round(noisy(true["supply"], SUPPLY_SD_PA) / SUPPLY_STEP_PA)
        * SUPPLY_STEP_PA,
        oil_temperature_degc=np.round(noisy(temperature, TEMPERATURE_SD_K), 1),
        actuator_force_n=None,
        reference_force_n=force if load_cell else np.zeros(len(time_s)),
        saturated_a=never,
        saturated_b=never,
    )


def _line(pressure: Array, rate: float, hz: float, damping: float) -> Array:
    """A pressure (n) behind a line of natural frequency `hz`, by the bilinear transform: of second
    order, or of first order where the damping is negative.
    """
    from scipy.signal import bilinear, lfilter, lfilter_zi

    corner = 2.0 * np.pi * hz
    if damping > 0.0:
        above, below = [corner * corner], [1.0, 2.0 * damping * corner, corner * corner]
    else:
        above, below = [corner], [1.0, corner]
    fed, fed_back = bilinear(above, below, rate)
    settled = lfilter_zi(fed, fed_back) * pressure[0]
    return np.asarray(lfilter(fed, fed_back, pressure, zi=settled)[0], dtype=np.float64)


def _late(pressure: Array, delay_s: float, rate: float) -> Array:
    """A pressure (n) behind a first-order lag of `delay_s`, settled at the start."""
    from scipy.signal import lfilter

    samples = delay_s * rate
    fed, fed_back = [1.0 / (samples + 1.0)], [1.0, -samples / (samples + 1.0)]
    settled = np.array([-fed_back[1] * pressure[0]])
    return np.asarray(lfilter(fed, fed_back, pressure, zi=settled)[0])


def _sensor_effects(
    time_s: Array,
    pressure_a: Array,
    pressure_b: Array,
    temperature: Array,
    rate: float,
    hidden: dict[str, float],
) -> tuple[Array, Array]:
    """Both pressures (n), Pa, as sensors with the `hidden` effects read them, one effect after the
    other. A form of 0 is the published formula, any other is another one of the same kind.
    """
    for name, size in hidden.items():
        effect, _, key = name.rpartition(":")
        published = hidden.get(f"{effect}:form", 0.0) == 0.0
        if key == "gain":
            if effect.endswith("_a"):
                pressure_a = _with_gain_error(pressure_a, size, published)
            else:
                pressure_b = _with_gain_error(pressure_b, size, published)
        elif key == "drift":
            gone = 1.0 - np.exp(-time_s / SETTLES_S)
            pressure_a = pressure_a + (size * time_s if published else size * SETTLES_S * gone)
        elif key == "line":
            damping = hidden[f"{effect}:zeta"] if published else -1.0
            pressure_b = _line(pressure_b, rate, size, damping)
        elif key == "delay" and published:
            pressure_a = np.interp(time_s - size, time_s, pressure_a)
            pressure_b = np.interp(time_s - size, time_s, pressure_b)
        elif key == "delay":
            pressure_a, pressure_b = (_late(p, size, rate) for p in (pressure_a, pressure_b))
        elif key == "line_a":
            pressure_a = _line(pressure_a, rate, size, 0.8)
        elif key == "warm_zero_b":
            pressure_b = pressure_b + size * (temperature - WARM_DEGC)
    return pressure_a, pressure_b


def _with_gain_error(pressure: Array, error: float, published: bool) -> Array:
    """A pressure (n) that is read too large by `error` (1), or by more the higher it is."""
    bend = 1.0 if published else 0.6 + 0.8 * pressure / BENT_AT_PA
    return pressure * (1.0 + error * bend)
