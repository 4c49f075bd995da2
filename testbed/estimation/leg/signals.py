"""From a recording to smoothed signals on a uniform time grid."""

from __future__ import annotations

import numpy as np

from testbed.effects.terms import Signals
from testbed.estimation.leg.motion import motion, smooth, smooth_causal, through_steps
from testbed.formats.arrays import Array
from testbed.recording.axis import Recording
from testbed.recording.known import Known

WIDTH_S = 0.005
"""Standard deviation of the smoothing that every channel shares; beyond it the encoder's
acceleration is noise.
"""


def grid(recording: Recording) -> tuple[Array, float]:
    """Uniform time grid at the recording's own mean rate, shape (n,), s, and the rate in Hz."""
    time = recording.time_s
    steps = np.diff(time)
    rate = 1.0 / float(np.median(steps))
    if np.ptp(steps) < 0.02 / rate:
        return time, (len(time) - 1) / float(time[-1] - time[0])
    count = round(float(time[-1] - time[0]) * rate) + 1
    return np.linspace(time[0], time[-1], count), (count - 1) / float(time[-1] - time[0])


def signals_of(
    recording: Recording,
    known: Known | None = None,
    width_s: float = WIDTH_S,
    causal: bool = False,
    step: int = 1,
) -> Signals:
    """All channels smoothed alike; every `step`-th sample is kept. `known` overrides what the
    recording declares.
    """
    time, rate = grid(recording)
    width_s = max(width_s, 1.2 / rate)

    def even(values: Array) -> Array:
        return values if time is recording.time_s else np.interp(time, recording.time_s, values)

    def channel(values: Array | None) -> Array | None:
        if values is None:
            return None
        low = (
            smooth_causal(even(values), width_s * rate)
            if causal
            else smooth(even(values), width_s * rate)
        )
        return low[::step]

    resolution = recording.position_resolution_m
    drawn = (
        recording.position_m
        if causal
        else through_steps(recording.time_s, recording.position_m, resolution)
    )
    position, velocity, acceleration = motion(even(drawn), rate, width_s, causal)
    command = recording.valve_command
    return Signals(
        time_s=time[::step],
        rate_hz=rate / step,
        known=known or recording.known,
        position_m=position[::step],
        velocity_m_s=velocity[::step],
        acceleration_m_s2=acceleration[::step],
        pressure_a_pa=channel(recording.pressure_a_pa),
        pressure_b_pa=channel(recording.pressure_b_pa),
        supply_pressure_pa=channel(recording.supply_pressure_pa),
        oil_temperature_degc=channel(recording.oil_temperature_degc),
        valve_command=None if command is None else even(command)[::step],
        actuator_force_n=channel(recording.actuator_force_n),
    )
