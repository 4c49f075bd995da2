"""sensor.delay: pressures (in a drive: the force) late against the encoder."""

from __future__ import annotations

import numpy as np

from testbed.effects.base import Array, Effect, ParameterSpec, Signals, Values


def _earlier(values: Array | None, time: Array, delay: float) -> Array | None:
    if values is None:
        return None
    return np.asarray(np.interp(time + delay, time, values), dtype=np.float64)


def _correct(signals: Signals, p: Values) -> Signals:
    time, delay = signals.time_s, p["delay"]
    return signals.with_(
        pressure_a_pa=_earlier(signals.pressure_a_pa, time, delay),
        pressure_b_pa=_earlier(signals.pressure_b_pa, time, delay),
        actuator_force_n=_earlier(signals.actuator_force_n, time, delay),
    )


EFFECT = Effect(
    name="sensor.delay",
    equation="measured p(t) = p(t - delay)",
    text="both pressures (in a drive: the force) arrive late against the encoder",
    parameters=(ParameterSpec("delay", "s", -0.002, 0.2, (0.003, 0.03), "positive: the pressures are late"),),
    correct=_correct,
    seen_in=("force", "flow"),
)
