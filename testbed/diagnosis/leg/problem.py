"""The residuals of one rig as a function of friction, nuisance and effect parameters, in bins and groups.

A group is one channel (force, flow A, flow B, supply) of one recording; each group has its own noise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.compiled import njit
from testbed.diagnosis.leg.series import BIN, Series
from testbed.effects import Active, by_name
from testbed.effects.base import Effect, ForceTerms, ParameterSpec, Signals
from testbed.effects.placed import kind_of
from testbed.estimation.leg.balance import corrected, external_n, force_terms, without_friction_n
from testbed.estimation.leg.flow import Edge, flow_balance, flow_terms
from testbed.estimation.leg.force import narrow_band
from testbed.estimation.leg.friction import friction_n, static_one_n, static_parts
from testbed.recording.leg_model import Friction, LegModel

Array = npt.NDArray[np.float64]
FRICTION_NAMES = tuple(Friction.model_fields)
STRAIGHT = tuple(name for name in FRICTION_NAMES if "speed" not in name)
"""Numbers of equation (5) that enter straight: viscous, Coulomb, Stribeck of extension, then of retraction."""
Balance = tuple[Signals, ForceTerms, Array]
"""One recording's corrected signals, its terms, and F_ext + F_f in N."""


@dataclass(frozen=True)
class Coordinate:
    """One fitted number: its owner (`friction`, `nuisance` or an effect's name), scale, bounds, channels it moves.

    `log`: fitted as its logarithm.
    """

    owner: str
    name: str
    start: float
    low: float
    high: float
    scale: float
    log: bool = False
    moves: tuple[str, ...] = ("force",)
    prior: tuple[float, float] | None = None
    """(centre, standard deviation) of a weak prior in fitted units."""


@dataclass(frozen=True, eq=False)
class Layout:
    """Which bin of the stacked residual belongs where; shape (total,)."""

    channel: tuple[str, ...]
    group: npt.NDArray[np.int64]
    block: npt.NDArray[np.int64]
    count: Array
    relative: Array
    """Noise of the bin relative to its group's."""
    names: tuple[tuple[str, str], ...]
    """Group number -> (channel, recording)."""


