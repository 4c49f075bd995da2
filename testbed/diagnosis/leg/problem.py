"""The residuals of one rig as a function of friction, nuisance and effect parameters, in bins and
groups.

A group is one channel (force, flow A, flow B, supply) of one recording; each group has its own
noise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.leg.plain_balance import (
    Balance,
    binned_columns,
    binned_error_n,
    is_plain,
    plain_rows,
)
from testbed.diagnosis.leg.series import BIN, Series
from testbed.effects.active import Active
from testbed.effects.terms import ForceResidual, Observed, Signals
from testbed.estimation.leg.balance import (
    acting,
    corrected,
    external_n,
    force_terms,
    friction_n,
    without_friction_n,
)
from testbed.estimation.leg.flow import (
    EDGES,
    Edges,
    edge_slopes,
    flow_balance,
    flow_terms,
    followed,
)
from testbed.estimation.leg.force import narrow_band
from testbed.recording.leg_model import Friction, LegModel

Array = npt.NDArray[np.float64]


OPENINGS = 6
"""Openings of each recording that are kept."""


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


class Fitted(Protocol):
    """What a fit leaves: residuals and noise, channel by channel."""

    @property
    def residual(self) -> dict[str, Array]:
        """Channel -> stacked bins."""
        ...

    @property
    def scale(self) -> dict[str, Array]:
        """Channel -> noise of each group."""
        ...


@dataclass(eq=False)
class Problem:
    """Residuals over some series for a base model and a set of effects."""

    series: tuple[Series, ...]
    base: LegModel
    with_flow: bool
    believed: tuple[Active, ...] = ()
    """Effects that the model has already: in every residual, and no hypotheses."""
    not_declared: tuple[str, ...] = ()
    """Numbers that the rig does not declare, which are fitted and no findings."""
    layout: dict[str, Layout] = field(default_factory=dict)
    _corrected: tuple[object, list[Signals]] | None = None
    _balanced: tuple[object, list[Balance]] | None = None
    _read: tuple[object, float] | None = None
    _opened: dict[tuple[str, float, float, float, float], tuple[Array, Array]] = field(
        default_factory=dict
    )

    @property
    def kind(self) -> str:
        """What the recordings are of: `vertical-leg`, `cylinder`, `drive` or `robot`."""
        return self.base.rig

    @property
    def sample_s(self) -> float:
        """Time between two samples of the slowest recording, s."""
        return 1.0 / min(one.full_rate_hz for one in self.series)

    @property
    def unsure(self) -> Mapping[str, float]:
        """Channel -> how uncertain its reference is, in its unit; a bench's is not."""
        return {}

    def observed(self, friction: Friction, fit: Fitted | None = None) -> Observed:
        """What the recordings show with this friction, as effects are asked about it; with `fit`
        what it leaves, too.
        """
        return Observed(
            kind=self.kind,
            known=self.base.known,
            friction=friction,
            signals=tuple(one.signals for one in self.series),
            reference_n=tuple(one.reference_n for one in self.series),
            residual=() if fit is None else self._left(fit),
        )

    def _left(self, fit: Fitted) -> tuple[ForceResidual, ...]:
        """What a fit leaves of the force balance, recording by recording."""
        layout, out, first = self.layout["force"], [], 0
        noise = fit.scale["force"][layout.group] * layout.relative
        for one in self.series:
            rows = slice(first, first + one.bins)
            first += one.bins
            out.append(
                ForceResidual(
                    values_n=fit.residual["force"][rows],
                    counted=layout.count[rows] > 0,
                    noise_n=noise[rows],
                    bin_s=BIN / one.signals.rate_hz,
                    smoothing_s=one.width_s,
                )
            )
        return tuple(out)

    def channels(self) -> tuple[str, ...]:
        """The channels that this rig has."""
        if not self.with_flow:
            return ("force",)
        supply = all(one.signals.supply_pressure_pa is not None for one in self.series)
        return ("force", "flow", "supply") if supply else ("force", "flow")

    def force(self, model: LegModel, effects: Sequence[Active]) -> Array:
        """Stacked binned force residuals (estimate - reference), N, in the size that errors of the
        pressures have as declared; see `as_read`.
        """
        rows = zip(self.series, self._balances(model, effects), strict=True)
        residuals = [_force_one(one, balance, model.friction) for one, balance in rows]
        return self.as_read(model, effects) * np.concatenate(residuals)

    def as_read(self, model: LegModel, effects: Sequence[Active]) -> float:
        """The force that small errors of a bench's pressures make as declared, over the one that
        they make with this bore, this rod and these gains, where that is more than 1.

        A smaller piston, or sensors that read too much, make less of every force, of all that the
        model misses as well: where nothing but a mass says how large forces are, a residual in N
        would fall as both shrink, though nothing is explained. A larger one makes less of nothing:
        what a position's noise makes of the mass stays.
        """
        if self.kind != "cylinder":
            return 1.0
        key = (model.known.bore_m, model.known.rod_m, *_of_sensors(effects))
        if self._read is None or self._read[0] != key:
            declared, used = self.base.known, model.known
            slopes = _slopes(self.series, self._signals(effects), effects)
            before = np.hypot(declared.area_a_m2, declared.area_b_m2 * (slopes[1] > 0.0))
            now = np.hypot(used.area_a_m2 * slopes[0], used.area_b_m2 * slopes[1])
            self._read = (key, _not_less(float(before / now)) if now > 0.0 else 1.0)
        return self._read[1]

    def frictions_n(self, model: LegModel, effects: Sequence[Active]) -> list[Array]:
        """Friction of every series, N, shape (n,), without the part that needs the load."""
        balances = self._balances(model, effects)
        return [friction_n(model.friction, signals, terms) for signals, terms, _ in balances]

    def straight_columns(self, model: LegModel, effects: Sequence[Active]) -> Array | None:
        """d(force residual) / d(`points.STRAIGHT`), shape (bins, 6): friction's levels and viscous
        numbers enter straight.

        None where they do not: the friction has a memory, or bends with the load, or a band is
        taken out.
        """
        parts = []
        for one, balance in zip(self.series, self._balances(model, effects), strict=True):
            if not is_plain(balance[1]):
                return None
            parts.append(binned_columns(plain_rows(one, balance, model.friction), BIN))
        return self.as_read(model, effects) * np.concatenate(parts)

    def _balances(self, model: LegModel, effects: Sequence[Active]) -> list[Balance]:
        """The balance without friction of every series; kept while only friction is varied."""
        key = (
            id(self.base),
            model.known.bore_m,
            model.known.rod_m,
            model.known.moving_mass_kg,
            model.force_offset_n,
            model.force_held_s,
            [(effect.effect.name, dict(effect.values)) for effect in effects],
        )
        if self._balanced is None or self._balanced[0] != key:
            found = []
            for signals in self._signals(effects, model.force_held_s):
                if model.known is not self.base.known:  # declared numbers within their tolerance
                    signals = signals.with_(known=model.known)
                terms = force_terms(model, signals, effects)
                found.append((signals, terms, without_friction_n(signals, terms)))
            self._balanced = (key, found)
        return self._balanced[1]

    def _signals(self, effects: Sequence[Active], held_s: float = 0.0) -> list[Signals]:
        """Corrected signals of every series, a drive's force as it acts; the last correction is
        kept, as most parameters leave sensors alone.
        """
        sensors = [effect for effect in effects if effect.effect.overrides("correct")]
        key = (held_s, *_of_sensors(effects))
        if self._corrected is None or self._corrected[0] != key:
            read = (acting(one.signals, held_s) for one in self.series)
            self._corrected = (key, [corrected(signals, sensors) for signals in read])
        return self._corrected[1]

    def flow(self, model: LegModel, effects: Sequence[Active], edges: Edges) -> dict[str, Array]:
        """Stacked binned flow residuals of A and B (m3/s), concatenated, and of the supply (Pa)."""
        parts: dict[str, list[Array]] = {"flow": [], "supply": []}
        for one, signals in zip(self.series, self._signals(effects), strict=True):
            terms = flow_terms(signals, effects)
            open_, late = self._openings(one, terms.deadband, edges)
            balance = flow_balance(signals, terms, open_, edges, late)
            parts["flow"] += [
                one.binned(balance.a_m3_s, one.clear)[0],
                one.binned(balance.b_m3_s, one.clear)[0],
            ]
            if balance.supply_pa is not None:
                parts["supply"].append(one.binned(balance.supply_pa, one.clear)[0])
        return {name: np.concatenate(values) for name, values in parts.items() if values}

    def edge_columns(self, effects: Sequence[Active], edges: Edges) -> Mapping[str, Array] | None:
        """Edge -> d(flow residual) / d(its gain), shape (bins,), and `gain` for all four together.

        None where the supply gives way to what the edges draw: they do not enter straight there.
        """
        parts: dict[str, list[Array]] = {edge: [] for edge in EDGES}
        for one, signals in zip(self.series, self._signals(effects), strict=True):
            terms = flow_terms(signals, effects)
            if terms.droop_pa_s_m3 > 0.0:
                return None
            open_, late = self._openings(one, terms.deadband, edges)
            for edge, slopes in edge_slopes(signals, terms, open_, edges, late).items():
                parts[edge] += [one.binned(slope, one.clear)[0] for slope in slopes]
        out = {edge: np.concatenate(columns) for edge, columns in parts.items()}
        all_four = sum(getattr(edges, edge) * column for edge, column in out.items())
        return out | {"gain": np.asarray(all_four) / edges.gain}

    def _openings(self, one: Series, deadband: float, edges: Edges) -> tuple[Array, Array]:
        """A recording's opening as its command says, and as late as the edges follow; the last few
        are kept.
        """
        laps = edges.lap_out, edges.lap_in
        key = (one.name, deadband, edges.late_s, *laps)
        if key not in self._opened:
            declared = deadband == one.signals.known.valve_deadband and not any(laps)
            open_ = one.opening if declared else one.opening_for(deadband, laps)
            assert open_ is not None
            if len(self._opened) >= OPENINGS * len(self.series):
                del self._opened[next(iter(self._opened))]
            self._opened[key] = open_, followed(open_, edges.late_s, one.signals.rate_hz)
        return self._opened[key]

    def __post_init__(self) -> None:
        self.layout = {channel: self._layout(channel) for channel in self.channels()}

    def _layout(self, channel: str) -> Layout:
        names: list[tuple[str, str]] = []
        group: list[npt.NDArray[np.int64]] = []
        block: list[npt.NDArray[np.int64]] = []
        count: list[Array] = []
        noise: list[Array] = []
        for one in self.series:
            mask = one.trusted & one.clear if channel == "force" else one.clear
            used = one.binned(np.zeros(len(mask)), mask)[1]
            moving = one.binned(np.zeros(len(mask)), one.trusted)[1] > 0
            for part in ("flow_a", "flow_b") if channel == "flow" else (channel,):
                here = np.full(one.bins, len(names), dtype=np.int64)
                names.append((part, one.name))
                if channel == "flow":
                    here[~moving] += 1
                    names.append((part + "_rest", one.name))
                group.append(here)
                block.append(one.block)
                count.append(used)
                noise.append(
                    one.encoder_noise_n() if channel == "force" else one.encoder_noise_m3_s()
                )
        groups = np.concatenate(group)
        counts, flat = (
            np.concatenate(count),
            np.concatenate(noise) if channel != "supply" else np.zeros(len(groups)),
        )
        relative = np.ones(len(groups))
        for number in range(len(names)):
            here = (groups == number) & (counts > 0)
            mean = float(np.mean(flat[here] ** 2)) if here.any() else 0.0
            if mean > 0.0:
                relative[here] = np.sqrt(0.3 + 0.7 * flat[here] ** 2 / mean)
        return Layout((channel,), groups, np.concatenate(block), counts, relative, tuple(names))


