"""What a rig leaves undeclared or declares within a tolerance (mass, bore, rod, a zero), identified
with friction (5).

A number that is declared is a prior, not a free number: it may move by its tolerance (one standard
deviation), never by more than MOST of them, and moves at all only where that helps to predict
recordings that were set aside. What is declared as null, and the constant force of a sensor's zero,
is free.

All of it is linear for given Stribeck speeds. Asymmetric Coulomb friction cannot be told from a
constant force in motion, so the Coulomb part counts as equal both ways here. At nearly one speed
the viscous and Stribeck parts are a constant too and would take on what belongs to the zero: they
are fitted only where the speeds span a factor SPAN, and stay only if they help to predict
recordings that were set aside. A declared number has to earn its move beside them, one number
after the other: a back pressure that grows with the speed would else pass for another rod.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from testbed.estimation.cylinder import friction_terms
from testbed.estimation.friction.evidence import MINIMUM_ROWS, Evidence
from testbed.estimation.friction.posterior import (
    C_HIGH,
    C_LOW,
    correlation_inflation,
    huber_weights,
    scatter,
)
from testbed.formats.arrays import Array, Flags
from testbed.recording.known import Known

Folds = npt.NDArray[np.int64]
PARTS: dict[str, tuple[bool, bool, bool]] = {
    "coulomb": (False, True, False),
    "viscous": (True, True, False),
    "stribeck": (True, True, True),
}
"""Forms of (5), the simplest first: (viscous, Coulomb, Stribeck part)."""
SPAN = 3.0
WORTH, WORTH_MOVING = 0.98, 0.95
"""Shares to which a richer form, and a declared number that moves, have to lower the error on what
was set aside.
"""
MOST = 3.0
"""Tolerances by which a declared number may move at most: data that want more contradict the
declaration.
"""
ACCELERATES_M_S2 = 0.05
"""Standard deviation of the acceleration below which no mass shows by its inertia."""
WEIGHS_M_S2 = 1.0
"""Gravity along the axis from which on a mass shows by its weight."""
THICKEST = 0.95
"""Diameter of the thickest rod, as a share of the bore's (E)."""
ASYMMETRY = 0.25
"""Standard deviation of half the difference of Coulomb friction out and in, as its share (E)."""


@dataclass(frozen=True)
class Unknown:
    """One number that may differ from what is declared, and how the rows' force changes with it.

    `column` (m,): change of the force left over per unit. `width`: one tolerance, infinite where
    nothing is declared. `low`, `high`: least and largest change that leave a number that can be. A
    `bore_m` or `rod_m` changes as its area, m2. `per_m2` of a bore: share by which all forces grow
    with it; its column is then that of the force left over in the size that it has as declared.
    """

    name: str
    column: Array
    width: float = math.inf
    low: float = -math.inf
    high: float = math.inf
    per_m2: float = 0.0

    @property
    def bounds(self) -> tuple[float, float]:
        """Least and largest change."""
        return max(-MOST * self.width, self.low), min(MOST * self.width, self.high)


@dataclass(frozen=True)
class Used:
    """A number that identification changed or found: declared (None: null), used, and by how many
    tolerances apart.
    """

    name: str
    unit: str
    declared: float | None
    used: float
    tolerance: float | None = None
    tolerances_off: float | None = None
    at_bound: bool = False

    def __str__(self) -> str:
        if self.declared is None:
            return f"{self.name}: not declared, found {self.used:.5g} {self.unit}"
        text = f"{self.name}: declared {self.declared:.5g} {self.unit}, used {self.used:.5g}"
        text += f" ({self.tolerances_off:.1f} tolerances of {100 * (self.tolerance or 0.0):g} %)"
        return text + (": the data contradict the declared number" if self.at_bound else "")


@dataclass(frozen=True)
class DeclaredFit:
    """Numbers with what was found, the zero's force N, rows without either, form of friction, what
    was changed.
    """

    known: Known
    offset_n: float
    evidence: Evidence
    form: str
    used: tuple[Used, ...] = ()

    @property
    def constant_found(self) -> bool:
        """Whether a constant force (a zero, a weight) was found that nobody declares: beside it no
        motion shows how Coulomb friction out and in differ.
        """
        return any(number.declared is None for number in self.used)


