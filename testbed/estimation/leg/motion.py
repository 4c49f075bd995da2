"""Position, velocity and acceleration from an encoder that steps.

Between two steps the true position is only known to lie within one count, but at a step it is known
to the sampling time: the position is first drawn through the steps (at low speed this is ten times
finer than the count), then smoothed, zero-phase: a Gaussian of standard deviation `width_s`. What
can be said of each sample when it comes is in causal.py.
"""

from __future__ import annotations

import numpy as np

from testbed.compiled import njit
from testbed.effects.terms import Signals
from testbed.formats.arrays import Array
from testbed.recording.axis import Recording
from testbed.recording.known import Known

PAUSE_S = 0.25
"""Time without a count from which on the piston rested in between."""


def through_steps(time_s: Array, position_m: Array, resolution_m: float) -> Array:
    """Position drawn straight through the middles of the encoder's steps, shape (n,), m.


    At rest, between two equal edges, it stays where it was. A continuous position (resolution 0) is
    returned as it is.
    """
    if resolution_m <= 0.0:
        return position_m
    at = np.flatnonzero(np.diff(position_m))
    if at.size == 0:
        return position_m.copy()
    knots_t = 0.5 * (time_s[at] + time_s[at + 1])
    knots_x = 0.5 * (position_m[at] + position_m[at + 1])
    # A long pause between two steps is a rest at the lower step's level, not a slow glide: the
    # count's middle is held.
    pause = np.flatnonzero(np.diff(knots_t) > PAUSE_S)
    inner = np.concatenate([knots_t[pause] + 0.05, knots_t[pause + 1] - 0.05])
    held = np.concatenate([position_m[at[pause] + 1], position_m[at[pause] + 1]])
    times = np.concatenate([[time_s[0]], knots_t, inner, [time_s[-1]]])
    places = np.concatenate([[position_m[0]], knots_x, held, [position_m[-1]]])
    order = np.argsort(times, kind="stable")
    return np.asarray(np.interp(time_s, times[order], places[order]), dtype=np.float64)


def smooth(values: Array, width_samples: float, derivative: int = 0) -> Array:
    """Gaussian smoothing (or its first derivative per sample) of shape (n,), zero phase.

    At both ends the series goes on mirrored in its last point, so that a ramp stays a ramp.
    """
    from scipy.ndimage import gaussian_filter1d

    width = max(width_samples, 0.3)
    pad = min(int(4.0 * width) + 1, len(values) - 1)
    longer = np.concatenate(
        [2.0 * values[0] - values[pad:0:-1], values, 2.0 * values[-1] - values[-2 : -pad - 2 : -1]]
    )
    out = gaussian_filter1d(longer, width, order=derivative, mode="nearest", truncate=4.0)
    if derivative == 1:  # the cut-off Gaussian reads a ramp's slope 0.1 % low
        reach = int(4.0 * width) + 2
        out = (
            out
            / gaussian_filter1d(
                np.arange(2.0 * reach + 1.0), width, order=1, mode="nearest", truncate=4.0
            )[reach]
        )
    return np.asarray(out[pad : pad + len(values)], dtype=np.float64)


SLOPE = (45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0)
"""Weights of the differences over two, four and six samples in a slope of the sixth order."""


@njit
def slope(values: Array, rate_hz: float) -> Array:
    """Slope of a smoothed series, shape (n,), per second: to an eighth of the rate true to 0.2 %.

    A difference over two samples falls short by 10 % there: oil would seem softer than it is. At
    both ends the series goes on mirrored in its last point.
    """
    reach, count = len(SLOPE), len(values)
    longer = np.empty(count + 2 * reach)
    longer[reach : reach + count] = values
    for far in range(1, reach + 1):
        inside = min(far, count - 1)
        longer[reach - far] = 2.0 * values[0] - values[inside]
        longer[reach + count - 1 + far] = 2.0 * values[-1] - values[count - 1 - inside]
    out = np.empty(count)
    for index in range(count):
        middle = index + reach
        total = 0.0
        for far in range(1, reach + 1):
            total += SLOPE[far - 1] * (longer[middle + far] - longer[middle - far])
        out[index] = total * rate_hz
    return out


