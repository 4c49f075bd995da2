"""The sensors of the reference rigs: noise, converter steps, range, encoder, and the sensor
effects.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from testbed.benchmarks.reference_leg.rigs import header
from testbed.formats.arrays import Array
from testbed.recording.axis import Recording
from testbed.recording.known import Known


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
    """Rows of the kernel as a recording; `hidden` holds the sensor effects of the rig."""
    time_s = np.arange(len(rows)) / rate
    x, pa, pb, supply = rows[:, 0], rows[:, 2], rows[:, 3], rows[:, 4]
    pa, pb = _sensor_effects(time_s, pa, pb, temperature, rate, hidden)
    if "encoder_wave" in hidden:
        wave = 2.0 * np.pi * x / hidden["encoder_length"]
        x = x + hidden["encoder_wave"] * hidden["encoder_length"] / (2.0 * np.pi) * np.sin(wave)
    noise = rng.uniform(2.5e3, 4.5e3)
    step = 1e7 / 4096.0

    def converter(pressure: Array) -> Array:
        return np.asarray(
            np.clip(
                np.round((pressure + noise * rng.standard_normal(len(pressure))) / step) * step,
                0.0,
                1e7,
            )
        )

    force = np.round((rows[:, 5] + 1.7 * rng.standard_normal(len(time_s))) / 10.0) * 10.0
    never = np.zeros(len(time_s), dtype=np.bool_)
    return Recording(
        name=name.split("/")[1],
        folder=Path(name),
        header=header(known, rate, load_cell),
        time_s=time_s,
        position_m=np.round(np.floor(x / 1e-4) * 1e-4, 7),
        valve_command=np.round(rows[:, 6], 4),
        pressure_a_pa=converter(pa),
        pressure_b_pa=converter(pb),
        supply_pressure_pa=np.round((supply + 3e3 * rng.standard_normal(len(time_s))) / 1e3) * 1e3,
        oil_temperature_degc=np.round(temperature + 0.1 * rng.standard_normal(len(time_s)), 1),
        actuator_force_n=None,
        reference_force_n=force if load_cell else np.zeros(len(time_s)),
        saturated_a=never,
        saturated_b=never,
    )


def _line(p: Array, rate: float, hz: float, zeta: float) -> Array:
    """Second-order lag by the bilinear transform (first order where zeta < 0)."""
    from scipy.signal import bilinear, lfilter, lfilter_zi

    w = 2.0 * np.pi * hz
    num, den = ([w * w], [1.0, 2.0 * zeta * w, w * w]) if zeta > 0.0 else ([w], [1.0, w])
    b, a = bilinear(num, den, rate)
    return np.asarray(lfilter(b, a, p, zi=lfilter_zi(b, a) * p[0])[0], dtype=np.float64)


def _sensor_effects(
    t: Array, pa: Array, pb: Array, temperature: Array, rate: float, hidden: dict[str, float]
) -> tuple[Array, Array]:
    from scipy.signal import lfilter

    for name, number in hidden.items():
        effect, _, key = name.rpartition(":")
        form = hidden.get(f"{effect}:form", 0.0)
        if key == "gain":

            def bent(p: Array, g: float = number, f: float = form) -> Array:
                return p * (1.0 + (g if f == 0.0 else g * (0.6 + 0.8 * p / 6e6)))

            pa, pb = (bent(pa), pb) if effect.endswith("_a") else (pa, bent(pb))
        elif key == "drift":
            pa = pa + (number * t if form == 0.0 else number * 25.0 * (1.0 - np.exp(-t / 25.0)))
        elif key == "line":
            pb = _line(pb, rate, number, hidden[f"{effect}:zeta"] if form == 0.0 else -1.0)
        elif key == "delay":
            if form == 0.0:
                pa, pb = np.interp(t - number, t, pa), np.interp(t - number, t, pb)
            else:
                lag = [1.0 / (number * rate + 1.0)]
                pole = [1.0, -number * rate / (number * rate + 1.0)]
                pa = lfilter(lag, pole, pa, zi=np.array([-pole[1] * pa[0]]))[0]
                pb = lfilter(lag, pole, pb, zi=np.array([-pole[1] * pb[0]]))[0]
        elif key == "line_a":
            pa = _line(pa, rate, number, 0.8)
        elif key == "warm_zero_b":
            pb = pb + number * (temperature - 25.0)
    return pa, pb
