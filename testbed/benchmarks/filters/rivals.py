"""All scalar filters by name: the published two, further rivals from the literature, and the
testbed's own.

Each of the further ones is a Kalman filter with another way to meet outliers.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from testbed.compiled import njit
from testbed.estimation.filters import kbf, modified_kbf, persistent
from testbed.estimation.filters.base import Run, over
from testbed.estimation.filters.kbf import KalmanState, only_predict, predict_and_update, start
from testbed.formats.arrays import Array
from testbed.formats.records import quantity

# Six scenes for a force filter: a true load along one leg, and what a noisy, spiky estimate makes
# of it.
#
# 1 kHz, noise 60 N (one standard deviation: sensors and friction together). Spikes are what stick-
# slip, a valve's edge and a bad contact leave: 1 to 8 ms long, 0.5 to 4 kN high, four a second. All
# levels are those of a machine of 4 t.

RATE_HZ = 1000.0
NOISE_N = 60.0
SECONDS = 20.0


def spikes(count: int, rng: np.random.Generator, a_second: float = 4.0) -> Array:
    """Spikes (count) in N: half of them half-sines, half rectangles, either sign."""
    out = np.zeros(count)
    sample = 100
    while True:
        sample += int(rng.exponential(RATE_HZ / a_second)) + 20
        length = int(rng.integers(1, 9))
        if sample + length >= count:
            return out
        height = rng.choice([-1.0, 1.0]) * rng.uniform(500.0, 4000.0)
        half_sine = np.sin(np.pi * (np.arange(length) + 0.5) / length)
        out[sample : sample + length] += height * (half_sine if rng.random() < 0.5 else 1.0)


def steady(time_s: Array, rng: np.random.Generator) -> Array:
    """A standing foot: 6 kN, swaying by 300 N in ten seconds."""
    return 6000.0 + 300.0 * np.sin(2.0 * np.pi * (0.1 * time_s + rng.random()))


def slow_load(time_s: Array, rng: np.random.Generator) -> Array:
    """The body shifts its weight: 1 to 11 kN in ten seconds, with a faster sway on top."""
    return (
        6000.0
        + 5000.0 * np.sin(2.0 * np.pi * (0.05 * time_s + rng.random()))
        + 600.0 * np.sin(2.0 * np.pi * (0.3 * time_s + rng.random()))
    )


def fast_unload(time_s: Array, rng: np.random.Generator) -> Array:
    """A foot loses its hold within 5 to 40 ms, about every two seconds, and is loaded again over
    0.7 s.
    """
    times, loads, now = [0.0], [8000.0], 0.0
    while now < time_s[-1]:
        now += rng.uniform(0.8, 1.2)
        fall = rng.uniform(0.005, 0.040)
        times += [now, now + fall, now + fall + 0.5, now + fall + 1.2]
        loads += [loads[-1], 0.0, 0.0, rng.uniform(5000.0, 10000.0)]
        now = times[-1]
    return np.interp(time_s, times, loads)


def touchdown(time_s: Array, rng: np.random.Generator) -> Array:
    """A foot meets the ground: the load rises with an 8 to 14 Hz ring that dies in 0.2 s; unloaded
    over 0.5 s.
    """
    out, start = np.zeros_like(time_s), 0.5
    while start < time_s[-1]:
        level, ring_hz = rng.uniform(4000.0, 9000.0), rng.uniform(8.0, 14.0)
        since = time_s - start
        loaded = level * (1.0 - np.exp(-since / 0.08) * np.cos(2.0 * np.pi * ring_hz * since))
        off = level * np.clip(1.0 - (since - 1.0) / 0.5, 0.0, 1.0)
        out = np.where(since < 0.0, out, np.where(since < 1.0, loaded, off))
        start += 2.2
    return out


def hammering(time_s: Array, rng: np.random.Generator) -> Array:
    """The drill hammers for three seconds of every four: 800 N pulses of 6 ms at 35 Hz on a foot
    under 5 kN.
    """
    phase = (35.0 * time_s + rng.random()) % 1.0
    pulse = np.where(phase < 0.2, np.sin(np.pi * phase / 0.2), 0.0)
    return 5000.0 + 800.0 * pulse * ((time_s % 4.0) < 3.0)


SCENES: dict[str, tuple[Callable[[Array, np.random.Generator], Array], bool]] = {
    "spikes only": (steady, True),
    "slow load": (slow_load, False),
    "fast unload": (fast_unload, False),
    "touchdown": (touchdown, False),
    "hammering": (hammering, False),
    "spikes + unload": (fast_unload, True),
}
"""Name -> (true load, with spikes)."""


def scene(name: str, seed: int) -> tuple[Array, Array]:
    """(true load, what is measured of it), N, SECONDS long at RATE_HZ; the same numbers for the
    same seed.
    """
    load, spiky = SCENES[name]
    rng = np.random.default_rng([seed, list(SCENES).index(name)])
    time_s = np.arange(int(SECONDS * RATE_HZ)) / RATE_HZ
    truth = load(time_s, rng)
    measured = truth + rng.normal(0.0, NOISE_N, time_s.size)
    return truth, measured + spikes(time_s.size, rng) if spiky else measured


ITERATIONS = 5
"""Variational updates of a sample by `student_t_step`."""


class ChiSquare(kbf.Numbers):
    """Of the filter with a gate on the innovation."""

    limit = quantity("1", "of e^2 / (P + Q + R); 6.63 passes 99 % of what the model expects")


class Huber(kbf.Numbers):
    """Of the filter with Huber's weight."""

    corner = quantity(
        "1", "c: standard deviations up to which a sample counts in full; usually 1.345"
    )