def later(values: Array, samples: float) -> Array:
    """A series (n,) so many samples later: of a cubic spline through it, which stays at both ends
    what it is there.
    """
    from scipy.ndimage import spline_filter1d

    whole = int(np.floor(samples))
    longer = abs(whole) + SPLINE_REACH
    coefficients = spline_filter1d(np.pad(values, longer, mode="edge"), 3)
    first, count = longer - whole, len(values)
    out = np.zeros(count)
    for before, weight in zip((-2, -1, 0, 1), _cubic_weights(samples - whole), strict=True):
        out += weight * coefficients[first + before : first + before + count]
    return out


SPLINE_REACH = 16
"""So many samples beyond both ends keep the spline's ends from what is asked of it."""


def _cubic_weights(part: float) -> tuple[float, float, float, float]:
    """Of the coefficients of a cubic spline two and one samples before, at and after a sample, at
    the place that lies by `part` (0 to 1) of a sample before it.
    """
    rest = 1.0 - part
    middle = (part**2 * (part - 2.0) * 3.0 + 4.0) / 6.0
    before = (rest**2 * (rest - 2.0) * 3.0 + 4.0) / 6.0
    return part**3 / 6.0, before, middle, rest**3 / 6.0


def motion(position_m: Array, rate_hz: float, width_s: float) -> tuple[Array, Array, Array]:
    """Smoothed position m, velocity m/s, acceleration m/s2, each of shape (n,), from a uniform
    grid.
    """
    width = width_s * rate_hz
    pad = min(int(4.0 * width) + 1, len(position_m) - 1)
    longer = _carried_on(position_m, pad, max(round(END_FIT_S * rate_hz), 12))
    position, velocity = smooth(longer, width), smooth(longer, width, 1) * rate_hz
    # Not the second derivative of the truncated Gaussian: its weights do not add up to zero.
    inside = slice(pad, pad + len(position_m))
    return (
        position[inside],
        velocity[inside],
        np.asarray((np.gradient(velocity) * rate_hz)[inside], dtype=np.float64),
    )


END_FIT_S = 0.06
"""Over this time a parabola carries the motion on beyond the ends of a recording."""


def _carried_on(position_m: Array, pad: int, window: int) -> Array:
    """The series with `pad` samples before and behind it, from parabolas through its first and last
    samples.
    """
    window = min(window, len(position_m))
    index = np.arange(window, dtype=np.float64)
    before = np.polyval(np.polyfit(index, position_m[:window], 2), np.arange(-pad, 0))
    behind = np.polyval(np.polyfit(index, position_m[-window:], 2), np.arange(window, window + pad))
    return np.concatenate([before, position_m, behind])


def encoder_noise(
    position_m: Array, rate_hz: float, resolution_m: float, width_s: float
) -> tuple[Array, Array]:
    """Errors of velocity (m/s) and acceleration (m/s2) that the encoder's steps alone leave, each
    of shape (n,).

    `position_m`: a smooth position taken as the truth; it is read through an encoder again and
    estimated as usual.
    """
    if resolution_m <= 0.0:
        return np.zeros_like(position_m), np.zeros_like(position_m)
    time = np.arange(len(position_m)) / rate_hz
    read = np.floor(position_m / resolution_m + 0.37) * resolution_m
    _, velocity, acceleration = motion(through_steps(time, read, resolution_m), rate_hz, width_s)
    _, v_true, a_true = motion(position_m, rate_hz, width_s)
    return velocity - v_true, acceleration - a_true


# From a recording to smoothed signals on a uniform time grid.

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
        return smooth(even(values), width_s * rate)[::step]

    resolution = recording.position_resolution_m
    drawn = through_steps(recording.time_s, recording.position_m, resolution)
    position, velocity, acceleration = motion(even(drawn), rate, width_s)
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
        began_s=recording.began_s,
    )
