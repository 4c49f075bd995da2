"""What sensors and encoder alone leave, propagated through the same smoothing and the same velocity
estimate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.leg.evidence import FEWEST, Key, student
from testbed.diagnosis.leg.noise import chamber_volumes_m3, grain, rounding_left, white_noise
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.series import BIN, Series, as_channel
from testbed.estimation.leg.force import estimate
from testbed.estimation.leg.motion import signals_of, slope
from testbed.recording.axis import Recording
from testbed.recording.leg_model import Friction, LegModel

Array = npt.NDArray[np.float64]


def load_cell_noise_n(recording: Recording) -> float:
    """Standard deviation of a load cell's noise: as declared, or else what is white in its column;
    0 without one.
    """
    reference, values = recording.header.reference_force, recording.reference_force_n
    if reference is None or reference.kind != "load-cell" or values is None:
        return 0.0
    if reference.standard_deviation is None:
        return white_noise(values)
    step = (reference.resolution or 0.0) / np.sqrt(12.0)
    return float(np.hypot(reference.standard_deviation, step))


def force_floor_n(series: Series, recording: Recording, friction: Friction) -> Array:
    """A realisation of the encoder's error in the force and of the noise of pressures and load
    cell, N, shape (n,). Smoothing makes white noise last: neighbouring samples of it are alike, and
    a bin of them averages little out.
    """
    known = series.signals.known
    velocity = series.signals.velocity_m_s
    slope = np.where(velocity > 0, friction.viscous_plus_n_s_m, friction.viscous_minus_n_s_m)
    encoder = (
        -(known.moving_mass_kg or 0.0) * series.acceleration_noise_m_s2
        - slope * series.velocity_noise_m_s
    )
    noise, rounding = load_cell_noise_n(recording) ** 2, _cell_rounding_n(recording) ** 2
    for values, area in (
        (recording.pressure_a_pa, known.area_a_m2),
        (recording.pressure_b_pa, known.area_b_m2),
        (recording.actuator_force_n, 1.0),
    ):
        if values is not None:
            noise += (white_noise(values) * area) ** 2
            rounding += (rounding_left(values) * area) ** 2
    rng = np.random.default_rng(0)
    white = np.sqrt(noise) * rng.standard_normal(len(recording.time_s))
    lasting = np.sqrt(rounding) * np.repeat(rng.standard_normal(len(velocity) // BIN + 1), BIN)
    smoothed = as_channel(recording, white, series.step)
    return np.asarray(encoder + smoothed + lasting[: len(velocity)], dtype=np.float64)


def _cell_rounding_n(recording: Recording) -> float:
    """What averaging leaves of a load cell's rounding, where it declares no resolution, N."""
    reference, values = recording.header.reference_force, recording.reference_force_n
    if reference is None or values is None or reference.standard_deviation is not None:
        return 0.0
    return rounding_left(values) if reference.kind == "load-cell" else 0.0


def flow_floor_m3_s(series: Series) -> tuple[Array, Array]:
    """What sensors alone leave in the flow balances of A and B, m3/s, shape (n,)."""
    known = series.signals.known
    volume_a, volume_b = chamber_volumes_m3(series.signals)
    chambers = ((known.area_a_m2, volume_a), (known.area_b_m2, volume_b))
    out = []
    for noise, (area, volume) in zip(
        series.pressure_noise_pa or (None, None), chambers, strict=True
    ):
        rate = 0.0 if noise is None else slope(noise, series.signals.rate_hz)
        out.append(
            area * series.velocity_noise_m_s + volume / (known.bulk_modulus_pa or 1e9) * rate
        )
    return out[0], out[1]


def group_floors(
    problem: Problem, recordings: Sequence[Recording], friction: Friction
) -> dict[Key, float]:
    """Scale that each group of a perfect model would have, in the units of `Evidence.scale`."""
    out: dict[Key, float] = {}
    for series, recording in zip(problem.series, recordings, strict=True):
        force = force_floor_n(series, recording, friction)
        mask = series.trusted & series.clear
        _floor(out, ("force", series.name), series.binned(force, mask), series.encoder_noise_n())
        if problem.with_flow:
            moving = series.binned(np.zeros(len(force)), series.trusted)[1] > 0
            for part, values in zip(("flow_a", "flow_b"), flow_floor_m3_s(series), strict=True):
                mean, count = series.binned(values, series.clear)
                count = np.where(moving, count, 0.0)
                _floor(out, (part, series.name), (mean, count), series.encoder_noise_m3_s())
    return out


def _floor(out: dict[Key, float], key: Key, binned: tuple[Array, Array], noise: Array) -> None:
    mean, count = binned
    here = count > 0
    if here.sum() < FEWEST:
        return
    typical = float(np.mean(noise[here] ** 2))
    relative = (
        np.sqrt(0.3 + 0.7 * noise[here] ** 2 / typical)
        if typical > 0.0
        else np.ones(int(here.sum()))
    )
    out[key] = student(mean[here] / relative)[0]


def sensor_noise_n(recording: Recording, model: LegModel) -> Array:
    """A realisation of what encoder, pressure sensors and load cell do to the estimated force, N,
    shape (n,).

    The recording's own smoothed channels are taken as the truth, read through its sensors again and
    estimated; the estimate from the channels themselves is subtracted.
    """
    rng = np.random.default_rng(2)
    signals = signals_of(recording, model.known)
    count = recording.position_resolution_m

    def at_samples(values: Array) -> Array:
        return np.interp(recording.time_s, signals.time_s, values)

    position = at_samples(signals.position_m)
    truth: dict[str, Array] = {"position_m": position}
    read: dict[str, Array] = {
        "position_m": np.floor(position / count + 0.37) * count if count > 0.0 else position
    }
    for name in ("pressure_a_pa", "pressure_b_pa", "actuator_force_n"):
        values, smoothed = getattr(recording, name), getattr(signals, name)
        if values is not None:
            truth[name] = at_samples(smoothed)
            read[name] = truth[name] + white_noise(values) * rng.standard_normal(len(values))
            step = grain(values)
            if step > 0.0:
                read[name] = np.round(read[name] / step) * step
    continuous = recording.header.channels["position"].model_copy(update={"resolution": None})
    header = recording.header.model_copy(
        update={"channels": recording.header.channels | {"position": continuous}}
    )
    noisy: Array = estimate(replace(recording, **read), model).force_n  # type: ignore[arg-type]
    quiet: Array = estimate(replace(recording, header=header, **truth), model).force_n  # type: ignore[arg-type]
    noise = np.asarray(noisy - quiet, dtype=np.float64)
    # Where noise decides on which side of a set the force lies, the difference is the set's width,
    # not noise.
    limit = 6.0 * 1.48 * float(np.median(np.abs(noise)))
    noise = np.clip(noise, -limit, limit)
    noise = noise + load_cell_noise_n(recording) * rng.standard_normal(len(noise))
    return np.asarray(noise, dtype=np.float64)