def _of_sensors(effects: Sequence[Active]) -> list[tuple[str, dict[str, float]]]:
    """The effects that correct what sensors read, with their numbers."""
    sensors = [effect for effect in effects if effect.effect.overrides("correct")]
    return [(sensor.effect.name, dict(sensor.values)) for sensor in sensors]


ROUNDED = 0.005
"""Width of the corner at 1 of `_not_less`: a fit steps over it."""


def _not_less(ratio: float) -> float:
    """A ratio above 1, and 1 below it, with a round corner through (1, 1)."""
    rise = float(np.logaddexp(0.0, (ratio - 1.0) / ROUNDED) - np.log(2.0))
    return 1.0 + ROUNDED * rise


SMALL_PA = 1e3
"""An error of a pressure by which the slope of its correction is reckoned."""


def _slopes(
    series: Sequence[Series], read: Sequence[Signals], effects: Sequence[Active]
) -> tuple[float, float]:
    """By how much the corrected pressures of A and B change with what their sensors read, root mean
    square of all samples; 0 of a chamber that is not recorded. `read`: corrected signals.
    """
    sensors = [effect for effect in effects if effect.effect.overrides("correct")]
    squares: dict[str, list[Array]] = {"pressure_a_pa": [], "pressure_b_pa": []}
    for one, now in zip(series, read, strict=True):
        off = {name: getattr(one.signals, name) for name in squares}
        moved = {name: value + SMALL_PA for name, value in off.items() if value is not None}
        then = corrected(one.signals.with_(**moved), sensors)
        for name in moved:
            change = getattr(then, name) - getattr(now, name)
            squares[name].append((change / SMALL_PA) ** 2)
    a, b = (float(np.sqrt(np.mean(np.concatenate(v)))) if v else 0.0 for v in squares.values())
    return a, b


def _force_one(series: Series, balance: Balance, friction: Friction) -> Array:
    """Binned force residual of one series, N."""
    signals, terms, total = balance
    mask = series.trusted & series.clear
    if is_plain(terms):
        return np.asarray(binned_error_n(plain_rows(series, balance, friction), BIN))
    value = external_n(
        total - friction_n(friction, signals, terms), np.sign(signals.velocity_m_s), terms
    )
    error = value - (series.reference_n if series.reference_n is not None else 0.0)
    for frequency, amplitude, harmonics in terms.narrow_bands:
        error = error - narrow_band(error, mask, signals, frequency, harmonics, amplitude)
    return series.binned(error, mask)[0]
