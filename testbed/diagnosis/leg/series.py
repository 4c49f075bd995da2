"""A rig's recordings as the fit sees them: smoothed channels at a moderate rate, bins, blocks,
masks.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from testbed.compiled import njit
from testbed.diagnosis.leg.noise import white_noise
from testbed.effects.terms import Signals
from testbed.estimation.leg.flow import smoothed_opening
from testbed.estimation.leg.force import trusted, unseen_travel_m
from testbed.estimation.leg.gaps import at_ends, in_gaps
from testbed.estimation.leg.motion import WIDTH_S, encoder_noise, grid, signals_of, smooth
from testbed.estimation.leg.oil_motion import can_fuse, position_by_oil
from testbed.estimation.leg.spool import spool
from testbed.recording.axis import Recording
from testbed.recording.known import Known
from testbed.recording.leg_model import LegModel

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
RATE_HZ = 250.0
SLOW_S = 0.02
BIN = 3
"""Samples at RATE_HZ that are averaged into one residual."""
BLOCK_S = 2.5
"""Residuals of one block are held out together: longer than their memory."""
UNTOUCHED = 1e-3
"""Share of clipped samples below which a smoothed sample counts as free of them."""


@dataclass(frozen=True, eq=False)
class Series:
    """One recording. `trusted`: direction of friction is certain; `clear`: nothing saturated or
    missing; (n,).
    """

    name: str
    signals: Signals
    reference_n: Array | None
    trusted: Mask
    clear: Mask
    free: bool
    spool_full: Array | None
    opening: Array | None
    step: int
    full_rate_hz: float
    block: npt.NDArray[np.int64]
    velocity_noise_m_s: Array
    acceleration_noise_m_s2: Array
    pressure_noise_pa: tuple[Array, Array | None] | None = None
    """A realisation of the noise of both sensors, smoothed like them; None without pressures."""
    extra: Mapping[str, Array] = field(default_factory=dict)
    """What rides along, smoothed like every channel."""

    def declared(self, known: Known) -> Series:
        """The same series with other declared numbers."""
        return replace(self, signals=self.signals.with_(known=known))

    @property
    def width_s(self) -> float:
        """Standard deviation of the smoothing that every channel went through."""
        return smoothing_s(self.full_rate_hz)

    @property
    def bins(self) -> int:
        """Number of whole bins."""
        return len(self.signals.time_s) // BIN

    def opening_for(self, deadband: float, laps: tuple[float, float] = (0.0, 0.0)) -> Array | None:
        """The valve's smoothed opening for another deadband, and for what its edges differ by."""
        if self.spool_full is None:
            return None
        width = self.width_s * self.full_rate_hz
        return smoothed_opening(self.spool_full, deadband, width, self.step, laps)

    def binned(self, values: Array, mask: Mask) -> tuple[Array, Array]:
        """(mean over the masked samples of each bin, number of them), each of shape (bins,)."""
        return _binned(values, mask, self.bins)

    def encoder_noise_n(self) -> Array:
        """What the encoder's steps alone do to the force of each bin: local root mean square, N,
        shape (bins,).
        """
        mass = self.signals.known.moving_mass_kg or 0.0
        everywhere = np.ones(len(self.signals.time_s), dtype=np.bool_)
        force = self.binned(mass * self.acceleration_noise_m_s2, everywhere)[0]
        return self._local(force)

    def encoder_noise_m3_s(self) -> Array:
        """What the encoder's steps alone do to the flow of piston A: local root mean square, m3/s,
        shape (bins,).
        """
        everywhere = np.ones(len(self.signals.time_s), dtype=np.bool_)
        return self._local(
            self.signals.known.area_a_m2 * self.binned(self.velocity_noise_m_s, everywhere)[0]
        )

    def _local(self, values: Array) -> Array:
        per_second = self.signals.rate_hz / BIN
        return np.sqrt(np.maximum(smooth(values**2, 0.06 * per_second), 0.0))


@njit
def _binned(values: Array, mask: Mask, bins: int) -> tuple[Array, Array]:
    """See Series.binned."""
    mean, count = np.zeros(bins), np.zeros(bins)
    for index in range(bins):
        for sample in range(index * BIN, (index + 1) * BIN):
            if mask[sample]:
                mean[index] += values[sample]
                count[index] += 1.0
        mean[index] /= max(count[index], 1.0)
    return mean, count


