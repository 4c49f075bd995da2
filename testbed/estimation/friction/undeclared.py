"""What a rig leaves undeclared (mass, a zero's force, a nominal area), identified together with friction (5).

All of it is linear for given Stribeck speeds. Asymmetric Coulomb friction cannot be told from a constant force in
motion, so the Coulomb part counts as equal both ways here. At nearly one speed the viscous and Stribeck parts are a
constant too and would take on what belongs to the area or the zero: they are fitted only where the speeds span a
factor SPAN, and stay only if they help to predict recordings that were set aside.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from testbed.estimation.friction.evidence import Evidence
from testbed.estimation.friction.posterior import C_HIGH, C_LOW
from testbed.recording.known import Known

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

PARTS: dict[str, tuple[bool, bool, bool]] = {
    "coulomb": (False, True, False),
    "viscous": (True, True, False),
    "stribeck": (True, True, True),
}
"""Forms of (5), the simplest first: (viscous, Coulomb, Stribeck part)."""
SPAN = 5.0
WORTH = 0.98
"""A richer form has to lower the error on what was set aside to this share."""


def take_out(evidence: Evidence, known: Known, kind: str) -> tuple[Known, float, Evidence, str]:
    """(known with what was found, force offset N, rows without it, form of friction); as given if all is declared."""
    columns: dict[str, Array] = {}
    if known.moving_mass_kg is None and np.std(evidence.acceleration_m_s2) > 0.05:
        columns["mass"] = evidence.acceleration_m_s2 - known.gravity_along_axis_m_s2
    if kind != "vertical-leg":
        columns["offset"] = -np.ones(len(evidence))
    if kind == "cylinder":
        columns["area"] = -evidence.pressure_a_pa
    if not columns:
        return known, 0.0, evidence, "stribeck"
    extra = np.column_stack(list(columns.values()))
    form = choose_form(evidence, extra)
    theta = fit(evidence, extra, form, np.ones(len(evidence), dtype=np.bool_)).extra
    found = dict(zip(columns, theta, strict=True))
    changes: dict[str, float] = {}
    if "mass" in found:
        changes["moving_mass_kg"] = max(float(found["mass"]), 0.0)
    if "area" in found:
        changes["bore_m"] = math.sqrt(4.0 / math.pi * (known.area_a_m2 + float(found["area"])))
    rest = replace(evidence, force_n=evidence.force_n - extra @ theta)
    return known.model_copy(update=changes), float(found.get("offset", 0.0)), rest, form


def choose_form(evidence: Evidence, extra: Array) -> str:
    """The simplest form that predicts what is set aside as well as any: each recording, or quarters of the only one.

    "coulomb" at once where the speeds of one direction span too little to tell the parts of (5) apart.
    """
    for sign in (1.0, -1.0):
        speeds = sign * evidence.velocity_m_s[sign * evidence.velocity_m_s > 0.0]
        if speeds.size == 0 or np.quantile(speeds, 0.98) < SPAN * np.quantile(speeds, 0.02):
            return "coulomb"
    groups = evidence.recording
    if len(np.unique(groups)) == 1:
        groups = np.arange(len(evidence)) * 4 // len(evidence)
    best, chosen = np.inf, "coulomb"
    for form in PARTS:
        squares = 0.0
        for group in np.unique(groups):
            aside = groups == group
            squares += float(np.sum(fit(evidence, extra, form, ~aside).residual[aside] ** 2))
        if squares < WORTH**2 * best:
            best, chosen = squares, form
    return chosen


@dataclass(frozen=True)
class Joint:
    """Coefficients (k,) of the extra columns, and the residual of every row (m,), N."""

    extra: Array
    residual: Array


def fit(evidence: Evidence, extra: Array, form: str, use: Mask) -> Joint:
    """The best robust joint fit on the rows `use` (m,); friction's coefficients not negative, those of `extra` free."""
    v, y = evidence.velocity_m_s, evidence.force_n
    viscous, _, stribeck = PARTS[form]
    plus, scale = v > 0.0, np.abs(extra).max(axis=0)
    best: tuple[float, Joint] | None = None
    for c in np.geomspace(C_LOW, C_HIGH, 12) if stribeck else (C_LOW,):
        bump = np.sign(v) * np.exp(-np.abs(v) / c)
        columns = [np.sign(v)]
        columns += [v * plus, v * ~plus] if viscous else []
        columns += [bump * plus, bump * ~plus] if stribeck else []
        friction = np.column_stack(columns)
        friction = friction / np.maximum(np.linalg.norm(friction[use], axis=0), 1e-300)
        x = np.column_stack([friction, extra / scale, -extra / scale])
        theta, cost = _robust(x[use], y[use])
        if best is None or cost < best[0]:
            f, k = friction.shape[1], extra.shape[1]
            coefficients = (theta[f : f + k] - theta[f + k :]) / scale
            best = (cost, Joint(coefficients, y - x @ theta))
    assert best is not None
    return best[1]


def _robust(x: Array, y: Array) -> tuple[Array, float]:
    """Not-negative least squares with Huber weights (2.5 sigma): coefficients, cost."""
    from scipy.optimize import nnls

    weight = np.ones(len(y))
    theta, residual = np.zeros(x.shape[1]), y
    for _ in range(4):
        root = np.sqrt(weight)
        theta = nnls(x * root[:, None], y * root)[0]
        residual = y - x @ theta
        spread = max(1.4826 * float(np.median(np.abs(residual))), 1e-9)
        weight = np.minimum(1.0, 2.5 * spread / np.maximum(np.abs(residual), 1e-12))
    return theta, float(np.sum(weight * residual**2))
