"""sensor.line_b: sensor B behind a long thin pipe."""

from __future__ import annotations

import math

from testbed.effects.base import Effect
from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import Change, RobotSeen, Signature
from testbed.effects.terms import Observed, Signals, Values

SMOOTHING_S = 0.010
"""Width of the smoothing before the inverse's derivatives: beyond it they would only raise
noise.
"""


USUAL_DAMPING, LEAST_LAG_S = 0.8, 1.0e-3
"""Of the lines of a robot (E)."""
SOUND_LAG_S, SOUND_COST = 2.0e-3, 1.0e3
"""By so much a transducer with its amplifier is late (E: one of 80 Hz), and what a line costs that
is late by nothing."""


class LineB(Effect):
    """Sensor B behind a long thin pipe."""

    kind = "sensor.line_b"
    equation = (
        "d2r/dt2 = w^2 (pB - r) - 2 damping w dr/dt, w = 2 pi natural_frequency, r = measured pB"
    )
    text = "pressure B is measured behind a line that delays it"
    parameters = (
        ParameterSpec("natural_frequency", "Hz", 1.0, 400.0, (3.0, 25.0), "of the line", log=True),
        ParameterSpec("damping", "1", 0.1, 8.0, (0.4, 1.5), "of the line", log=True),
    )
    needs = ("position", "pressure_a", "pressure_b")
    rigs = ("vertical-leg", "cylinder")
    seen_in = ("force", "flow")
    far_from_linear = True
    telling_motion = "sharp steps of the valve against a held piston, then slow ramps"
    alike = {"sensor.delay": "a delay makes pressure A late too"}
    hides = {
        "natural_frequency": "transducers.pipe_frequency",
        "damping": "transducers.pipe_damping",
    }
    lowest = 0.0
    usual = 0.05

    def correct(self, signals: Signals, values: Values) -> Signals:
        """What the sensor should have read."""
        b = signals.pressure_b_pa
        if b is None:
            return signals
        w = 2.0 * math.pi * values["natural_frequency"]
        rate = signals.slope(b, SMOOTHING_S)
        bend = signals.change(rate)
        return signals.with_(
            pressure_b_pa=b + (2.0 * values["damping"] / w) * rate + bend / (w * w)
        )

    def price(self, values: Values, observed: Observed) -> float:
        """A transducer is late by itself, and on a leg that is no finding: what a line costs that
        is late by less than SOUND_LAG_S.
        """
        if observed.kind != "vertical-leg":
            return 0.0
        return SOUND_COST * max(1.0 - self.to_linear(values)["lag"] / SOUND_LAG_S, 0.0)

    def starts(self, observed: Observed) -> list[dict[str, float]]:
        """Five natural frequencies between 5 and 100 Hz."""
        return [{"natural_frequency": f, "damping": 0.8} for f in (5.0, 10.0, 20.0, 45.0, 100.0)]

    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """Sensor B is late by 2 damping / w of the pressure's rate; its swing is not seen."""
        i = seen.axis(place)
        force = seen.area_b_m2[i] * seen.pressure_b_rate[:, i]
        flow = seen.oil_by_lateness[:, i] * (0.0, 1.0)
        return {"lag": Change(force={i: force}, oil={i: flow})}

    def from_linear(self, linear: Values, seen: RobotSeen, place: str) -> dict[str, float]:
        """Of a line with the usual damping."""
        w = 2.0 * USUAL_DAMPING / max(linear["lag"], LEAST_LAG_S)
        return {"natural_frequency": w / (2.0 * math.pi), "damping": USUAL_DAMPING}

    def to_linear(self, values: Values) -> dict[str, float]:
        """The other way round."""
        return {"lag": values["damping"] / (math.pi * values["natural_frequency"])}


EFFECTS = (LineB(),)
