"""force.periodic: a narrow-band force on the piston."""

from __future__ import annotations

import math

from testbed.effects.base import Effect, ForceTerms, ParameterSpec, Signals, Values


def force_n(time_s: float, amplitude: float, frequency: float, phase_rad: float = 0.0) -> float:
    """Force on the piston along extension, N; the phase is the machine's own affair."""
    return amplitude * math.sin(2.0 * math.pi * frequency * time_s + phase_rad)


def _force(signals: Signals, terms: ForceTerms, p: Values) -> None:
    terms.narrow_bands.append((p["frequency"], p["amplitude"], round(p["harmonics"])))


EFFECT = Effect(
    name="force.periodic",
    equation="F = amplitude sin(2 pi frequency t + phase) on the piston",
    text="an undeclared vibration: a pump, a motor, an unbalanced shaft",
    parameters=(
        ParameterSpec("amplitude", "N", 0.0, 1e5, (20.0, 300.0), "half of peak to peak"),
        ParameterSpec("frequency", "Hz", 0.2, 200.0, (3.0, 20.0), "of the vibration"),
        ParameterSpec(
            "harmonics",
            "1",
            1.0,
            5.0,
            (1.0, 3.0),
            "how many multiples of the frequency it holds",
            1.0,
        ),
    ),
    force=_force,
    law=force_n,
)
