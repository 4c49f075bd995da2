"""Evidence in a linear model with Gaussian noise: how much better a balance is explained with an
effect than without.

A group of balances (the body's, one cylinder's oil, the feet's places) is a vector y = X b + e, e ~
N(0, C). C holds the sensors' noise, friction that nobody knows, and everything that a sound machine
may differ by within its tolerances (their columns times their standard deviations). With a prior b
~ N(0, W) for an effect's numbers the evidence against "sound" has a closed form (Bayes factor of
two Gaussian models):

    ln B = g' (H + W^-1)^-1 g / 2 - ln det(I + W H) / 2,     g = X' C^-1 y,  H = X' C^-1 X

Sets of effects are as cheap: one factorisation of C serves them all.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_triangular

from testbed.effects.signature import Change, Signature
from testbed.formats.arrays import Flags

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Whitened:
    """A group of balances divided by its noise: `missing` (rows,) and columns (rows, k), both with
    unit covariance.
    """

    missing: Array
    columns: Mapping[str, Array]
    """Effect at its place -> (rows, its numbers)."""


def whiten(missing: Array, columns: Mapping[str, Array], root: Array) -> Whitened:
    """Divide by `root` (rows, rows), the lower Cholesky factor of the noise's covariance."""
    names = list(columns)
    whole = np.column_stack([missing, *(columns[name] for name in names)])
    white = solve_triangular(root, whole, lower=True)
    out, first = {}, 1
    for name in names:
        last = first + columns[name].shape[1]
        out[name] = white[:, first:last]
        first = last
    return Whitened(white[:, 0], out)