@dataclass(eq=False)
class Problem:
    """Residuals over some series for a base model and a set of effects."""

    series: tuple[Series, ...]
    base: LegModel
    with_flow: bool
    believed: tuple[Active, ...] = ()
    """Effects that the model has already: in every residual, and no hypotheses."""
    layout: dict[str, Layout] = field(default_factory=dict)
    _corrected: tuple[object, list[Signals]] | None = None
    _balanced: tuple[object, list[Balance]] | None = None

    @property
    def kind(self) -> str:
        """What the recordings are of: `vertical-leg`, `cylinder`, `drive` or `robot`."""
        return self.base.rig

    @property
    def unsure(self) -> Mapping[str, float]:
        """Channel -> how uncertain its reference is, in its unit; a bench's is not."""
        return {}

    def channels(self) -> tuple[str, ...]:
        """The channels that this rig has."""
        if not self.with_flow:
            return ("force",)
        supply = all(s.signals.supply_pressure_pa is not None for s in self.series)
        return ("force", "flow", "supply") if supply else ("force", "flow")

    def force(self, model: LegModel, effects: Sequence[Active]) -> Array:
        """Stacked binned force residuals (estimate - reference), N."""
        rows = zip(self.series, self._balances(model, effects), strict=True)
        return np.concatenate([_force_one(s, balance, model.friction) for s, balance in rows])

    def straight_columns(self, model: LegModel, effects: Sequence[Active]) -> Array | None:
        """d(force residual) / d(STRAIGHT), shape (bins, 6): friction's levels and viscous numbers enter straight.

        None where they do not: the friction has a memory, or bends with the load, or a band is taken out.
        """
        parts = []
        for s, balance in zip(self.series, self._balances(model, effects), strict=True):
            if not _plain(balance[1]):
                return None
            parts.append(_plain_columns(*_plain_parts(s, balance, model.friction), BIN))
        return np.concatenate(parts)

    def _balances(self, model: LegModel, effects: Sequence[Active]) -> list[Balance]:
        """The balance without friction of every series; kept while only friction is varied."""
        key = (
            id(model.known),
            model.force_offset_n,
            [(a.effect.name, dict(a.values)) for a in effects],
        )
        if self._balanced is None or self._balanced[0] != key:
            found = []
            for signals in self._signals(effects):
                terms = force_terms(model, signals, effects)
                found.append((signals, terms, without_friction_n(signals, terms)))
            self._balanced = (key, found)
        return self._balanced[1]

    def _signals(self, effects: Sequence[Active]) -> list[Signals]:
        """Corrected signals of every series; the last correction is kept, as most parameters leave sensors alone."""
        sensors = [a for a in effects if a.effect.correct is not None]
        key = [(a.effect.name, dict(a.values)) for a in sensors]
        if self._corrected is None or self._corrected[0] != key:
            self._corrected = (key, [corrected(s.signals, sensors) for s in self.series])
        return self._corrected[1]

    def flow(self, model: LegModel, effects: Sequence[Active], edge: Edge) -> dict[str, Array]:
        """Stacked binned flow residuals of A and B (m3/s), concatenated, and of the supply (Pa)."""
        parts: dict[str, list[Array]] = {"flow": [], "supply": []}
        for s, signals in zip(self.series, self._signals(effects), strict=True):
            terms = flow_terms(signals, effects)
            declared = signals.known.valve_deadband
            open_ = s.opening if terms.deadband == declared else s.opening_for(terms.deadband)
            assert open_ is not None
            balance = flow_balance(signals, terms, open_, edge)
            parts["flow"] += [
                s.binned(balance.a_m3_s, s.clear)[0],
                s.binned(balance.b_m3_s, s.clear)[0],
            ]
            if balance.supply_pa is not None:
                parts["supply"].append(s.binned(balance.supply_pa, s.clear)[0])
        return {name: np.concatenate(values) for name, values in parts.items() if values}

    def __post_init__(self) -> None:
        self.layout = {channel: self._layout(channel) for channel in self.channels()}

    def _layout(self, channel: str) -> Layout:
        names: list[tuple[str, str]] = []
        group: list[npt.NDArray[np.int64]] = []
        block: list[npt.NDArray[np.int64]] = []
        count: list[Array] = []
        noise: list[Array] = []
        for s in self.series:
            mask = s.trusted & s.clear if channel == "force" else s.clear
            used = s.binned(np.zeros(len(mask)), mask)[1]
            moving = s.binned(np.zeros(len(mask)), s.trusted)[1] > 0
            for part in ("flow_a", "flow_b") if channel == "flow" else (channel,):
                here = np.full(s.bins, len(names), dtype=np.int64)
                names.append((part, s.name))
                if channel == "flow":
                    here[~moving] += 1
                    names.append((part + "_rest", s.name))
                group.append(here)
                block.append(s.block)
                count.append(used)
                noise.append(s.encoder_noise_n() if channel == "force" else s.encoder_noise_m3_s())
        g = np.concatenate(group)
        counts, flat = (
            np.concatenate(count),
            np.concatenate(noise) if channel != "supply" else np.zeros(len(g)),
        )
        relative = np.ones(len(g))
        for number in range(len(names)):
            here = (g == number) & (counts > 0)
            mean = float(np.mean(flat[here] ** 2)) if here.any() else 0.0
            if mean > 0.0:
                relative[here] = np.sqrt(0.3 + 0.7 * flat[here] ** 2 / mean)
        return Layout((channel,), g, np.concatenate(block), counts, relative, tuple(names))