def smoothing_s(rate_hz: float) -> float:
    """Standard deviation of the smoothing of channels sampled at a rate: a little more than one
    sample, at least.
    """
    return max(WIDTH_S, 1.2 / rate_hz)


def as_channel(recording: Recording, values: Array, step: int) -> Array:
    """Values at a recording's rows, (rows,), as a series has its channels: on an even grid,
    smoothed, every `step`-th, shape (n,).
    """
    time, rate = grid(recording)
    if time is not recording.time_s:
        values = np.interp(time, recording.time_s, values)
    return smooth(values, smoothing_s(rate) * rate)[::step]


def _likely_position(recording: Recording, known: Known | None) -> Array:
    """Where the piston was, m, (n,) on the even grid, as well as all sensors tell: between two
    counts of a slow motion a leg may ring on its oil, and only its pressures show it.
    """
    believed = LegModel(rig=recording.rig, known=known or recording.known)  # type: ignore[arg-type]
    if recording.position_resolution_m > 0.0 and can_fuse(recording, believed):
        return position_by_oil(recording, believed)
    return signals_of(recording, known).position_m


def series_of(recordings: Sequence[Recording], known: Known | None = None) -> tuple[Series, ...]:
    """Prepare recordings; blocks are numbered through all of them."""
    out: list[Series] = []
    first = 0
    for recording in recordings:
        item = _one(recording, known, first)
        first = int(item.block.max()) + 1
        out.append(item)
    return tuple(out)


def _one(recording: Recording, known: Known | None, first_block: int) -> Series:
    time, rate = grid(recording)
    step = max(1, round(rate / RATE_HZ))
    signals = signals_of(recording, known, step=step).with_(place=recording.name)
    width = smoothing_s(rate) * rate
    once = smooth(signals.acceleration_m_s2, SLOW_S * signals.rate_hz)
    # Twice the Gaussian less the Gaussian twice: flat to fourth order, so the motion itself is not
    # shrunk.
    slow = 2.0 * once - smooth(once, SLOW_S * signals.rate_hz)
    if recording.position_resolution_m > 0.0:
        signals = signals.with_(slow_acceleration_m_s2=slow)
    velocity_noise, acceleration_noise = encoder_noise(
        _likely_position(recording, known), rate, recording.position_resolution_m, width / rate
    )

    def channel(values: Array) -> Array:
        return as_channel(recording, values, step)

    reference = None
    if recording.reference_force_n is not None:
        reference = channel(recording.reference_force_n)
    saturated = (recording.saturated_a | recording.saturated_b).astype(np.float64)
    unseen = in_gaps(recording.time_s, signals.time_s) | at_ends(signals.time_s)
    clear = (channel(saturated) < UNTOUCHED) & ~unseen

    def noise(values: Array, seed: int) -> Array:
        white = np.random.default_rng(seed).standard_normal(len(values))
        return channel(white_noise(values) * white)

    noise_a = noise_b = None
    if recording.pressure_a_pa is not None:
        noise_a = noise(recording.pressure_a_pa, 3)
    if recording.pressure_b_pa is not None:
        noise_b = noise(recording.pressure_b_pa, 4)
    stroke_full, open_ = None, None
    k = signals.known
    if (
        recording.valve_command is not None
        and k.declares_flow
        and signals.pressure_b_pa is not None
    ):
        assert k.valve_natural_frequency_hz and k.valve_damping and k.valve_deadband is not None
        command = recording.valve_command
        if time is not recording.time_s:
            command = np.interp(time, recording.time_s, command)
        stroke_full = spool(command, rate, k.valve_natural_frequency_hz, k.valve_damping)
        open_ = smoothed_opening(stroke_full, k.valve_deadband, width, step)
    bins = len(signals.time_s) // BIN
    block = first_block + ((np.arange(bins) * BIN / signals.rate_hz) // BLOCK_S).astype(np.int64)
    return Series(
        name=recording.name,
        signals=signals,
        reference_n=reference,
        trusted=trusted(signals.velocity_m_s, signals.rate_hz, travel_m=unseen_travel_m(recording)),
        clear=clear,
        free=recording.is_free,
        spool_full=stroke_full,
        opening=open_,
        step=step,
        full_rate_hz=rate,
        block=block,
        velocity_noise_m_s=velocity_noise[::step],
        acceleration_noise_m_s2=acceleration_noise[::step],
        pressure_noise_pa=None if noise_a is None else (noise_a, noise_b),
        extra={name: channel(value) for name, value in recording.extra.items()},
    )
