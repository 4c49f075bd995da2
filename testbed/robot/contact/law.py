"""Compiled: the force of one elastic foot that never pulls and whose friction is bounded, in
contact axes.

Contact axes are (normal, two tangents). With compliance C (3 x 3) and strain u the force minimises
1/2 f.C f - f.u over f_n >= 0, |f_t| <= bound. If the foot touches, the normal is eliminated,

    (C_tt - C_tn C_nt / C_nn + g) f_t = u_t - C_tn u_n / C_nn,

with g = 0 where it sticks and g > 0 so that |f_t| = bound where it slides.
"""

from __future__ import annotations

import numpy as np

from testbed.compiled import njit
from testbed.formats.arrays import Array

NORMAL, FIRST, SECOND = 0, 1, 2
"""Contact axes: rows and columns of a compliance (3, 3), places in a strain or a force (3)."""
NEWTON_STEPS, NEWTON_SHARE = 50, 1e-13
"""Newton's steps end when one is smaller than this share of what it goes to."""


@njit
def _solved(
    first: float, mixed: float, second: float, one: float, other: float
) -> tuple[float, float]:
    """The solution (x, y) of first x + mixed y = one, mixed x + second y = other."""
    determinant = first * second - mixed * mixed
    return (
        (second * one - mixed * other) / determinant,
        (first * other - mixed * one) / determinant,
    )


@njit
def _slide_multiplier(compliance: Array, strain: Array, bound: float) -> float:
    """The g >= 0 for which |(compliance + g)^-1 strain| = bound (2 x 2, positive definite), by
    Newton from below.
    """
    first, mixed, second = compliance[0, 0], compliance[0, 1], compliance[1, 1]
    g = 0.0
    for _ in range(NEWTON_STEPS):
        force_x, force_y = _solved(first + g, mixed, second + g, strain[0], strain[1])
        size = np.sqrt(force_x * force_x + force_y * force_y)
        # minus the change of the force with g
        fall_x, fall_y = _solved(first + g, mixed, second + g, force_x, force_y)
        # Newton on 1 / size, nearly linear in g, concave: it approaches the root from below without
        # overshoot.
        step = (size / bound - 1.0) * size * size / (force_x * fall_x + force_y * fall_y)
        g += step
        if step <= NEWTON_SHARE * g:
            break
    return g


@njit
def _tangential(
    compliance: Array, strain: Array, bound: float, force: Array, slope: Array, pull: Array
) -> bool:
    """Fill the tangential force (2,), its slope by strain (2, 2) and by the bound (2,); true if the
    foot slides.
    """
    if bound <= 0.0:
        for row in range(2):
            force[row] = pull[row] = slope[row, 0] = slope[row, 1] = 0.0
        return True
    first, mixed, second = compliance[0, 0], compliance[0, 1], compliance[1, 1]
    stuck_x, stuck_y = _solved(first, mixed, second, strain[0], strain[1])
    slides = bool(stuck_x * stuck_x + stuck_y * stuck_y > bound * bound)
    g = _slide_multiplier(compliance, strain, bound) if slides else 0.0
    first, second = first + g, second + g
    determinant = first * second - mixed * mixed
    slope[0, 0], slope[1, 1] = second / determinant, first / determinant
    slope[0, 1] = slope[1, 0] = -mixed / determinant
    force[0] = slope[0, 0] * strain[0] + slope[0, 1] * strain[1]
    force[1] = slope[1, 0] * strain[0] + slope[1, 1] * strain[1]
    pull[0] = pull[1] = 0.0
    if slides:
        _keep_size(force, slope, bound, pull)
    return slides