def fit_declared(evidence: Evidence, known: Known, kind: str) -> DeclaredFit:
    """Fit friction together with what may differ from the declaration; as given where nothing
    may.
    """
    free, within = unknowns(evidence, known, kind)
    if not free and not within:
        return DeclaredFit(known, 0.0, evidence, "stribeck")
    form, chosen = _choose(evidence, free, within)
    found = fit(evidence, chosen, form, np.ones(len(evidence), dtype=np.bool_)).changes
    grown = 1.0 + sum(one.per_m2 * float(c) for one, c in zip(chosen, found, strict=True))
    found = found * np.array([1.0 if one.per_m2 else grown for one in chosen])
    rest, across = evidence.force_n, evidence.pressure_b_pa - evidence.pressure_a_pa
    for unknown, change in zip(chosen, found, strict=True):
        rest = rest - (across if unknown.per_m2 else unknown.column) * change
    changes = {unknown.name: float(c) for unknown, c in zip(chosen, found, strict=True)}
    offset = changes.pop("force_offset_n", 0.0)
    used = [_used(unknown, known, changes.get(unknown.name, 0.0)) for unknown in within]
    used += [_used(u, known, changes[u.name]) for u in free if u.name in changes]
    if kind != "vertical-leg":
        used.append(Used("force_offset_n", "N", None, offset))
    known = known.model_copy(update={u.name: u.used for u in used if u.name in Known.model_fields})
    return DeclaredFit(known, offset, replace(evidence, force_n=rest), form, tuple(used))


def unknowns(evidence: Evidence, known: Known, kind: str) -> tuple[list[Unknown], list[Unknown]]:
    """(what is not declared at all, what is declared within a tolerance). A leg on a bench counts
    as declared.
    """
    free: list[Unknown] = []
    within: list[Unknown] = []
    mass = known.moving_mass_kg
    # Benches and drives have a constant of their own, which takes a weight; a leg has none.
    weighs = kind == "vertical-leg" and abs(known.gravity_along_axis_m_s2) > WEIGHS_M_S2
    if np.std(evidence.acceleration_m_s2) > ACCELERATES_M_S2 or (mass is None and weighs):
        column = evidence.acceleration_m_s2 - known.gravity_along_axis_m_s2
        if mass is None:
            free.append(Unknown("moving_mass_kg", column, low=0.0))
        elif mass > 0.0 and kind != "vertical-leg":
            width = mass * known.tolerance("moving_mass_kg")
            within.append(Unknown("moving_mass_kg", column, width, -mass))
    if known.bore_m and known.rod_m is None and evidence.pressure_b_pa.any():
        # The rows have no rod: chamber B is as large as A there.
        most = THICKEST**2 * 0.25 * math.pi * known.bore_m**2
        free.append(Unknown("rod_m", -evidence.pressure_b_pa, low=0.0, high=most))
    if kind != "vertical-leg":
        free.append(Unknown("force_offset_n", -np.ones(len(evidence))))
    if kind == "cylinder":
        within.append(_bore(evidence, known))
        if evidence.pressure_b_pa.any() and known.rod_m:
            within.append(_area("rod_m", -evidence.pressure_b_pa, known))
    return free, within


def _bore(evidence: Evidence, known: Known) -> Unknown:
    """The bore, an area of both chambers, as what a larger one takes off the forces that are known,
    of a load cell, inertia and weight.

    With it all forces of the pressures grow, and with them friction and whatever the model misses.
    By the size of what is left in N the smallest piston would be the best; in the size that errors
    have as declared only the forces that are known speak for a bore.
    """
    area, rod = known.area_a_m2, known.area_a_m2 - known.area_b_m2
    in_a, in_b = evidence.pressure_a_pa, evidence.pressure_b_pa
    known_n = area * in_a - known.area_b_m2 * in_b - evidence.force_n
    column = (rod * in_b - known_n) / area
    return replace(_area("bore_m", column, known), per_m2=1.0 / area)