def _force_one(s: Series, balance: Balance, friction: Friction) -> Array:
    """Binned force residual of one series, N."""
    signals, terms, total = balance
    mask = s.trusted & s.clear
    if _plain(terms):
        return np.asarray(_plain_error(*_plain_parts(s, balance, friction), BIN))
    value = external_n(
        total - friction_n(friction, signals, terms), np.sign(signals.velocity_m_s), terms
    )
    error = value - (s.reference_n if s.reference_n is not None else 0.0)
    for frequency, amplitude, harmonics in terms.narrow_bands:
        error = error - narrow_band(error, mask, signals, frequency, harmonics, amplitude)
    return s.binned(error, mask)[0]


def _plain(terms: ForceTerms) -> bool:
    """Whether friction has no memory and grows straight with the load, and no band is taken out."""
    straight = terms.load_coefficient == 0.0 or terms.load_exponent == 1.0
    return straight and terms.presliding is None and not terms.narrow_bands


def _plain_parts(s: Series, balance: Balance, friction: Friction) -> tuple[Any, ...]:
    signals, terms, total = balance
    reference = np.zeros_like(total) if s.reference_n is None else s.reference_n
    parts = static_parts(friction, signals, terms)
    return (
        total,
        signals.velocity_m_s,
        reference,
        s.trusted & s.clear,
        *parts,
        float(terms.load_coefficient),
    )