@dataclass(frozen=True, eq=False)
class RawGroup:
    """A group of balances in its own unit; rows of any order."""

    missing: Array
    """(rows,)"""
    time_s: Array
    """(rows,); rows further apart than PIECE_S can predict each other."""
    noise: Array
    """(rows, rows) covariance of what nobody knows in any machine; `lasting`: the part of it that
    lasts, which a recording cannot show to be smaller.
    """
    tolerated: Array
    """(rows, k) columns of what a sound machine may differ by, each one standard deviation; the
    same k numbers in every recording of it.
    """
    rows_of: Callable[[Change], Array]
    """A column of the group: what a change of the believed machine does to its rows."""
    lasting: Array | None = None
    unknown: tuple[npt.NDArray[np.intp], ...] = ()
    """Labels (rows,) each: rows of one label have a number in common that nobody can know; what is
    told of the group's errors is without it.
    """
    factor: Array | None = None
    """(rows, rows) `root`, where it has been found."""
    alike: Mapping[str, int] = field(default_factory=dict)
    """Numbers that other groups of the machine have as well -> their columns of `tolerated`."""
    changing: Mapping[int, float] = field(default_factory=dict)
    """Columns of `tolerated` whose number is another one in each recording of a machine -> by how
    many of its standard deviations it changes between two.
    """
    told: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Of those that others told something about: mean and standard deviation, instead of 0 and
    1.
    """
    of_first: int | None = None
    """Of several recordings together: so many rows are the first one's, and come before the
    others.
    """

    def factored(self) -> RawGroup:
        """The group with its `root` found, for all that only miss something else."""
        return replace(self, factor=self.root())

    def size(self, missing: Array, rows: npt.NDArray[np.bool_]) -> float:
        """RMS of what those of its rows miss, beside what nobody can know."""
        rest = missing.copy()
        for _ in range(ROUNDS if self.unknown else 0):
            for labels in self.unknown:
                _, at = np.unique(labels[rows], return_inverse=True)
                rest -= (np.bincount(at, rest) / np.bincount(at))[at]
        return float(np.sqrt(np.mean(rest**2)))

    def levelled(self, level: Array) -> RawGroup:
        """The group with the noise's variance times `level` (rows,), but for the part that
        lasts.
        """
        root, kept = np.sqrt(level), 0.0 if self.lasting is None else self.lasting
        noise = kept + root[:, None] * (self.noise - kept) * root
        return replace(self, noise=noise, factor=None)

    def about_what_is_told(self) -> RawGroup:
        """The group with its numbers about what is `told` of them."""
        mean, sd = self._prior()
        return replace(
            self,
            missing=self.missing - self.tolerated @ mean,
            tolerated=self.tolerated * sd,
            told={},
            factor=None,
        )

    def knowing(self, sound: RawGroup, recalled: float | None = None) -> RawGroup:
        """The group of a machine of which there is an earlier recording, when it was sound.

        That one shows how far the machine lies from its drawing: w ~ N(m, S), see
        `tolerances_shown`. So this one misses its own T m less, and S is all that its tolerances
        leave; beside the share `recalled` [RECALLED] of them, for another motion asks for them in
        another way than its linear model says.
        """
        mean, left = sound.tolerances_shown()
        before = np.diag(sound._prior()[1] ** 2)
        known_to = left + (RECALLED if recalled is None else recalled) ** 2 * (before - left)
        for number, change in self.changing.items():
            known_to[number, number] += change**2
        return replace(
            self,
            missing=self.missing - self.tolerated @ mean,
            tolerated=self.tolerated @ np.linalg.cholesky(known_to),
            factor=None,
        )

    def tolerances_shown(self) -> tuple[Array, Array]:
        """Mean m (k,) and covariance S (k, k) of the machine's tolerances w by this recording of it
        and what is `told` of them: S^-1 = P^-1 + T' N^-1 T, m = S T' N^-1 (y - T p) + p of w ~
        N(p, P) and rows y = T w + e.

        Where one of them came out beyond NO_TOLERANCE the recording shows something else that
        looks like it: such a number takes up what it will there, and nothing is said of it. One of
        which others told something else may be either: what they told, or what it showed.
        """
        about, sd = self._prior()
        mean, left, gone = self._shown()
        value, covariance = about + sd * mean, sd[:, None] * left * sd
        told = np.zeros(len(value), dtype=bool)
        told[[self.alike[number] for number in self.told]] = True
        nearest = np.clip(value, -NO_TOLERANCE, NO_TOLERANCE)
        between = np.where(gone & told, 0.5 * (nearest - about), 0.0)
        apart = np.diag(np.where(gone, sd**2 + between**2, 0.0))
        kept = np.outer(~gone, ~gone)
        return np.where(gone, about + between, value), np.where(kept, covariance, apart)

    @property
    def not_recalled(self) -> int:
        """How many of its tolerances came out beyond NO_TOLERANCE."""
        return int(self._shown()[2].sum())

    def _shown(self) -> tuple[Array, Array, Flags]:
        """Mean (k,) and covariance (k, k) of its tolerances by its rows, in standard deviations of
        what is known before; (k,) which of them are let go.
        """
        about, sd = self._prior()
        root = np.asarray(np.linalg.cholesky(self.noise), dtype=np.float64)
        rows = self.missing - self.tolerated @ about
        white = whiten(rows, {"": self.tolerated * sd}, root)
        columns = white.columns[""]
        known, gradient = columns.T @ columns, columns.T @ white.missing
        gone = np.zeros(len(gradient), dtype=bool)
        while True:
            width = np.where(gone, LET_GO, 1.0)
            left: Array = np.linalg.inv(known + np.diag(width**-2)).astype(np.float64)
            mean = left @ gradient
            beyond = np.where(gone, 0.0, np.abs(mean))
            if beyond.max(initial=0.0) < NO_TOLERANCE:
                return mean, left, gone
            gone[np.argmax(beyond)] = True

    def _prior(self) -> tuple[Array, Array]:
        """Mean and standard deviation (k,) of its tolerances before anything is seen."""
        mean, sd = np.zeros(self.tolerated.shape[1]), np.ones(self.tolerated.shape[1])
        for number, (about, to) in self.told.items():
            mean[self.alike[number]], sd[self.alike[number]] = about, to
        return mean, sd

    def whitened(self, candidates: Mapping[str, Signature]) -> Whitened:
        """Divided by its noise; candidates that it does not show are left out."""
        columns = {}
        for name, signature in candidates.items():
            found = np.column_stack([self.rows_of(change) for change in signature.values()])
            if np.any(found):
                columns[name] = found
        return whiten(self.missing, columns, self.root())

    def root(self) -> Array:
        """(rows, rows) lower Cholesky factor of its covariance in sound machines."""
        if self.factor is not None:
            return self.factor
        whole = self.noise + self.tolerated @ self.tolerated.T
        return np.asarray(np.linalg.cholesky(whole), dtype=np.float64)

    def left_unpredicted(self, until_s: float, signatures: Sequence[Signature]) -> list[Array]:
        """What is missing after `until_s`, predicted from what is before by a sound machine's
        tolerances alone, and with these effects beside them (their numbers free).
        """
        learnt = self.time_s < until_s
        effects = [c for s in signatures for c in s.values()]
        free = [self.rows_of(change) for change in effects]
        out = []
        for more in ([], free):
            wide = np.column_stack([self.tolerated, *more])
            scale = np.ones(wide.shape[1])
            scale[self.tolerated.shape[1] :] = FREE
            wide = wide * scale
            inside = self.noise[np.ix_(learnt, learnt)] + wide[learnt] @ wide[learnt].T
            weights = wide[learnt].T @ np.linalg.solve(inside, self.missing[learnt])
            out.append(self.missing[~learnt] - wide[~learnt] @ weights)
        return out


NO_TOLERANCE = 2.5
"""No number of a machine lies so many standard deviations of its tolerance off: a uniform one ends
at 1.7, a triangular one at 2.4."""
LET_GO = 100.0
"""Standard deviations within which a number takes up what looks like it (E)."""
RECALLED = 0.2
"""What an earlier recording shows of a machine's tolerances holds in another one to this share of
them: the forces of 28 sound machines are likeliest by that (B).
"""
PIECE_S = 2.0
"""A recording is cut into pieces of this length, where one part of it is to predict another."""
ROUNDS = 30
"""Means of overlapping labels are taken out in turns, so many times."""
FREE = 1.0