def _area(name: str, column: Array, known: Known) -> Unknown:
    area = 0.25 * math.pi * getattr(known, name) ** 2
    return Unknown(name, column, 2.0 * known.tolerance(name) * area, -0.9 * area)


def _used(unknown: Unknown, known: Known, change: float) -> Used:
    """What came of one number: areas as diameters again."""
    declared = getattr(known, unknown.name)
    of_area = unknown.name != "moving_mass_kg"
    if declared is None:
        found = max(change, 0.0)
        found = math.sqrt(4.0 / math.pi * found) if of_area else found
        return Used(unknown.name, "m" if of_area else "kg", None, found)
    used = math.sqrt(declared**2 + 4.0 / math.pi * change) if of_area else declared + change
    low, high = unknown.bounds
    return Used(
        unknown.name,
        "m" if of_area else "kg",
        declared,
        used,
        known.tolerance(unknown.name),
        abs(change) / unknown.width,
        not 0.999 * low < change < 0.999 * high,
    )


def _choose(
    evidence: Evidence, free: Sequence[Unknown], within: Sequence[Unknown]
) -> tuple[str, list[Unknown]]:
    """(form of friction, the unknown numbers): declared ones move one after the other, the most
    useful first, each only where no form does as well without.
    """
    chosen, rest = list(free), list(within)
    _, squares = choose_form(evidence, chosen)
    while rest:
        trials = [(choose_form(evidence, [*chosen, number])[1], number) for number in rest]
        left, number = min(trials, key=lambda trial: trial[0])
        if left >= WORTH_MOVING**2 * squares:
            break
        squares = left
        chosen.append(number)
        rest.remove(number)
    # Often one recording alone is slow: the others cannot say how its friction rises.
    return choose_form(evidence, chosen, _stretches(evidence))[0], chosen


QUARTERS = 4
ROUNDING = 1e-6
"""An error below this share of the forces is none."""


def choose_form(
    evidence: Evidence, unknown: Sequence[Unknown], folds: Folds | None = None
) -> tuple[str, float]:
    """(the simplest form that predicts what is set aside as well as any, its squared error, N2).

    `folds`: see held_out. "coulomb" at once where the speeds of one direction span too little to
    tell the parts of (5) apart.
    """
    forms = PARTS if _spans(evidence) else {"coulomb": PARTS["coulomb"]}
    rounding = ROUNDING**2 * float(np.sum(evidence.force_n**2))
    best, chosen = np.inf, "coulomb"
    for form in forms:
        squares = max(held_out(evidence, unknown, form, folds), rounding)
        if squares < WORTH**2 * best:
            best, chosen = squares, form
    return chosen, best


def _spans(evidence: Evidence) -> bool:
    """Whether the speeds of both directions span a factor SPAN."""
    for sign in (1.0, -1.0):
        speeds = sign * evidence.velocity_m_s[sign * evidence.velocity_m_s > 0.0]
        if speeds.size == 0 or np.quantile(speeds, 0.98) < SPAN * np.quantile(speeds, 0.02):
            return False
    return True