@njit
def _plain_error(
    total: Array,
    v: Array,
    reference: Array,
    mask: npt.NDArray[np.bool_],
    friction: Array,
    scale: Array,
    add: Array,
    thin: Array,
    load: float,
    width: int,
) -> Array:
    """The same in one pass, for friction without memory that grows straight with the load; shape (n // width,)."""
    out = np.zeros(len(total) // width)
    for b in range(len(out)):
        count = 0
        for i in range(b * width, (b + 1) * width):
            if not mask[i]:
                continue
            rest = total[i] - static_one_n(v[i], friction, scale[i], add[i], thin[i])
            if rest > 0.0:
                rest /= 1.0 + np.sign(v[i]) * load
            out[b] += rest - reference[i]
            count += 1
        out[b] /= max(count, 1)
    return out


@njit
def _plain_columns(
    total: Array,
    v: Array,
    reference: Array,
    mask: npt.NDArray[np.bool_],
    friction: Array,
    scale: Array,
    add: Array,
    thin: Array,
    load: float,
    width: int,
) -> Array:
    """Derivatives of `_plain_error` for STRAIGHT; shape (n // width, 6)."""
    out = np.zeros((len(total) // width, 6))
    for b in range(len(out)):
        count = 0
        for i in range(b * width, (b + 1) * width):
            if not mask[i]:
                continue
            count += 1
            at, way = (0, np.sign(v[i])) if v[i] >= 0.0 else (3, -1.0)
            fade = np.exp(-abs(v[i]) / friction[3 if at == 0 else 7])
            level = (
                friction[1 if at == 0 else 5] * scale[i]
                + add[i]
                + friction[2 if at == 0 else 6] * fade
            )
            viscous = friction[0 if at == 0 else 4] * thin[i] * v[i]
            share = -1.0 / (1.0 + way * load) if total[i] - viscous - way * level > 0.0 else -1.0
            out[b, at] += share * thin[i] * v[i]
            out[b, at + 1] += share * way * scale[i]
            out[b, at + 2] += share * way * fade
        out[b] /= max(count, 1)
    return out


def effect_coordinates(
    effect: Effect, shapes: Sequence[str] = (), start: dict[str, float] | None = None
) -> list[Coordinate]:
    """Coordinates of an effect's required parameters and of the further shapes asked for."""
    out = []
    for spec in effect.parameters:
        if spec.default is not None and spec.name not in shapes:
            continue
        value = (start or {}).get(spec.name, _start(spec))
        out.append(_coordinate(effect, spec, value))
    return out


def _start(spec: ParameterSpec) -> float:
    low, high = spec.prior
    if spec.default is not None:
        return spec.default
    if low > 0.0:
        return float(np.sqrt(low * high))
    return 0.0


POSITIVE = {
    "stiffness",
    "damping",
    "frequency",
    "natural_frequency",
    "time",
    "fraction",
    "capacity",
    "droop",
    "exponent",
}


def _coordinate(effect: Effect, spec: ParameterSpec, value: float) -> Coordinate:
    log = spec.name in POSITIVE and spec.prior[0] > 0.0 and kind_of(effect.name) != "force.spring"
    low, high = spec.prior
    moves = tuple(effect.seen_in) if effect.seen_in != ("flow", "supply") else ("flow", "supply")
    if log:
        width = np.log(high / low) / 3.3
        return Coordinate(
            effect.name,
            spec.name,
            value,
            max(spec.low, low * 1e-3),
            min(spec.high, high * 1e3),
            width,
            True,
            moves,
            (0.5 * np.log(low * high), 3.0 * width),
        )
    width = (high - low) / 3.3
    return Coordinate(
        effect.name,
        spec.name,
        value,
        spec.low,
        spec.high,
        width,
        False,
        moves,
        (0.5 * (low + high), 4.0 * width),
    )


def friction_coordinates(friction: Friction, force_scale: float) -> list[Coordinate]:
    """Coordinates of the eight parameters of equation (5)."""
    out = []
    for name in FRICTION_NAMES:
        value = getattr(friction, name)
        if "speed" in name:
            out.append(
                Coordinate(
                    "friction",
                    name,
                    float(np.clip(value, 1e-3, 0.1)),
                    5e-4,
                    0.3,
                    0.5,
                    True,
                    ("force",),
                    (float(np.log(0.01)), 1.0),
                )
            )
        elif "viscous" in name:
            out.append(Coordinate("friction", name, value, -1e6, 1e6, 10.0 * force_scale))
        else:
            out.append(Coordinate("friction", name, max(value, 0.0), 0.0, 1e6, force_scale))
    return out


@dataclass(frozen=True)
class Point:
    """A parameter vector made into objects."""

    friction: Friction
    edge: Edge
    effects: tuple[Active, ...]
    zero_n: float = 0.0
    """Of the sensors together, as a force downwards; see base_models.ZERO."""

    def model(self, base: LegModel) -> LegModel:
        """The base model with this friction and zero, and no effect of these."""
        changes: dict[str, Any] = {"friction": self.friction}
        if self.zero_n != 0.0:
            changes["force_offset_n"] = base.force_offset_n + self.zero_n
        return base.model_copy(update=changes)


def point(coordinates: Sequence[Coordinate], theta: Array, fixed: Point) -> Point:
    """The objects at a parameter vector (fitted units); what is not fitted comes from `fixed`."""
    friction, zero = dict(fixed.friction), fixed.zero_n
    edge = {
        "gain": fixed.edge.gain,
        "smooth_pa": fixed.edge.smooth_pa,
        "share_b": fixed.edge.share_b,
    }
    values: dict[str, dict[str, float]] = {a.effect.name: dict(a.values) for a in fixed.effects}
    for c, t in zip(coordinates, theta, strict=True):
        number = float(np.exp(t)) if c.log else float(t)
        number = min(max(number, c.low), c.high)
        if c.owner == "friction":
            friction[c.name] = number
        elif c.owner == "nuisance":
            edge[c.name] = number
        elif c.owner == "zero":
            zero = number
        else:
            values.setdefault(c.owner, {})[c.name] = number
    effects = tuple(Active(e := by_name(name), e.complete(v)) for name, v in values.items())
    return Point(Friction.model_construct(**friction), Edge(**edge), effects, zero)


def start_vector(coordinates: Sequence[Coordinate]) -> Array:
    """The start in fitted units."""
    starts = [min(max(c.start, c.low), c.high) for c in coordinates]
    return np.array(
        [np.log(x) if c.log else x for c, x in zip(coordinates, starts, strict=True)],
        dtype=np.float64,
    )
