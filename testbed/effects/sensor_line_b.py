"""sensor.line_b: sensor B behind a long thin pipe."""

from __future__ import annotations

import math

import numpy as np

from testbed.effects.base import Array, Effect, ParameterSpec, Signals, Values

SMOOTHING_S = 0.010
"""Width of the smoothing before the inverse's derivatives: beyond it they would only raise noise."""


def line_acceleration_pa_s2(
    pressure_pa: float,
    read_pa: float,
    read_rate_pa_s: float,
    natural_frequency: float,
    damping: float,
) -> float:
    """d2p_read/dt2 of the second-order line."""
    w = 2.0 * math.pi * natural_frequency
    return w * w * (pressure_pa - read_pa) - 2.0 * damping * w * read_rate_pa_s


def _correct(signals: Signals, p: Values) -> Signals:
    b = signals.pressure_b_pa
    if b is None:
        return signals
    w = 2.0 * math.pi * p["natural_frequency"]
    smooth = flat(b, SMOOTHING_S * signals.rate_hz)
    rate = np.gradient(smooth) * signals.rate_hz
    bend = np.gradient(rate) * signals.rate_hz
    return signals.with_(pressure_b_pa=b + (2.0 * p["damping"] / w) * rate + bend / (w * w))


def flat(values: Array, width: float) -> Array:
    """Twice the Gaussian less the Gaussian twice: smooth, and flat to fourth order."""
    from scipy.ndimage import gaussian_filter1d

    once = gaussian_filter1d(values, width, mode="nearest")
    return np.asarray(2.0 * once - gaussian_filter1d(once, width, mode="nearest"), dtype=np.float64)


EFFECT = Effect(
    name="sensor.line_b",
    equation="d2r/dt2 = w^2 (pB - r) - 2 damping w dr/dt, w = 2 pi natural_frequency, r = measured pB",
    text="pressure B is measured behind a line that delays it",
    parameters=(
        ParameterSpec("natural_frequency", "Hz", 1.0, 400.0, (3.0, 25.0), "of the line"),
        ParameterSpec("damping", "1", 0.1, 8.0, (0.4, 1.5), "of the line"),
    ),
    needs=("position", "pressure_a", "pressure_b"),
    kinds=("vertical-leg", "cylinder"),
    correct=_correct,
    law=line_acceleration_pa_s2,
    seen_in=("force", "flow"),
)