def _stretches(evidence: Evidence) -> Folds:
    """QUARTERS sets of rows, each with as many stretches of every recording."""
    place = [np.arange(rows) for rows in np.bincount(evidence.recording)]
    return np.concatenate([QUARTERS**2 * p // max(len(p), 1) % QUARTERS for p in place])


def _both_ways(velocity_m_s: Array) -> bool:
    return bool(min((velocity_m_s > 0.0).sum(), (velocity_m_s < 0.0).sum()) >= MINIMUM_ROWS // 4)


def held_out(
    evidence: Evidence, unknown: Sequence[Unknown], form: str, folds: Folds | None = None
) -> float:
    """Sum of squared errors, N2, on what was set aside in turn: the rows of each number in `folds`
    (m,), or else each recording, or quarters of the only one; stretches of all where the rest would
    go one way alone, in which a constant force is no other than friction.
    """
    groups = evidence.recording if folds is None else folds
    if len(np.unique(groups)) == 1:
        groups = np.arange(len(evidence)) * QUARTERS // len(evidence)
    if not all(_both_ways(evidence.velocity_m_s[groups != group]) for group in np.unique(groups)):
        groups = _stretches(evidence)
    squares = 0.0
    for group in np.unique(groups):
        aside = groups == group
        squares += float(np.sum(fit(evidence, unknown, form, ~aside).residual[aside] ** 2))
    return squares


@dataclass(frozen=True)
class Joint:
    """Changes (k,) of the unknown numbers, and the residual of every row (m,), N."""

    changes: Array
    residual: Array


def fit(evidence: Evidence, unknown: Sequence[Unknown], form: str, use: Flags) -> Joint:
    """The best robust joint fit on the rows `use` (m,); friction not negative, the unknown within
    their tolerances.
    """
    velocity, force = evidence.velocity_m_s, evidence.force_n
    viscous, _, stribeck = PARTS[form]
    plus = velocity > 0.0
    extra = (
        np.column_stack([one.column for one in unknown])
        if unknown
        else np.zeros((len(velocity), 0))
    )
    scale = np.maximum(np.abs(extra).max(axis=0), 1e-300)
    best: tuple[float, Joint] | None = None
    for stribeck_speed in np.geomspace(C_LOW, C_HIGH, 12) if stribeck else (C_LOW,):
        terms = np.sign(velocity)[:, None] * friction_terms(np.abs(velocity), stribeck_speed)
        columns = [terms[:, 1]]
        for kept, term in ((viscous, terms[:, 0]), (stribeck, terms[:, 2])):
            columns += [term * plus, term * ~plus] if kept else []
        friction = np.column_stack(columns)
        friction = friction / np.maximum(np.linalg.norm(friction[use], axis=0), 1e-300)
        first = friction.shape[1]
        widths = np.concatenate([np.full(first, np.inf), [one.width for one in unknown] * scale])
        low = np.concatenate([np.zeros(first), [one.bounds[0] for one in unknown] * scale])
        high = np.concatenate([np.full(first, np.inf), [one.bounds[1] for one in unknown] * scale])
        x = np.column_stack([friction, extra / scale])
        theta, cost = _robust(x[use], force[use], widths, (low, high))
        if best is None or cost < best[0]:
            best = (cost, Joint(theta[first:] / scale, force - x @ theta))
    assert best is not None
    return best[1]


def _robust(x: Array, y: Array, widths: Array, bounds: tuple[Array, Array]) -> tuple[Array, float]:
    """Bounded least squares with Huber weights and a Gaussian prior of zero mean: coefficients
    (k,), cost.

    A row counts as much as an independent one would: correlated residuals weigh less against the
    prior.
    """
    count = x.shape[1]
    free = np.full(count, np.inf)
    nowhere = (np.where(np.isfinite(widths), -np.inf, bounds[0]), free)
    # How far the rows scatter is read off a fit that no declaration holds back.
    theta, weight = _reweighted(x, y, free, nowhere, 0.0)
    residual = y - x @ theta
    variance = scatter(residual) ** 2 * correlation_inflation(residual * weight)
    theta, weight = _reweighted(x, y, widths, bounds, variance)
    residual = y - x @ theta
    penalty = variance * float(np.sum((theta / widths) ** 2))
    return theta, float(np.sum(weight * residual**2)) + penalty


def _reweighted(
    x: Array, y: Array, widths: Array, bounds: tuple[Array, Array], variance: float
) -> tuple[Array, Array]:
    """(coefficients (k,), Huber weights (m,)) of bounded least squares beside a prior, N2 the rows'
    variance.
    """
    from scipy.optimize import lsq_linear

    weight, theta = np.ones(len(y)), np.zeros(x.shape[1])
    prior = np.diag(np.sqrt(variance) / widths + 1e-12)
    for _ in range(4):
        root = np.sqrt(weight)
        rows = np.vstack([x * root[:, None], prior])
        right = np.concatenate([y * root, np.zeros(len(widths))])
        small: Array = np.asarray(np.linalg.qr(np.column_stack([rows, right]), mode="r"))
        theta = lsq_linear(small[:, :-1], small[:, -1], bounds, method="bvls").x
        residual = y - x @ theta
        weight = huber_weights(residual, scatter(residual))
    return theta, weight
