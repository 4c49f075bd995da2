"""A foot that walks: its true load, and what a force estimate of any scale, rate and quality reads
of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Walk:
    """Shares are of the nominal load; `offset` lies on the reading in the air and on the ground
    alike.
    """

    nominal_n: float = 9500.0
    rate_hz: float = 1000.0
    duration_s: float = 40.0
    noise: float = 0.01
    offset: float = 0.0
    drift_per_s: float = 0.0
    ramp_s: float = 0.05
    friction: float = 0.0
    """Error that turns its sign with every change of the load."""
    missing: float = 0.0
    """Share of the samples that are no number."""
    jitter: float = 0.0
    """Of the sampling times, share of a step."""
    seed: int = 1

    def draw(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Time s, true load N, reading N, each (n,)."""
        rng = np.random.default_rng(self.seed)
        n = round(self.duration_s * self.rate_hz)
        time = (np.arange(n) + self.jitter * rng.uniform(-0.45, 0.45, n)) / self.rate_hz
        knots, loads, now = [0.0], [1.0], 0.0
        while now < self.duration_s:
            stance, swing = rng.uniform(1.0, 3.0), rng.uniform(0.4, 1.2)
            level, ramp = rng.uniform(0.6, 1.3), self.ramp_s * rng.uniform(0.5, 2.0)
            for step, load in ((stance, level), (ramp, 0.0), (swing, 0.0), (0.5 * ramp, level)):
                now += step
                knots.append(now)
                loads.append(load)
        true = np.interp(time, knots, loads)
        standing = true > 0.0
        true = true + standing * 0.05 * np.sin(2.0 * np.pi * 1.3 * time) * np.minimum(true, 1.0)
        falling = np.gradient(true) < 0.0
        reading = true + self.offset + self.drift_per_s * time + self.noise * rng.normal(size=n)
        reading += self.friction * np.where(falling, 1.0, -1.0)
        reading[rng.random(n) < self.missing] = np.nan
        return time, self.nominal_n * true, self.nominal_n * reading
