"""Compiled: a rigid body on elastic, unilateral feet with Coulomb friction, in equilibrium with a
given wrench.

Unknown is the body's small displacement d = (translation t, rotation r) about a point, best the
centre of mass. A foot at p with compliance C (3, 3) and free height h along the ground's normal n
is deformed by u = h n - (t + r x p); its force f is the one that minimises the complementary energy
1/2 f.C f - f.u over the forces a foot can have: f.n >= 0 (it never pulls) and |f tangential| <=
friction * f.n. Equilibrium: sum of the feet's wrenches + load = 0.

For given friction bounds this is one convex problem in six variables, solved by Newton's method
with a line search (each foot: release what pulls, let slide what slides, in closed form); the
bounds then follow the normal loads until they agree (Coulomb: sliding does not lift a foot, unlike
the associated cone). A soft spring SUPPORT on the body makes the problem solvable when the feet
cannot balance the load: what it carries is the missing wrench, the least possible for the normal
loads found.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from testbed.compiled import njit
from testbed.formats.arrays import Array, Flags
from testbed.robot.contact.law import foot_reaction

SHORTEST_STEP = 1e-6
"""Share of a Newton step below which the line search gives up."""

MOST_STEPS = 60
"""Newton steps for one set of friction bounds."""
SUPPORT = 0.1
"""Stiffness of the body's soft support, N/m and N m/rad: 1e-8 of a foot's; carries 1e-3 N where the
feet balance.
"""


class Feet(NamedTuple):
    """What the feet are, n of them; in contact axes (normal, two tangents)."""

    maps: Array
    """Wrench of a unit force along each axis, (n, 6, 3)."""
    compliances: Array
    """(n, 3, 3), m/N."""
    heights: Array
    """Free heights along the normal, (n,), m."""
    active: Flags
    """Feet that may touch, (n,)."""


class Balance(NamedTuple):
    """What a body displacement gives, filled in place."""

    forces: Array
    """(n, 3) in contact axes, N."""
    slopes: Array
    """Change of a foot's force by its strain, (n, 3, 3), N/m."""
    touches: Flags
    slides: Flags
    residual: Array
    """Wrench that is out of balance, (6,)."""
    stiffness: Array
    """Change of the feet's wrench by the displacement, (6, 6)."""


@njit
def _evaluate(
    move: Array, load: Array, feet: Feet, bounds: Array, friction: Array, balance: Balance
) -> float:
    """Fill `balance` at a body displacement `move` (6,); returns the convex potential."""
    maps, compliances, heights, active = feet
    forces, slopes, touches, slides, residual, stiffness = balance
    strain = np.empty(3)
    potential = 0.0
    for index in range(6):
        residual[index] = load[index] - SUPPORT * move[index]
        potential += 0.5 * SUPPORT * move[index] ** 2 - load[index] * move[index]
    for j in range(6):
        for index in range(6):
            stiffness[j, index] = SUPPORT if j == index else 0.0
    for i in range(maps.shape[0]):
        if not active[i]:
            continue
        for axis in range(3):
            strain[axis] = heights[i] if axis == 0 else 0.0
            for index in range(6):
                strain[axis] -= maps[i, index, axis] * move[index]
        touches[i], slides[i] = foot_reaction(
            compliances[i], strain, bounds[i], friction[i], forces[i], slopes[i]
        )
        for axis in range(3):
            bent = 0.0
            for other in range(3):
                bent += compliances[i, axis, other] * forces[i, other]
            potential += forces[i, axis] * (strain[axis] - 0.5 * bent)
            for index in range(6):
                residual[index] += maps[i, index, axis] * forces[i, axis]
        _add_stiffness(maps[i], slopes[i], stiffness)
    return potential


@njit
def _size(vector: Array) -> float:
    total = 0.0
    for index in range(vector.shape[0]):
        total += vector[index] * vector[index]
    return float(np.sqrt(total))


@njit
def _add_stiffness(map_: Array, slope: Array, stiffness: Array) -> None:
    """Stiffness (6, 6) += map slope map^T."""
    for row in range(6):
        for axis in range(3):
            part = 0.0
            for other in range(3):
                part += map_[row, other] * slope[other, axis]
            for column in range(6):
                stiffness[row, column] += part * map_[column, axis]


@njit
def _newton_step(stiffness: Array, residual: Array, step: Array) -> None:
    """Solve stiffness step = residual (6 x 6, symmetric positive definite) by Cholesky, in place of
    `stiffness`.
    """
    for index in range(6):
        for j in range(index + 1):
            total = stiffness[index, j]
            for k in range(j):
                total -= stiffness[index, k] * stiffness[j, k]
            stiffness[index, j] = (
                np.sqrt(max(total, 1e-9)) if index == j else total / stiffness[j, j]
            )
    for index in range(6):
        total = residual[index]
        for k in range(index):
            total -= stiffness[index, k] * step[k]
        step[index] = total / stiffness[index, index]
    for index in range(5, -1, -1):
        total = step[index]
        for k in range(index + 1, 6):
            total -= stiffness[k, index] * step[k]
        step[index] = total / stiffness[index, index]


