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


@njit
def _slide_multiplier(compliance: Array, strain: Array, bound: float) -> float:
    """The g >= 0 for which |(compliance + g)^-1 strain| = bound (2 x 2, positive definite), by
    Newton from below.
    """
    a, b, c = compliance[0, 0], compliance[0, 1], compliance[1, 1]
    g = 0.0
    for _ in range(50):
        det = (a + g) * (c + g) - b * b
        fx, fy = (
            ((c + g) * strain[0] - b * strain[1]) / det,
            ((a + g) * strain[1] - b * strain[0]) / det,
        )
        size = np.sqrt(fx * fx + fy * fy)
        mx, my = ((c + g) * fx - b * fy) / det, ((a + g) * fy - b * fx) / det
        # Newton on 1 / size, nearly linear in g, concave: it approaches the root from below without
        # overshoot.
        step = (size / bound - 1.0) * size * size / (fx * mx + fy * my)
        g += step
        if step <= 1e-13 * g:
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
    det = compliance[0, 0] * compliance[1, 1] - compliance[0, 1] ** 2
    x = (compliance[1, 1] * strain[0] - compliance[0, 1] * strain[1]) / det
    y = (compliance[0, 0] * strain[1] - compliance[0, 1] * strain[0]) / det
    slides = bool(x * x + y * y > bound * bound)
    g = _slide_multiplier(compliance, strain, bound) if slides else 0.0
    a, b, c = compliance[0, 0] + g, compliance[0, 1], compliance[1, 1] + g
    det = a * c - b * b
    slope[0, 0], slope[1, 1] = c / det, a / det
    slope[0, 1] = slope[1, 0] = -b / det
    force[0] = slope[0, 0] * strain[0] + slope[0, 1] * strain[1]
    force[1] = slope[1, 0] * strain[0] + slope[1, 1] * strain[1]
    pull[0] = pull[1] = 0.0
    if slides:
        mx = slope[0, 0] * force[0] + slope[0, 1] * force[1]
        my = slope[1, 0] * force[0] + slope[1, 1] * force[1]
        size = mx * force[0] + my * force[1]
        slope[0, 0] -= mx * mx / size
        slope[0, 1] -= mx * my / size
        slope[1, 0] -= mx * my / size
        slope[1, 1] -= my * my / size
        pull[0], pull[1] = mx * bound / size, my * bound / size
    return slides


@njit
def foot_reaction(
    compliance: Array, strain: Array, bound: float, friction: float, force: Array, slope: Array
) -> tuple[bool, bool]:
    """Force of one foot and its slope by the strain, in contact axes (normal, two tangents);
    (touches, slides).

    The friction bound N is held fixed in the force; with friction > 0 the slope lets it follow the
    normal force.
    """
    c0, c1, c2 = compliance[0, 0], compliance[1, 0], compliance[2, 0]
    reduced, pushed = np.empty((2, 2)), np.empty(2)
    tangential, by_strain, by_bound = np.empty(2), np.empty((2, 2)), np.empty(2)
    reduced[0, 0], reduced[1, 1] = compliance[1, 1] - c1 * c1 / c0, compliance[2, 2] - c2 * c2 / c0
    reduced[0, 1] = reduced[1, 0] = compliance[1, 2] - c1 * c2 / c0
    pushed[0], pushed[1] = strain[1] - c1 * strain[0] / c0, strain[2] - c2 * strain[0] / c0
    slides = _tangential(reduced, pushed, bound, tangential, by_strain, by_bound)
    normal = (strain[0] - c1 * tangential[0] - c2 * tangential[1]) / c0
    if normal <= 0.0:
        for row in range(2):
            pushed[row] = strain[row + 1]
            for column in range(2):
                reduced[row, column] = compliance[row + 1, column + 1]
        slides = _tangential(reduced, pushed, bound, tangential, by_strain, by_bound)
        force[0], force[1], force[2] = 0.0, tangential[0], tangential[1]
        for row in range(3):
            for column in range(3):
                slope[row, column] = (
                    by_strain[row - 1, column - 1] if row > 0 and column > 0 else 0.0
                )
        return False, slides
    force[0], force[1], force[2] = normal, tangential[0], tangential[1]
    gain = 1.0 / (c0 + friction * (c1 * by_bound[0] + c2 * by_bound[1]))
    for column in range(3):
        x = -c1 / c0 if column == 0 else (1.0 if column == 1 else 0.0)
        y = -c2 / c0 if column == 0 else (1.0 if column == 2 else 0.0)
        tx, ty = (
            by_strain[0, 0] * x + by_strain[0, 1] * y,
            by_strain[1, 0] * x + by_strain[1, 1] * y,
        )
        dn = gain * ((1.0 if column == 0 else 0.0) - c1 * tx - c2 * ty)
        slope[0, column] = dn
        slope[1, column] = tx + friction * by_bound[0] * dn
        slope[2, column] = ty + friction * by_bound[1] * dn
    return True, slides
