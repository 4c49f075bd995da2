"""By how much stuck seals let go from one bin to the next, as the body's balances show it.

A seal at rest holds about the same force for minutes, and loses all of it in a tenth of a second
where a load comes or goes, or where one piston breaks away and the others take up what it held. Its
own pressures do not tell: a seal is stiffer than the oil beside it. The balances do: what they miss
jumps by what the seals let go.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot.balance import BODY_ROWS, BodyBalance

Array = npt.NDArray[np.float64]
MOST = 4.0
"""A seal that is pressed from one sense to the other lets go of twice its dry friction."""
HALVINGS = 25


def let_go(balance: BodyBalance, stuck_n: Array, noise: Array) -> Array:
    """(n,) variance of what every stuck seal lets go between the bin before and each bin or a
    neighbour of it, as a share of its dry friction squared: the one under which the jump of the
    body's six balances is about what is expected.

    `stuck_n` (n, 12): dry friction of the seals at rest, N, 0 of those that slide; `noise`
    (n, 6, 6): covariance of what the balances miss in one bin without letting go.
    """
    jump, by_seal, of_both, counted = _jumps(balance, stuck_n, noise)
    own = np.append(0.0, np.where(counted, likely_share(jump, by_seal, of_both), 0.0))
    padded = np.concatenate([own[:1], own, own[-1:]])
    return np.asarray(np.maximum(np.maximum(padded[:-2], padded[2:]), own))


def answers_n(balance: BodyBalance, stuck_n: Array, noise: Array) -> Array:
    """(n, 12) N, the likeliest friction by which stuck seals answer the jump of the body's balances
    between the bin before and each bin; arguments as of `let_go`. One piston that pushes, or a load
    that comes, presses all of them at once, each as far as it reaches.
    """
    jump, by_seal, of_both, counted = _jumps(balance, stuck_n, noise)
    whole = by_seal @ np.swapaxes(by_seal, 1, 2) + of_both
    needed = np.linalg.solve(whole, jump[:, :, None])[:, :, 0]
    answer = _held_beside(stuck_n) * np.einsum("mki,mk->mi", by_seal, needed)
    return np.vstack([np.zeros_like(stuck_n[:1]), np.where(counted[:, None], answer, 0.0)])


def _jumps(
    balance: BodyBalance, stuck_n: Array, noise: Array
) -> tuple[Array, Array, Array, npt.NDArray[np.bool_]]:
    """From each of n bins to the next: jumps of the body's balances (n - 1, 6), what they miss by
    the whole dry friction of every stuck seal (n - 1, 6, 12), covariance of jumps without letting
    go (n - 1, 6, 6), and whether both bins count (n - 1,).
    """
    jump = np.diff(balance.missing[:, :BODY_ROWS], axis=0)
    by_seal = balance.by_force[1:, :BODY_ROWS] * _held_beside(stuck_n)[:, None, :]
    counted = np.asarray(balance.counted[:, :BODY_ROWS].all(axis=1))
    return jump, by_seal, noise[1:] + noise[:-1], counted[1:] & counted[:-1]


def _held_beside(stuck_n: Array) -> Array:
    """(n - 1, 12) N, what seals may hold in either of two bins side by side."""
    return np.maximum(stuck_n[1:], stuck_n[:-1])


def likely_share(jump: Array, by_seal: Array, noise: Array) -> Array:
    """(m,) share s, 0 to MOST, at which jumps j (m, k) are as large as expected: j' (s B B' +
    N)^-1 j = k with B `by_seal` (m, k, 12) and N `noise` (m, k, k).
    """
    root = np.linalg.cholesky(noise)
    moved = np.linalg.solve(root, by_seal)
    variance, axes = np.linalg.eigh(moved @ np.swapaxes(moved, 1, 2))
    along = np.einsum("mkj,mk->mj", axes, np.linalg.solve(root, jump[:, :, None])[:, :, 0])
    low, high = np.zeros(len(jump)), np.full(len(jump), MOST)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        size = (along**2 / (1.0 + middle[:, None] * np.maximum(variance, 0.0))).sum(axis=1)
        larger = size > jump.shape[1]
        low, high = np.where(larger, middle, low), np.where(larger, high, middle)
    return np.where(high < MOST / 2 ** (HALVINGS - 1), 0.0, low)
