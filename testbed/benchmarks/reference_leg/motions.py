"""Motions of the reference rigs: what a bench engineer would drive, drawn at random within the
stroke.
"""

from __future__ import annotations

import numpy as np

from testbed.formats.arrays import Array

DURATION_S = {
    "multisine": 30.0,
    "press": 40.0,
    "ramps": 60.0,
    "shake": 15.0,
    "press_sine": 30.0,
    "sine": 20.0,
    "steps": 25.0,
}
IDENTIFY = ("multisine", "press", "ramps", "shake")
VERIFY = ("press_sine", "shake", "sine", "steps")


def target(
    kind: str,
    seconds: float,
    rate_hz: float,
    stroke_m: float,
    ground_m: float,
    rng: np.random.Generator,
) -> Array:
    """Desired position in m, one a sample, shape (n,). `ground_m`: where the load cell is met in
    press motions.
    """
    time_s = np.arange(round(seconds * rate_hz)) / rate_hz
    middle = stroke_m * rng.uniform(0.4, 0.6)
    if kind == "multisine":
        x = np.zeros_like(time_s)
        for f in rng.uniform(0.06, 0.9, 7):
            x += (
                rng.uniform(0.4, 1.0)
                / (1.0 + 4.0 * f)
                * np.sin(2.0 * np.pi * (f * time_s + rng.uniform()))
            )
        return np.asarray(middle + 0.16 * stroke_m * x / np.abs(x).max(), dtype=np.float64)
    if kind == "shake":
        slow = 0.11 * stroke_m * np.sin(2.0 * np.pi * time_s / rng.uniform(8.0, 13.0))
        fast = 0.006 * rng.uniform(0.5, 1.2) * np.sin(2.0 * np.pi * rng.uniform(1.5, 3.0) * time_s)
        other = 0.004 * rng.uniform(0.5, 1.2) * np.sin(2.0 * np.pi * rng.uniform(2.5, 4.5) * time_s)
        return np.asarray(middle + slow + fast + other, dtype=np.float64)
    if kind == "sine":
        f, size = rng.uniform(0.12, 0.3), rng.uniform(0.08, 0.16) * stroke_m
        return np.asarray(
            middle + size * np.sin(2.0 * np.pi * (f * time_s + rng.uniform())), dtype=np.float64
        )
    if kind == "ramps":
        return _ramps(time_s, stroke_m, rng)
    if kind == "steps":
        return _held(time_s, stroke_m * rng.uniform(0.18, 0.8, 12), rng.uniform(1.0, 4.0, 12))
    return _press(time_s, ground_m, rng, kind == "press_sine")


def _held(time_s: Array, levels: Array, times: Array) -> Array:
    index = np.minimum(np.searchsorted(np.cumsum(times), time_s), len(levels) - 1)
    return np.asarray(levels[index], dtype=np.float64)


def _ramps(time_s: Array, stroke_m: float, rng: np.random.Generator) -> Array:
    """Constant speeds, slow to fast, both ways."""
    x, out, direction = stroke_m * 0.25, np.empty_like(time_s), 1.0
    period, left = time_s[1] - time_s[0], 0.0
    speed = 0.005
    for index in range(len(time_s)):
        if left <= 0.0:
            direction = -direction if index else 1.0
            speed = float(np.exp(rng.uniform(np.log(0.002), np.log(0.1))))
            left = float(np.clip(rng.uniform(0.03, 0.25) / speed, 1.5, 7.0))
        nxt = x + direction * speed * period
        if not 0.22 * stroke_m < nxt < 0.78 * stroke_m:
            direction, left = -direction, max(left, 1.0)
            nxt = x + direction * speed * period
        x, left = nxt, left - period
        out[index] = x
    return out


def _press(time_s: Array, ground_m: float, rng: np.random.Generator, wave: bool) -> Array:
    """Down onto the load cell, some loads, up again."""
    count = 24
    above = ground_m - rng.uniform(0.012, 0.022)
    levels, times = [], []
    for _ in range(count):
        levels += [above, *(ground_m + rng.uniform(0.0006, 0.0045, 3))]
        times += [rng.uniform(1.5, 3.0), *rng.uniform(1.0, 3.5, 3)]
    x = _held(time_s, np.array(levels), np.array(times))
    if wave:
        x = x + 0.0006 * np.sin(2.0 * np.pi * rng.uniform(0.2, 0.5) * time_s) * (x > ground_m)
    return np.asarray(x, dtype=np.float64)
