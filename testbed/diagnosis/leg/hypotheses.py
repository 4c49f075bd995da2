"""Which effects a rig's data can show, and from where each one's fit starts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.leg.evidence import Key, of_residual
from testbed.diagnosis.leg.fit import Fit, solve, step_gain
from testbed.diagnosis.leg.problem import Coordinate, Point, Problem, effect_coordinates
from testbed.diagnosis.leg.series import BIN, Series
from testbed.effects import ALL, Active
from testbed.effects.base import Effect
from testbed.effects.placed import kind_of

Array = npt.NDArray[np.float64]
SHAPES: dict[str, tuple[tuple[str, ...], ...]] = {
    "friction.position": (("curvature", "cubic", "quartic"),),
    "friction.pressure": (("exponent", "imbalance"),),
    "friction.load": (("exponent",),),
    "friction.presliding": (("shape",),),
    "friction.temperature": (("coulomb_rate",),),
    "inertia.mass": (("weight_share",),),
    "force.spring": (("cubic",),),
    "force.cushion": (("exponent",),),
    "sensor.gain_a": (("bend",),),
    "sensor.gain_b": (("bend",),),
    "sensor.drift_a": (("decay",),),
    "sensor.delay": (("lag_share",),),
    "leakage.internal": (("exponent",),),
    "hydraulics.air": (("exponent",),),
}
"""Further shapes of an effect's law, tried before another effect is called in."""


@dataclass(frozen=True)
class LeftOut:
    """A hypothesis that this data cannot show, and why."""

    name: str
    reason: str


def available(problem: Problem) -> tuple[list[Effect], list[LeftOut]]:
    """Effects that the rig's channels and motions can show, and those left out with the reason."""
    signals = [s.signals for s in problem.series]
    has = {
        "position": True,
        "pressure_a": all(s.pressure_a_pa is not None for s in signals),
        "pressure_b": all(s.pressure_b_pa is not None for s in signals),
        "oil_temperature": all(s.oil_temperature_degc is not None for s in signals),
        "valve_command": problem.with_flow,
        "supply_pressure": all(s.supply_pressure_pa is not None for s in signals),
    }
    use: list[Effect] = []
    out: list[LeftOut] = []
    for effect in ALL:
        missing = [need for need in effect.needs if not has.get(need, False)]
        if effect.name in {a.effect.name for a in problem.believed}:
            out.append(LeftOut(effect.name, "the model has it already"))
        elif problem.base.rig not in effect.kinds:
            out.append(LeftOut(effect.name, f"does not exist in a rig of kind {problem.base.rig}"))
        elif missing:
            out.append(LeftOut(effect.name, f"needs the channel {missing[0]}"))
        elif (
            effect.name == "friction.temperature"
            and _span(problem.series, "oil_temperature_degc") < 3.0
        ):
            out.append(
                LeftOut(effect.name, "the oil's temperature hardly changes in these recordings")
            )
        elif effect.name == "friction.load" and _load(problem.series) < 50.0:
            out.append(
                LeftOut(effect.name, "no recording with load: the foot is always in the air")
            )
        elif effect.name == "inertia.mass" and _mass_is_blind(problem):
            out.append(LeftOut(effect.name, "no acceleration to speak of, and the axis is level"))
        else:
            use.append(effect)
    return use, out


def _span(series: Sequence[Series], channel: str) -> float:
    values = [np.percentile(getattr(s.signals, channel), [2, 98]) for s in series]
    return float(max(v[1] for v in values) - min(v[0] for v in values))


def _load(series: Sequence[Series]) -> float:
    loads = [
        float(np.percentile(np.abs(s.reference_n), 98)) for s in series if s.reference_n is not None
    ]
    return max(loads, default=0.0)


def _mass_is_blind(problem: Problem) -> bool:
    """A bench that moves at constant speed shows no mass (declared or not)."""
    return problem.base.rig == "cylinder" and all(
        float(np.percentile(np.abs(s.signals.acceleration_m_s2), 90)) < 0.3 for s in problem.series
    )