class Saturated(kbf.Numbers):
    """Of the filter whose innovation is cut off."""

    limit = quantity("N", "an innovation pulls no more than this one")


class StudentT(kbf.Numbers):
    """Of the filter for Student-t noise."""

    freedom = quantity("1", "nu: degrees of freedom of the noise; 4 is common")


@njit
def chi_square_step(state: KalmanState, z: float, numbers: ChiSquare) -> float:
    """One sample, used only if e^2 / (P + Q + R) <= limit.

    The gate widens as P grows, by Q a sample: for a step of several kN and the Q of a smooth filter
    that takes minutes.
    """
    q, r = numbers.process_variance, numbers.measurement_variance
    if state.started == 0.0:
        return start(state, z, r)
    error = z - state.value
    if not np.isfinite(z) or error * error > numbers.limit * (state.variance + q + r):
        return only_predict(state, q)
    return predict_and_update(state, z, q, r)


@njit
def huber_step(state: KalmanState, z: float, numbers: Huber) -> float:
    """One sample; beyond c standard deviations an innovation pulls linearly less: R is replaced by
    R |r| / c where |r| = |e| / sqrt(P + Q + R) > c.
    """
    q, r = numbers.process_variance, numbers.measurement_variance
    if state.started == 0.0:
        return start(state, z, r)
    if not np.isfinite(z):
        return only_predict(state, q)
    deviations = abs(z - state.value) / math.sqrt(state.variance + q + r)
    return predict_and_update(state, z, q, r * max(1.0, deviations / numbers.corner))


@njit
def saturated_step(state: KalmanState, z: float, numbers: Saturated) -> float:
    """One sample; a far one pulls, but no more than one at the limit."""
    q, r = numbers.process_variance, numbers.measurement_variance
    if state.started == 0.0:
        return start(state, z, r)
    if not np.isfinite(z):
        return only_predict(state, q)
    error = min(max(z - state.value, -numbers.limit), numbers.limit)
    return predict_and_update(state, state.value + error, q, r)


@njit
def student_t_step(state: KalmanState, z: float, numbers: StudentT) -> float:
    """One sample, its noise's scale found by variational updates.

    Repeat: R_k = R (nu + (e^2 + P_k) / R) / (nu + 1), e = z - x_k; update (x_k, P_k) from the prior
    with R_k.
    """
    q, r = numbers.process_variance, numbers.measurement_variance
    if state.started == 0.0:
        return start(state, z, r)
    if not np.isfinite(z):
        return only_predict(state, q)
    prior, nu = state.variance + q, numbers.freedom
    x, variance = state.value, prior
    for _ in range(ITERATIONS):
        noise = r * (nu + ((z - x) ** 2 + variance) / r) / (nu + 1.0)
        gain = prior / (prior + noise)
        x, variance = state.value + gain * (z - state.value), (1.0 - gain) * prior
    state.value, state.variance = x, variance
    return x


@dataclass(frozen=True)
class Filter:
    """A filter as it is compared: `constant` is the one of its own that it may choose, from
    `values`.
    """

    name: str
    run: Run
    constant: str = ""
    values: tuple[float, ...] = ()
    fixed: tuple[tuple[str, float], ...] = ()
    """Further constants, by name."""

    @property
    def choices(self) -> tuple[dict[str, float], ...]:
        """The constants that it may choose from, by name; the usual ones first."""
        rest = dict(self.fixed)
        return tuple({self.constant: value} | rest for value in self.values) or (rest,)

    def __call__(
        self,
        z_n: Array,
        q_n2: float,
        r_n2: float,
        constants: dict[str, float] | None = None,
    ) -> Array:
        """Filter z[n] in N with this Q and R and one of its choices (the first one where none is
        given).
        """
        chosen = self.choices[0] if constants is None else constants
        return self.run(z_n, process_variance=q_n2, measurement_variance=r_n2, **chosen)


RIVALS: tuple[Filter, ...] = (
    Filter("kf", kbf.run),
    Filter("modified_kbf", modified_kbf.run, "innovation_limit", (300.0, 180.0, 240.0, 600.0)),
    Filter(
        "chi_square",
        over(chi_square_step, KalmanState, ChiSquare),
        "limit",
        (6.63, 3.84, 10.83, 25.0),
    ),
    Filter("huber", over(huber_step, KalmanState, Huber), "corner", (1.345, 0.7, 2.0, 3.0)),
    Filter(
        "saturated",
        over(saturated_step, KalmanState, Saturated),
        "limit",
        (300.0, 90.0, 180.0, 600.0),
    ),
    Filter(
        "student_t", over(student_t_step, KalmanState, StudentT), "freedom", (4.0, 2.0, 8.0, 30.0)
    ),
)
OWN = Filter("own", persistent.run, "innovation_limit", (300.0,), (("hold_samples", 10.0),))
