"""A fit's effects as model files carry them: values with the intervals that hold the truth in 90 of
100 cases.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.leg.evidence import Evidence
from testbed.diagnosis.leg.fit import Fit
from testbed.effects import kind_of, place_of
from testbed.formats.intervals import Z90
from testbed.recording.leg_model import EffectEntry, Parameter

CAUTION, OTHER_FORM = 2.0, {"force": 0.12, "flow": 0.05}
"""Intervals are wider than the data alone say: by this factor, and by this share of the value for
what the force balance shows and what only flows show, as friction and sensors are never exactly
what their formulas say. Set on the rigs that `calibration.yaml` was fitted on."""


def memory_of(found: Evidence) -> float:
    """Typical correlation time of the moving groups' residuals, bins."""
    values = [
        value for name, value in found.memory.items() if name[0] in ("force", "flow_a", "flow_b")
    ]
    return float(np.median(values)) if values else 1.0


def entries_of(
    fit: Fit, memory: float, by_blocks: npt.NDArray[np.float64] | None = None
) -> tuple[EffectEntry, ...]:
    """A fit's effects as model-file entries with 90 % intervals; `memory`: correlation time of the
    residual, bins;
    `by_blocks`: covariance with blocks as witnesses. The wider of both counts.
    """
    variance = np.diag(fit.covariance) * max(memory, 1.0)
    if by_blocks is not None:
        variance = np.maximum(variance, np.diag(by_blocks))
    sigma = CAUTION * np.sqrt(np.maximum(variance, 0.0))
    spread = {
        (coordinate.owner, coordinate.name): (coordinate, t, deviation)
        for coordinate, t, deviation in zip(fit.coordinates, fit.theta, sigma, strict=True)
    }
    out = []
    for active in fit.at.effects:
        parameters = {}
        for name, value in active.values.items():
            spec = active.effect.spec(name)
            if (
                spec.default is not None
                and value == spec.default
                and (active.effect.name, name) not in spread
            ):
                continue
            parameters[name] = Parameter(
                value=value,
                unit=spec.unit,
                interval90=_interval(spread, active.effect.name, name, value),
            )
        name = active.effect.name
        out.append(EffectEntry(name=kind_of(name), parameters=parameters, place=place_of(name)))
    return tuple(out)


def _interval(
    spread: dict[tuple[str, str], Any], owner: str, name: str, value: float
) -> tuple[float, float] | None:
    if (owner, name) not in spread:
        return None
    coordinate, t, deviation = spread[(owner, name)]
    form = OTHER_FORM["force" if "force" in coordinate.moves else "flow"]
    half = np.hypot(Z90 * deviation, form * (1.0 if coordinate.log else abs(t)))
    low, high = t - half, t + half
    if coordinate.log:
        low, high = float(np.exp(low)), float(np.exp(high))
    return float(max(min(low, value), coordinate.low)), float(
        min(max(high, value), coordinate.high)
    )