@njit
def _keep_size(force: Array, slope: Array, bound: float, pull: Array) -> None:
    """Of a foot that slides: take from the slope (2, 2) what would change the size of the force
    (2,), which is the bound, and fill the force's change with the bound (2,).
    """
    fall_x = slope[0, 0] * force[0] + slope[0, 1] * force[1]
    fall_y = slope[1, 0] * force[0] + slope[1, 1] * force[1]
    size = fall_x * force[0] + fall_y * force[1]
    slope[0, 0] -= fall_x * fall_x / size
    slope[0, 1] -= fall_x * fall_y / size
    slope[1, 0] -= fall_x * fall_y / size
    slope[1, 1] -= fall_y * fall_y / size
    pull[0], pull[1] = fall_x * bound / size, fall_y * bound / size


@njit
def foot_reaction(
    compliance: Array, strain: Array, bound: float, friction: float, force: Array, slope: Array
) -> tuple[bool, bool]:
    """Force of one foot and its slope by the strain, in contact axes (normal, two tangents);
    (touches, slides).

    The friction bound N is held fixed in the force; with friction > 0 the slope lets it follow the
    normal force.
    """
    own = compliance[NORMAL, NORMAL]
    with_first, with_second = compliance[FIRST, NORMAL], compliance[SECOND, NORMAL]
    reduced, pushed = np.empty((2, 2)), np.empty(2)
    tangential, by_strain, by_bound = np.empty(2), np.empty((2, 2)), np.empty(2)
    reduced[0, 0] = compliance[FIRST, FIRST] - with_first * with_first / own
    reduced[1, 1] = compliance[SECOND, SECOND] - with_second * with_second / own
    reduced[0, 1] = reduced[1, 0] = compliance[FIRST, SECOND] - with_first * with_second / own
    pushed[0] = strain[FIRST] - with_first * strain[NORMAL] / own
    pushed[1] = strain[SECOND] - with_second * strain[NORMAL] / own
    slides = _tangential(reduced, pushed, bound, tangential, by_strain, by_bound)
    normal = (strain[NORMAL] - with_first * tangential[0] - with_second * tangential[1]) / own
    if normal <= 0.0:
        return False, _without_normal(compliance, strain, bound, force, slope)
    force[NORMAL], force[FIRST], force[SECOND] = normal, tangential[0], tangential[1]
    gain = 1.0 / (own + friction * (with_first * by_bound[0] + with_second * by_bound[1]))
    for axis in range(3):
        # changes with the strain along this axis: of what pushes the tangents, of the force
        pushed_x = -with_first / own if axis == NORMAL else (1.0 if axis == FIRST else 0.0)
        pushed_y = -with_second / own if axis == NORMAL else (1.0 if axis == SECOND else 0.0)
        first = by_strain[0, 0] * pushed_x + by_strain[0, 1] * pushed_y
        second = by_strain[1, 0] * pushed_x + by_strain[1, 1] * pushed_y
        along = 1.0 if axis == NORMAL else 0.0
        change = gain * (along - with_first * first - with_second * second)
        slope[NORMAL, axis] = change
        slope[FIRST, axis] = first + friction * by_bound[0] * change
        slope[SECOND, axis] = second + friction * by_bound[1] * change
    return True, slides


@njit
def _without_normal(
    compliance: Array, strain: Array, bound: float, force: Array, slope: Array
) -> bool:
    """Fill force (3) and slope (3, 3) of a foot that does not touch; true where friction's bound,
    which may be left of an earlier load, is reached.
    """
    pushed, reduced = np.empty(2), np.empty((2, 2))
    tangential, by_strain, by_bound = np.empty(2), np.empty((2, 2)), np.empty(2)
    for row in range(2):
        pushed[row] = strain[FIRST + row]
        for column in range(2):
            reduced[row, column] = compliance[FIRST + row, FIRST + column]
    slides = _tangential(reduced, pushed, bound, tangential, by_strain, by_bound)
    force[NORMAL], force[FIRST], force[SECOND] = 0.0, tangential[0], tangential[1]
    for row in range(3):
        for column in range(3):
            slope[row, column] = 0.0
            if row >= FIRST and column >= FIRST:
                slope[row, column] = by_strain[row - FIRST, column - FIRST]
    return slides
