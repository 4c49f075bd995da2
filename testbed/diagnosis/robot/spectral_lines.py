"""Narrow lines in the spectra of the twelve piston forces: what shakes a piston at one
frequency.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot.evidence import PIECE_S, RawGroup
from testbed.diagnosis.robot.friction import areas
from testbed.diagnosis.robot.kept_back_part import LEARNT_SHARE
from testbed.machine.model import Machine
from testbed.machine.names import AXES
from testbed.machine.scale import Scale

Array = npt.NDArray[np.float64]
RATE_HZ = 100.0
LOWEST_HZ, HIGHEST_HZ, GRID_HZ = 1.5, 20.0, 0.02
NEIGHBOURS_HZ = 3.0
"""A line stands out of the median of so wide a neighbourhood."""
MEDIAN_OF_POWER = 0.69
"""Median over mean of the power of noise."""
SURE = 100.0
"""Power over its neighbourhood's from which a line is surely one."""
RESTLESS, LEAST_N, HUNTING_N = 3.0, 80.0, 250.0
"""Sound machines have lines of their own, valves that hunt: so much above the spectrum, and so
large, the last of rotation joints (E).
"""


@dataclass(frozen=True, eq=False)
class Line:
    """The strongest line of one axis. `parts` (2, 2): cosine and sine amplitude, N, in the first
    part of the run and in the rest; `variance` (2): of each of them; `amplitude_n`: 0 where it is
    not surely one.
    """

    frequency_hz: float
    parts: Array
    variance: Array
    amplitude_n: float

    def group(self, i: int, scale: Scale) -> RawGroup:
        """The group `line <axis>` of cylinder i of a machine of this size."""
        nothing = np.zeros(2)
        least_n = HUNTING_N if AXES[i].endswith("rotation") else LEAST_N
        least_n *= scale.times("N")
        return RawGroup(
            missing=self.parts.ravel(),
            time_s=np.repeat([0.0, PIECE_S], 2),
            noise=np.diag(np.repeat(RESTLESS * self.variance + least_n**2, 2)),
            tolerated=np.zeros((4, 1)),
            rows_of=lambda change: np.tile(change.line.get(i, nothing), 2),
        )


def lines_of(data: Mapping[str, Array], machine: Machine) -> tuple[Line, ...]:
    """The strongest line of each axis, AXES order."""
    time = np.asarray(data["t"], dtype=float)
    width = max(round(1.0 / (RATE_HZ * float(np.median(np.diff(time))))), 1)
    count = len(time) // width
    area_a, area_b = areas(machine)

    def thinned(name: str) -> Array:
        values = np.asarray(data[name], dtype=float)[: count * width]
        return np.asarray(values.reshape(count, width).mean(axis=1))

    at = thinned("t") - time[0]
    return tuple(
        _strongest(
            at,
            thinned(f"pressure_a_{axis}") * area_a[i] - thinned(f"pressure_b_{axis}") * area_b[i],
        )
        for i, axis in enumerate(AXES)
    )


def _strongest(time: Array, force: Array) -> Line:
    from scipy.ndimage import median_filter

    change = np.diff(force, prepend=force[0])  # a spectrum that falls with frequency becomes flat
    grid, power = _spectrum(time, change)
    floor = median_filter(power, round(NEIGHBOURS_HZ / GRID_HZ), mode="nearest") / MEDIAN_OF_POWER
    best = int(np.argmax(power / floor))
    frequency = float(grid[best])
    step = float(time[1] - time[0])
    gain = abs(2.0 * np.sin(np.pi * frequency * step))
    until = time[0] + LEARNT_SHARE * (time[-1] - time[0])
    halves = [time < until, time >= until]
    found = [_amplitudes(time[h], change[h], np.array([frequency]))[0] / gain for h in halves]
    variance = [floor[best] / gain**2 * len(time) / (2.0 * h.sum()) for h in halves]
    sure = power[best] > SURE * floor[best]
    amplitude = float(np.sqrt(power[best]) / gain) if sure else 0.0
    parts = np.array([[value.real, value.imag] for value in found])
    return Line(frequency, parts, np.array(variance), amplitude)


def _spectrum(time: Array, values: Array) -> tuple[Array, Array]:
    """Frequencies GRID_HZ apart, and the squared amplitudes of lines of (n,) values there."""
    window = np.hanning(len(time) + 2)[1:-1]
    base = round(1.0 / ((time[1] - time[0]) * GRID_HZ))
    finer = -(-len(time) // base)
    whole = 2.0 * np.fft.rfft(values * window, base * finer)[::finer] / window.sum()
    grid = np.asarray(GRID_HZ * np.arange(len(whole)), dtype=np.float64)
    inside = (grid >= LOWEST_HZ) & (grid < HIGHEST_HZ)
    return np.asarray(grid[inside]), np.asarray(np.abs(whole[inside]) ** 2, dtype=np.float64)


def _amplitudes(time: Array, values: Array, frequencies: Array) -> npt.NDArray[np.complex128]:
    """Complex amplitudes of lines in (n,) values, a Hann window over them."""
    window = np.hanning(len(time) + 2)[1:-1]
    turning = np.exp(-2j * np.pi * np.outer(frequencies, time))
    return np.asarray(2.0 * turning @ (values * window) / window.sum())
