"""Six scenes for a force filter: a true load along one leg, and what a noisy, spiky estimate makes
of it.

1 kHz, noise 60 N (one standard deviation: sensors and friction together). Spikes are what
stick-slip, a valve's edge
and a bad contact leave: 1 to 8 ms long, 0.5 to 4 kN high, four a second. All levels are those of a
machine of 4 t.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from testbed.formats.arrays import Array

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
