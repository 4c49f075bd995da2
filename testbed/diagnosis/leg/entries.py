"""A fit's effects as model files carry them: values with the intervals that hold the truth in 90 of
100 cases.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.leg.evidence import Evidence
from testbed.diagnosis.leg.fit import Fit, bounds
from testbed.diagnosis.leg.points import FRICTION
from testbed.effects import kind_of, place_of
from testbed.effects.base import Effect
from testbed.formats.intervals import Z90
from testbed.recording.leg_model import EffectEntry, Parameter

CAUTION, OTHER_FORM = 2.0, {"force": 0.12, "flow": 0.05}
"""Intervals are wider than the data alone say: by this factor, and by this share of the value for
what the force balance shows and what only flows show, as friction and sensors are never exactly
what their formulas say. Set on the rigs that `calibration.yaml` was fitted on."""
NEAR_BOUND = 1e-3
"""Share of a bound, or of a number's own scale, within which the number stands at it."""


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


def worth_interval(
    fit: Fit, effect: Effect, memory: float, by_blocks: npt.NDArray[np.float64]
) -> tuple[float, float] | None:
    """90 % interval of what an effect is worth whose size is a share of numbers of the friction:
    size times their mean, SI. None for other effects, or where these are not fitted.
    """
    owned = [(coordinate.owner, coordinate.name) for coordinate in fit.coordinates]
    numbers = [(FRICTION, name) for name in effect.relative_to]
    size = (effect.name, effect.required[0])
    if not numbers or any(key not in owned for key in (size, *numbers)):
        return None
    places = [owned.index(number) for number in numbers]
    share, whole = float(fit.theta[owned.index(size)]), float(np.mean(fit.theta[places]))
    slope = np.zeros(len(owned))
    slope[owned.index(size)] = whole
    slope[places] = share / len(places)
    variance = max(float(slope @ fit.covariance @ slope) * max(memory, 1.0), 0.0)
    variance = max(variance, float(slope @ by_blocks @ slope))
    half = np.hypot(Z90 * CAUTION * np.sqrt(variance), OTHER_FORM["force"] * abs(share * whole))
    return float(share * whole - half), float(share * whole + half)


def at_bounds(fit: Fit) -> dict[str, tuple[str, ...]]:
    """Name of an effect -> its fitted numbers that stand at a bound; effects without such are left
    out. The natural end of a number, up to which it is expected to go, such as a share of 1, is no
    bound; nor is the least that a logarithm goes down to where there may be none, of a damping say.
    """
    effects = {active.effect.name: active.effect for active in fit.at.effects}
    low, high = bounds(fit.coordinates)
    out: dict[str, tuple[str, ...]] = {}
    for coordinate, theta, ends in zip(
        fit.coordinates, fit.theta, np.column_stack([low, high]), strict=True
    ):
        if coordinate.owner not in effects:
            continue
        spec = effects[coordinate.owner].spec(coordinate.name)
        expected = np.log(np.maximum(spec.prior, 1e-300)) if coordinate.log else spec.prior
        near = np.abs(theta - ends) <= NEAR_BOUND * coordinate.scale
        if coordinate.log and spec.low <= 0.0:
            near[0] = False
        if (near & ~np.isin(ends, expected)).any():
            out[coordinate.owner] = (*out.get(coordinate.owner, ()), coordinate.name)
    return out


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