@njit
def _newton(
    move: Array, scale: float, load: Array, feet: Feet, bounds: Array, balance: Balance
) -> None:
    """Move the body to equilibrium for given friction bounds (fills `move`, `balance`)."""
    frozen, step, start = np.zeros(bounds.shape[0]), np.empty(6), np.empty(6)
    potential = _evaluate(move, load, feet, bounds, frozen, balance)
    for _ in range(MOST_STEPS):
        if _size(balance.residual) <= 1e-10 * scale + 1e-12:
            return
        _newton_step(balance.stiffness, balance.residual, step)
        gain, before, length = 0.0, potential, 1.0
        for index in range(6):
            gain += step[index] * balance.residual[index]
            start[index] = move[index]
        while length > SHORTEST_STEP:
            for index in range(6):
                move[index] = start[index] + length * step[index]
            potential = _evaluate(move, load, feet, bounds, frozen, balance)
            if potential <= before - 1e-4 * length * gain + 1e-12 * abs(before):
                break
            length *= 0.5
        if gain <= 1e-15 * abs(potential):
            return


@njit
def _inverse(matrix: Array) -> Array:
    """Inverse (6, 6) by elimination with pivoting."""
    n = matrix.shape[0]
    work, out = np.empty((n, n)), np.empty((n, n))
    for row in range(n):
        for index in range(n):
            work[row, index] = matrix[row, index]
            out[row, index] = 1.0 if row == index else 0.0
    for column in range(n):
        pivot = column
        for row in range(column + 1, n):
            if abs(work[row, column]) > abs(work[pivot, column]):
                pivot = row
        for index in range(n):
            work[column, index], work[pivot, index] = work[pivot, index], work[column, index]
            out[column, index], out[pivot, index] = out[pivot, index], out[column, index]
        head = work[column, column]
        for index in range(n):
            work[column, index] /= head
            out[column, index] /= head
        for row in range(n):
            factor = work[row, column]
            if row != column and factor != 0.0:
                for index in range(n):
                    work[row, index] -= factor * work[column, index]
                    out[row, index] -= factor * out[column, index]
    return out


@njit
def _sensitivities(
    maps: Array, slopes: Array, active: Flags, stiffness: Array
) -> tuple[Array, Array]:
    """Forces per free height (n, 3, n) N/m and per load wrench (n, 3, 6), contact axes, at the
    solution.
    """
    n = maps.shape[0]
    inverse = _inverse(stiffness)
    per_load, per_height, stiff = np.zeros((n, 3, 6)), np.zeros((n, 3, n)), np.zeros((3, 6))
    for index in range(n):
        if not active[index]:
            continue
        for axis in range(3):
            for k in range(6):
                stiff[axis, k] = -(
                    slopes[index, axis, 0] * maps[index, k, 0]
                    + slopes[index, axis, 1] * maps[index, k, 1]
                    + slopes[index, axis, 2] * maps[index, k, 2]
                )
        for axis in range(3):
            for column in range(6):
                for k in range(6):
                    per_load[index, axis, column] += stiff[axis, k] * inverse[k, column]
    for j in range(n):
        if not active[j]:
            continue
        for k in range(6):
            pushed = 0.0
            for axis in range(3):
                pushed += maps[j, k, axis] * slopes[j, axis, 0]
            for index in range(n):
                for axis in range(3):
                    per_height[index, axis, j] += per_load[index, axis, k] * pushed
        for axis in range(3):
            per_height[j, axis, j] += slopes[j, axis, 0]
    return per_height, per_load


@njit
def solve_contacts(load: Array, feet: Feet, friction: Array) -> tuple[Balance, Array, Array, Array]:
    """Feet in equilibrium with `load` (6,), force and moment about the point that `feet.maps` have,
    N and N m.

    friction (n,). Returns the balance found, the missing wrench (6,), forces per height (n, 3, n)
    N/m and per load wrench (n, 3, 6).
    """
    n = friction.shape[0]
    move = np.zeros(6)
    balance = Balance(
        np.zeros((n, 3)),
        np.zeros((n, 3, 3)),
        np.zeros(n, np.bool_),
        np.zeros(n, np.bool_),
        np.empty(6),
        np.empty((6, 6)),
    )
    scale = _size(load)
    bounds, missing = np.empty(n), np.empty(6)
    for index in range(n):
        bounds[index] = friction[index] * scale / n
    for _ in range(100):
        _newton(move, scale, load, feet, bounds, balance)
        if _settle(bounds, friction, feet.active, balance, scale):
            break
    _evaluate(move, load, feet, bounds, friction, balance)
    per_height, per_load = _sensitivities(feet.maps, balance.slopes, feet.active, balance.stiffness)
    for k in range(6):
        missing[k] = SUPPORT * move[k]
    return balance, missing, per_height, per_load


@njit
def _settle(bounds: Array, friction: Array, active: Flags, balance: Balance, scale: float) -> bool:
    """Set the friction bounds by the normal loads found; whether those that matter have not
    changed.
    """
    settled = True
    for index in range(bounds.shape[0]):
        # A bound matters where the foot slides, or would slide with the bound it ought to have.
        force = balance.forces[index]
        wanted, used = friction[index] * force[0], np.sqrt(force[1] ** 2 + force[2] ** 2)
        matters = active[index] and (balance.slides[index] or used > wanted)
        if matters and abs(wanted - bounds[index]) > 1e-9 * scale:
            settled = False
        bounds[index] = wanted
    return settled