def starts(effect: Effect, problem: Problem, at: Point, residual: Array) -> list[dict[str, float]]:
    """Starting values; several where the residual has several valleys."""
    name, known = kind_of(effect.name), problem.base.known
    x = np.concatenate([s.signals.position_m for s in problem.series])
    low, high = np.percentile(x, [5, 95])
    if name == "friction.presliding":
        reach = max(at.friction.coulomb_plus_n, at.friction.coulomb_minus_n, 1.0)
        return [
            {"stiffness": reach / d, "damping": 0.05 * reach / d / 50.0} for d in (4e-3, 5e-4, 1e-4)
        ]
    if name == "force.cushion":
        return [
            {"start": float(low + share * (high - low)), "stiffness": 300.0}
            for share in (0.3, 0.65)
        ]
    if name == "force.spring":
        return [{"stiffness": 50.0, "rest": float(0.5 * (low + high))}]
    if name in ("hydraulics.hose", "supply.droop"):
        return [{"time": t} for t in (0.05, 0.4)]
    if name == "sensor.line_b":
        return [{"natural_frequency": f, "damping": 0.8} for f in (5.0, 10.0, 20.0, 45.0, 100.0)]
    if name == "sensor.delay":
        return [{"delay": 0.002}]
    if name == "leakage.internal":
        return [{"coefficient": (known.internal_leakage_m3_s_pa or 0.0) + 2e-13}]
    if name == "valve.deadband":
        return [{"deadband": (known.valve_deadband or 0.0) + 0.005}]
    if name == "friction.pressure":
        return [{"coefficient": 1e-6}]
    if name == "friction.load":
        return [{"coefficient": 1e-3}]
    if name == "hydraulics.air":
        return [{"fraction": 1e-3}]
    if name == "friction.temperature":
        return [{"rate": 0.002}]
    if name == "force.periodic":
        return [{"frequency": f, "amplitude": a} for f, a in peaks(problem, residual)]
    return [{spec.name: 0.0 for spec in effect.parameters if spec.default is None}]


def peaks(problem: Problem, residual: Array, count: int = 1) -> list[tuple[float, float]]:
    """(frequency Hz, amplitude N) of the strongest lines of the force residual above 1.5 Hz, all recordings summed."""
    grid = np.arange(1.5, 35.0, 0.02)
    power, weight, first = np.zeros_like(grid), 0.0, 0
    layout = problem.layout["force"]
    for s in problem.series:
        rows = slice(first, first + s.bins)
        first += s.bins
        good = layout.count[rows] > 0
        if good.sum() < 100:
            continue
        r = np.where(good, residual[rows], 0.0)
        limit = 4.0 * 1.48 * float(np.median(np.abs(r[good])))
        r = np.clip(r - np.mean(r[good]), -limit, limit) * good
        rate = s.signals.rate_hz / BIN
        size = 1 << 17
        spectrum = np.abs(np.fft.rfft(r, size)) ** 2
        frequency = np.fft.rfftfreq(size, 1.0 / rate)
        share = 4.0 * np.interp(grid, frequency, spectrum) / float(good.sum()) ** 2
        inside = grid < 0.45 * rate
        power += np.where(inside, share, 0.0) * good.sum()
        weight += float(good.sum())
    out: list[tuple[float, float]] = []
    for _ in range(count):
        # A line stands out of its own neighbourhood, not out of a spectrum that falls with frequency.
        at = int(np.argmax(power / np.maximum(_neighbourhood(power), 1e-30)))
        amplitude = float(np.sqrt(power[at] / max(weight, 1.0)))
        s = problem.series[0]
        damped = np.exp(-0.5 * (2.0 * np.pi * grid[at] * s.width_s) ** 2)
        attenuation = np.sinc(grid[at] * BIN / s.signals.rate_hz) * damped
        out.append((float(grid[at]), max(amplitude / max(float(attenuation), 0.2), 1.0)))
        power[np.abs(grid - grid[at]) < 0.3] = 0.0
    return out


def _neighbourhood(power: Array) -> Array:
    from scipy.ndimage import median_filter

    return np.asarray(
        median_filter(power, 151, mode="nearest") + 1e-3 * float(np.mean(power)), dtype=np.float64
    )


