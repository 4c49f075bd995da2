"""sensor.gain_a, sensor.gain_b: a pressure sensor whose gain is not its calibration's."""

from __future__ import annotations

from typing import Any

from testbed.effects.base import Effect, ParameterSpec, Signals, Values

REFERENCE_PA = 1e7


def measured_pa(pressure_pa: Any, gain_error: float) -> Any:
    """What the sensor reports for a pressure."""
    return (1.0 + gain_error) * pressure_pa


def true_pa(measured: Any, gain_error: float, bend: float = 0.0) -> Any:
    """The pressure behind a reading; bend is a gain that changes with pressure, 0 in the contract's formula."""
    return measured / (1.0 + gain_error + bend * measured / REFERENCE_PA)


def _correct_a(signals: Signals, p: Values) -> Signals:
    if signals.pressure_a_pa is None:
        return signals
    return signals.with_(pressure_a_pa=true_pa(signals.pressure_a_pa, p["gain_error"], p["bend"]))


def _correct_b(signals: Signals, p: Values) -> Signals:
    if signals.pressure_b_pa is None:
        return signals
    return signals.with_(pressure_b_pa=true_pa(signals.pressure_b_pa, p["gain_error"], p["bend"]))


PARAMETERS = (
    ParameterSpec("gain_error", "1", -0.5, 1.0, (-0.06, 0.06), "relative error of the gain"),
    ParameterSpec("bend", "1", -0.3, 0.3, (-0.05, 0.05), "further gain error at 100 bar", 0.0),
)

GAIN_A = Effect(
    name="sensor.gain_a",
    equation="measured pA = (1 + gain_error) pA",
    text="the gain of pressure sensor A is off; on a cylinder of nominal bore also the piston area",
    parameters=PARAMETERS,
    needs=("position", "pressure_a"),
    kinds=("vertical-leg", "cylinder"),
    correct=_correct_a,
    law=measured_pa,
    seen_in=("force", "flow"),
)

GAIN_B = Effect(
    name="sensor.gain_b",
    equation="measured pB = (1 + gain_error) pB",
    text="the gain of pressure sensor B is off",
    parameters=PARAMETERS,
    needs=("position", "pressure_a", "pressure_b"),
    kinds=("vertical-leg", "cylinder"),
    correct=_correct_b,
    law=measured_pa,
    seen_in=("force", "flow"),
)
