"""Parts of a recording that take turns, and what one of them alone could show of an effect.

What a model is wrong about often lies in one stretch, and may have the shape there that an effect
has. An effect that is there all the time has it in every part, with the same numbers. So beside
"the effect" stands "its shape in part k, and nothing in the others", whatever its numbers: its
signature with zeros in the rows of the other parts, divided by the noise of all of them. Noise that
lasts tells the two apart where it hides what lasts: what a sound machine may differ by does not
come and go with a part.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_triangular

from testbed.diagnosis.robot.evidence import PIECE_S
from testbed.diagnosis.robot.groups import Balances
from testbed.formats.arrays import Array, Flags

PARTS = 4
"""Of so many parts of a recording each must be predicted from the others; they take turns, piece by
piece, so that each of them has a bit of all that moved.
"""


def parts_of(time_s: Array) -> npt.NDArray[np.intp]:
    """Which part of the recording rows at these times (rows,) are in."""
    return np.asarray((time_s - time_s.min()) // PIECE_S % PARTS, dtype=np.intp)


def log_evidence(whole: Array, gradient: Array) -> float:
    """Ln of a Bayes factor by information with that of the prior (k, k), and gradient (k,)."""
    found = float(gradient @ np.linalg.solve(whole, gradient))
    return 0.5 * found - 0.5 * float(np.linalg.slogdet(whole)[1])


class Alone:
    """What effects explain with their shapes in one part of a recording alone."""

    def __init__(self, balances: Balances, width: Mapping[str, Array]) -> None:
        self._balances = balances
        self._width = width
        """Effect at its place -> (r,) prior standard deviations of its numbers."""
        self._roots: dict[str, Array] = {}
        self._kept: dict[str, dict[str, Array]] = {}

    def log_factors(self, name: str, others: tuple[str, ...], numbers: Flags) -> Array:
        """(PARTS,) ln of the evidence that the shape of an effect adds to these others, which are
        there all the time, where it is in one part alone; `numbers` (r,): which of its numbers are
        not held at 0.
        """
        size = int(numbers.sum())
        beside = sum(len(self._width[other]) for other in others)
        inside = np.eye(beside + PARTS * size)
        gradient = np.zeros(beside + PARTS * size)
        for key, group in self._balances.groups.items():
            shown = [np.zeros((len(group.missing), len(self._width[other]))) for other in others]
            for k, other in enumerate(others):
                if other in group.columns:
                    shown[k] = group.columns[other] * self._width[other]
            own = np.zeros((len(group.missing), PARTS * size))
            if name in group.columns:
                own = self._by_part(name)[key][:, np.tile(numbers, PARTS)]
            columns = np.hstack([*shown, own])
            inside += columns.T @ columns
            gradient += columns.T @ group.missing
        rest = np.arange(beside)
        nothing = log_evidence(inside[np.ix_(rest, rest)], gradient[rest])
        found = []
        for k in range(PARTS):
            index = np.concatenate([rest, beside + k * size + np.arange(size)])
            found.append(log_evidence(inside[np.ix_(index, index)], gradient[index]) - nothing)
        return np.array(found)

    def _by_part(self, name: str) -> dict[str, Array]:
        """Group -> (rows, PARTS r) an effect's signature, part by part, divided by the noise."""
        if name not in self._kept:
            changes = self._balances.candidates[name].signature.values()
            self._kept[name] = {}
            for key, group in self._balances.groups.items():
                if name in group.columns:
                    raw = self._balances.raw[key]
                    own = np.column_stack([raw.rows_of(c) for c in changes]) * self._width[name]
                    part = parts_of(raw.time_s)
                    apart = np.hstack([own * (part == k)[:, None] for k in range(PARTS)])
                    self._kept[name][key] = solve_triangular(self._root(key), apart, lower=True)
        return self._kept[name]

    def _root(self, key: str) -> Array:
        if key not in self._roots:
            self._roots[key] = self._balances.raw[key].root()
        return self._roots[key]