def fit_with(
    problem: Problem,
    at: Fit,
    effect: Effect,
    shapes: Sequence[str] = (),
    iterations: int = 20,
    replace_effect: bool = False,
) -> Fit:
    """`at` with one more effect (or, `replace_effect`, with further shapes of one it has), from every start."""
    best: tuple[float, Fit] | None = None
    memory = of_residual(problem, at.residual).memory
    residual = at.residual["force"]
    current = {a.effect.name: dict(a.values) for a in at.at.effects}
    options = [current[effect.name]] if replace_effect else starts(effect, problem, at.at, residual)
    if len(options) > 2:
        options = sorted(options, key=lambda s: -_promised(problem, at, effect, s))[:2]
    for start in options:
        kept = [c for c in at.coordinates if not (replace_effect and c.owner == effect.name)]
        coordinates = [restarted(c, at.at) for c in kept]
        for c in effect_coordinates(effect, shapes, start):
            coordinates.append(bounded(c, problem))
        fixed = at.at
        if kind_of(effect.name) == "force.periodic":
            coordinates = [c for c in coordinates if c.name not in ("amplitude",)]
            fixed = replace(
                at.at, effects=(*_others(at.at, effect), Active(effect, effect.complete(start)))
            )
        fit = solve(problem, coordinates, fixed, iterations, at.scale)
        cost = _log_cost(problem, fit, memory)
        if best is None or cost < best[0]:
            best = (cost, fit)
    assert best is not None
    return best[1]


def promise(problem: Problem, at: Fit, effect: Effect) -> float:
    """Fall of the robust cost that one linearised step with the effect promises (best of its starts)."""
    if kind_of(effect.name) == "force.periodic":
        # Its strength is not a parameter: the line's own power says what it could explain.
        (frequency, amplitude), *_ = peaks(problem, at.residual["force"])
        layout = problem.layout["force"]
        use = layout.count > 0
        scale = at.scale["force"][layout.group[use]] * layout.relative[use]
        return (
            float(np.sum(np.minimum(0.25 * amplitude**2 / scale**2, 1.0)))
            if frequency > 0.0
            else 0.0
        )
    return max(
        _promised(problem, at, effect, s)
        for s in starts(effect, problem, at.at, at.residual["force"])
    )


def _promised(problem: Problem, at: Fit, effect: Effect, start: dict[str, float]) -> float:
    extra = [bounded(c, problem) for c in effect_coordinates(effect, (), start)]
    both = [*(restarted(c, at.at) for c in at.coordinates), *extra]
    return step_gain(problem, at, both, len(extra))


def _others(at: Point, effect: Effect) -> list[Active]:
    return [a for a in at.effects if a.effect.name != effect.name]


def _log_cost(problem: Problem, fit: Fit, memory: Mapping[Key, float]) -> float:
    """Less is better; `memory`: correlation times that are the same for all that are compared."""
    found = of_residual(problem, fit.residual)
    return -sum(v / memory[k] for k, v in found.log_likelihood.items())


def restarted(c: Coordinate, at: Point) -> Coordinate:
    """The coordinate with the point's value as its start."""
    if c.owner == "friction":
        value = float(getattr(at.friction, c.name))
    elif c.owner == "nuisance":
        value = float(getattr(at.edge, c.name))
    elif c.owner == "zero":
        value = at.zero_n
    else:
        value = next(a.values[c.name] for a in at.effects if a.effect.name == c.owner)
    return replace(c, start=float(np.clip(value, c.low, c.high)))


MOST_DAMPED_N_S_M = 1e4
"""A bristle with more damping, several times what lip seals show, is a lag and no seal."""


def bounded(c: Coordinate, problem: Problem) -> Coordinate:
    """Bounds that depend on the rig: a cushion must begin and end inside the travel, a spring rest near it."""
    x = np.concatenate([s.signals.position_m for s in problem.series])
    owner = kind_of(c.owner)
    if (owner, c.name) == ("force.cushion", "start"):
        low, high = np.percentile(x, [1, 99])
        return replace(
            c,
            low=float(low),
            high=float(high),
            scale=float(0.3 * (high - low)),
            prior=None,
            start=float(np.clip(c.start, low, high)),
        )
    if (owner, c.name) == ("force.spring", "rest"):
        low, high = float(x.min()), float(x.max())
        span = max(high - low, 1e-3)
        return replace(
            c,
            low=low - 2 * span,
            high=high + 2 * span,
            scale=0.3 * span,
            prior=(0.5 * (low + high), 1.5 * span),
        )
    if (
        c.owner != owner
        and c.name == "coefficient"
        and owner in ("friction.pressure", "friction.load")
    ):
        # One leg of four: it may stick more than the others, not less than nothing. (With the diagonal open, one leg
        # that sticks and three with the opposite of it look alike.)
        return replace(c, low=0.0)
    if (owner, c.name) == ("friction.presliding", "damping") and problem.kind == "vertical-leg":
        return replace(c, high=MOST_DAMPED_N_S_M)
    if owner == "valve.deadband":
        return replace(c, low=0.0, high=0.6, prior=None)
    return c
