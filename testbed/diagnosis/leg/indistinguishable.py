"""What this data cannot tell apart: names, and declared numbers, whose forces and flows along these
motions are the same.

Two explanations are alike where what the one adds to the balances can be made by the other,
friction and the rest of the model giving way to both: their sensitivities are collinear once what
all models share is projected out.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from testbed.diagnosis.leg.fit import Fit, weights
from testbed.diagnosis.leg.points import DECLARED
from testbed.diagnosis.leg.problem import Array, Problem
from testbed.diagnosis.leg.search import Candidate, Search

COLLINEAR = 0.95
"""Correlation of what two explanations add to the balances from which they count as the same."""


def alike(state: Search, chosen: Candidate, name: str) -> tuple[str, ...]:
    """Names, and `declared.<number>`, that could stand in the place of one name of the chosen
    set.
    """
    problem, fit = state.problem, chosen.fit
    owners = {coordinate.owner for coordinate in fit.coordinates} - {name, DECLARED}
    shared = _columns(problem, fit, owners)
    added = _without(_columns(problem, fit, {name}), shared)

    def same(other: Array) -> bool:
        return _reach(added, _without(other, shared)) > COLLINEAR

    found = [f"{DECLARED}.{number}" for number in _numbers_for(problem, fit, name)]
    rest = frozenset(chosen.names) - {name}
    for names, rival in state.tried.items():
        others = names - rest
        if len(names) == len(chosen.names) and rest < names and len(others) == 1:
            (other,) = others
            if other != name and same(_columns(problem, rival.fit, {other})):
                found.append(other)
    return tuple(found)


def _numbers_for(problem: Problem, fit: Fit, name: str) -> list[str]:
    """Declared numbers any of which, within its bounds, makes what the first parameter of a name
    makes. Of a bore any force along the motion is a share: a whole piston less would make it.
    """
    owned = [(one.owner, one.name) for one in fit.coordinates]
    declared = [number for owner, number in owned if owner == DECLARED]
    size = next((place for place, (owner, _) in enumerate(owned) if owner == name), None)
    if size is None:
        return []
    shared = _columns(problem, fit, {owner for owner, _ in owned} - {name, DECLARED})
    first = fit.coordinates[size]
    times = (1.0 if first.log else float(fit.theta[size])) / first.scale
    made = _without(_columns(problem, fit, {name})[:, :1], shared) * times
    columns = _without(_columns(problem, fit, {DECLARED}), shared)
    out = []
    for place, number in enumerate(declared):
        index = owned.index((DECLARED, number))
        coordinate, column = fit.coordinates[index], columns[:, place : place + 1]
        needed = np.linalg.lstsq(column, made, rcond=None)[0].item() * coordinate.scale
        within = coordinate.low <= float(fit.theta[index]) + needed <= coordinate.high
        if within and _reach(made, column) > COLLINEAR:
            out.append(number)
    return out


def _columns(problem: Problem, fit: Fit, owners: Collection[str]) -> Array:
    """Weighted sensitivities of all balances to the coordinates of some owners, shape (bins, k)."""
    weight = weights(problem, fit.residual, fit.scale)
    chosen = [
        index for index, coordinate in enumerate(fit.coordinates) if coordinate.owner in owners
    ]
    unit = np.array([fit.coordinates[place].scale for place in chosen])
    rows = [
        fit.jacobian[channel][:, chosen] * unit * weight[channel][:, None]
        for channel in fit.residual
    ]
    return np.concatenate(rows)


def _without(columns: Array, shared: Array) -> Array:
    """The columns less what the shared ones can make of them."""
    if not shared.size:
        return columns
    return np.asarray(columns - shared @ np.linalg.lstsq(shared, columns, rcond=1e-8)[0])


def _reach(added: Array, other: Array) -> float:
    """Correlation, 0 to 1, between what is added (bins, k) and its best imitation by other columns
    (bins, m).
    """
    size = float(np.sum(added**2))
    if not other.size or size <= 0.0:
        return 0.0
    imitated = added - _without(added, other)
    return float(np.sqrt(np.sum(imitated**2) / size))
