"""sensor.delay: pressures (in a drive: the force) late against the encoder."""

from __future__ import annotations

import numpy as np

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.sensor_line_b import SMOOTHING_S
from testbed.effects.signature import Change, RobotSeen, Signature
from testbed.effects.terms import Observed, Signals, Values
from testbed.formats.arrays import Array

TRANSDUCER_S = 1.5e-3
"""By so much a pressure may come late through any transducer, its amplifier and the filter before
its converter (E: a second-order filter of 150 Hz)."""


def _earlier(values: Array | None, time: Array, delay: float) -> Array | None:
    if values is None:
        return None
    return np.asarray(np.interp(time + delay, time, values), dtype=np.float64)


def _unlagged(values: Array | None, signals: Signals, lag: float) -> Array | None:
    """What a first-order lag was fed with: r + lag dr/dt."""
    if values is None or lag == 0.0:
        return values
    return values + lag * signals.slope(values, SMOOTHING_S)


class Delay(Effect):
    """Pressures (in a drive: the force) late against the encoder."""

    kind = "sensor.delay"
    equation = "measured p(t) = p(t - delay)"
    text = "both pressures (in a drive: the force) arrive late against the encoder"
    parameters = (
        ParameterSpec("delay", "s", -0.002, 0.2, (0.003, 0.03), "positive: the pressures are late"),
        ParameterSpec(
            "lag_share", "1", 0.0, 1.0, (0.0, 1.0), "share of it that is a first-order lag", 0.0
        ),
    )
    seen_in = ("force", "flow")
    shapes = ("lag_share",)
    within_a_sample = True
    usual_on_legs = (-0.2 * TRANSDUCER_S, TRANSDUCER_S)
    shows_at_speed = True
    telling_motion = "fast reversals at several speeds"
    alike = {
        "friction.presliding": "a bristle's force builds up over a distance, however slow the reversal",
        "inertia.mass": "a mass weighs at rest too",
    }
    hides = {"delay": "pressure_delay_s"}
    bends = ("delay",)

    def usual_on(self, kind: str, sample_s: float) -> tuple[float, float] | None:
        """As late as any transducer; on a bench, whose recorder nobody declares, as late as the
        filter before its converter, which is at most a sample (E: of second order at 0.4 of the
        sampling rate 0.6 of one).
        """
        if kind != "cylinder":
            return super().usual_on(kind, sample_s)
        latest = max(TRANSDUCER_S, sample_s)
        return (-0.2 * latest, latest)

    def correct(self, signals: Signals, values: Values) -> Signals:
        """What the sensor should have read; so far, the motion when it should have read it."""
        time = signals.time_s
        lag = values["delay"] * values["lag_share"]
        delay = values["delay"] - lag
        if signals.causal and delay > 0.0:
            signals, delay = signals.later(delay), 0.0
        return signals.with_(
            pressure_a_pa=_unlagged(_earlier(signals.pressure_a_pa, time, delay), signals, lag),
            pressure_b_pa=_unlagged(_earlier(signals.pressure_b_pa, time, delay), signals, lag),
            actuator_force_n=_unlagged(
                _earlier(signals.actuator_force_n, time, delay), signals, lag
            ),
        )

    def starts(self, observed: Observed) -> list[dict[str, float]]:
        """A short one."""
        return [{"delay": 0.002}]

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """Force and oil by a second of a delay. Pressures turn round within a bin, so a long delay
        makes less of a force than a short one says: of one that is as long as may be expected. The
        oil takes up slopes, which such a shift would smooth: of a short one.
        """
        axis, usual = seen.axis(place), self.spread("delay")
        force = self.made(seen, place, {"delay": usual}).times(1.0 / usual).force
        return {"delay": Change(force=force, oil={axis: seen.oil_by_lateness[:, axis]})}

    def made(self, seen: RobotSeen, place: str, values: Values) -> Change:
        """The force of pressures that were what is read so much later."""
        axis, delay = seen.axis(place), values["delay"]
        late_a = seen.pressure_a_pa[:, axis] - seen.later(axis, 0, delay)
        late_b = seen.pressure_b_pa[:, axis] - seen.later(axis, 1, delay)
        force = seen.area_a_m2[axis] * late_a - seen.area_b_m2[axis] * late_b
        return Change(force={axis: force})


EFFECTS = (Delay(),)
