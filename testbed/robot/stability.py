"""How far a stance is from being lost: the push it can still take, and the work it takes to tip it.

Wrench margin: the largest force at the centre of mass, in the worst of nine directions (eight along
the slope, one off it), that feet which never pull, within friction, and ropes which never push can
hold. One linear program: for every direction d_j there are foot forces in their cones and tensions
within their bounds with

    sum G f_j + sum r T_j + w + margin * d_j = 0,     margin as large as possible.

Cones are pyramids inside the true cone. A support polygon knows neither friction nor ropes; this
does.

Energy margin: about each edge of the standing feet, weight and ropes (constant forces) have the
potential U(a) = -A cos a - B sin a, with A = sum F.r and B = sum F.(e x r), r from the edge to
where a force acts, e along the edge; the work to tip is sqrt(A^2 + B^2) + A where B < 0 (else the
stance is lost about that edge: 0).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import daqp
import numpy as np
from numpy.typing import ArrayLike

from testbed.formats.arrays import Array

SIDES = 8
"""Edges of the pyramid that stands for a friction cone; its facets lie up to 8 % inside."""
MOST = 10.0
"""Pushes beyond ten times the load are not distinguished."""
SMOOTH = 1e-5
"""Weight of the quadratic term that makes the linear program strictly convex; it costs less than
1e-3 of the load.
"""
EQUALITY = 5
"""The solver's word for a row whose two bounds are one."""
_COSINES, _SINES = (
    part(2.0 * np.pi * np.arange(SIDES) / SIDES)[:, None] for part in (np.cos, np.sin)
)
"""(SIDES, 1) of the angles of a pyramid's edges."""
_ANGLES = 2.0 * np.pi * np.arange(8) / 8
DIRECTIONS = np.vstack(
    [np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES), np.zeros(8)]), [[0.0, 0.0, 1.0]]]
)
"""(9, 3) directions of the push, frame of the stance: x up the slope, z off it."""


def wrench_margin_n(
    feet_m: ArrayLike,
    normals: ArrayLike,
    friction: float | Array,
    load: ArrayLike,
    at_m: ArrayLike,
    ropes: ArrayLike | None = None,
    tensions_n: Sequence[tuple[float, float]] = (),
) -> float:
    """Largest push, N, at `at_m` (3) in the worst direction; 0 where not even the load itself is
    held.

    feet_m, normals (n, 3): the standing feet's contact points and normals; friction: one for all
    of them, or (n,); load (6): wrench about
    the origin of everything but feet and ropes; ropes (k, 6): wrenches of a tension of 1 N;
    tensions_n: lowest and highest of each. All in one frame whose z is off the slope.
    """
    scale = max(float(np.linalg.norm(np.asarray(load)[:3])), 1.0)
    held = _generators(np.asarray(feet_m, dtype=float), np.asarray(normals, dtype=float), friction)
    low, high = np.zeros(held.shape[1] + 1), np.full(held.shape[1] + 1, 1e30)
    high[-1] = MOST
    if ropes is not None and len(tensions_n):
        held = np.hstack([held, np.asarray(ropes, dtype=float).T])
        limits = np.array(tensions_n) / scale
        low, high = (
            np.concatenate([ends[:-1], limits[:, index], ends[-1:]])
            for index, ends in enumerate((low, high))
        )
    wanted = -np.asarray(load, dtype=float) / scale
    arms = np.cross(np.asarray(at_m, dtype=float), DIRECTIONS)
    pushes = np.hstack([DIRECTIONS, arms])
    return scale * min(
        _largest(np.column_stack([held, push]), wanted, low, high) for push in pushes
    )


def _largest(equal: Array, wanted: Array, low: Array, high: Array) -> float:
    """Max of the last unknown with equal @ z = wanted, low <= z <= high; 0 where there is no such
    z.
    """
    count = equal.shape[1]
    cost = np.zeros(count)
    cost[-1] = -1.0
    sense = np.zeros(count + 6, dtype=np.int32)
    sense[count:] = EQUALITY
    found: Any = daqp.solve(
        SMOOTH * np.eye(count),
        cost,
        np.ascontiguousarray(equal),
        np.concatenate([high, wanted]),
        np.concatenate([low, wanted]),
        sense,
        primal_tol=1e-9,
        iter_limit=2000,
    )
    return max(float(found[0][-1]), 0.0) if found[2] > 0 else 0.0


def _generators(feet: Array, normals: Array, friction: float | Array) -> Array:
    """(6, n SIDES): wrenches of the edges of each foot's friction pyramid."""
    across = np.cross(normals, [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across, axis=1)[:, None]
    along = np.cross(normals, across)
    across, along = across[:, None], along[:, None]
    held = np.reshape(friction, (-1, 1, 1)) * (_COSINES * across + _SINES * along)
    forces = normals[:, None] + held
    wrenches = np.concatenate([forces, np.cross(feet[:, None], forces)], axis=2)
    return wrenches.reshape(-1, 6).T


def tipping_work_j(feet_m: ArrayLike, forces_n: ArrayLike, points_m: ArrayLike) -> float:
    """Least work, J, that tips a stance on feet (n >= 3, 3) about an edge, against constant forces
    (k, 3) at points.

    0 where the forces already tip it, or fewer than three feet stand. Frame: z off the slope.
    """
    feet = np.asarray(feet_m, dtype=float)
    if len(feet) < 3:
        return 0.0
    return min(
        _edge_work_j(start, end, np.asarray(forces_n), np.asarray(points_m))
        for start, end in _edges(feet)
    )


def _edges(feet: Array) -> list[tuple[Array, Array]]:
    """Edges of the convex hull of three or four feet, seen along z, counter-clockwise."""
    middle = feet[:, :2].mean(axis=0)
    around = np.argsort(np.arctan2(feet[:, 1] - middle[1], feet[:, 0] - middle[0]))
    ring = [feet[index] for index in around]
    corners = [
        foot
        for index, foot in enumerate(ring)
        if not _turns_right(ring[index - 1], foot, ring[(index + 1) % len(ring)])
    ]
    return list(zip(corners, [*corners[1:], corners[0]], strict=True))


def _turns_right(before: Array, at: Array, after: Array) -> bool:
    """Whether a way through three places bends to the right, seen along z: there a foot stands
    between the others.
    """
    (x, y), (u, v) = (at - before)[:2], (after - at)[:2]
    return bool(x * v - y * u < 0.0)


def _edge_work_j(start: Array, end: Array, forces: Array, points: Array) -> float:
    """The edge runs counter-clockwise, so a turn about it lifts what lies inside."""
    along = (end - start) / np.linalg.norm(end - start)
    arms = points - start
    arms = arms - np.outer(arms @ along, along)
    a = float(np.sum(forces * arms))
    b = float(np.sum(forces * np.cross(along, arms)))
    return float(np.hypot(a, b) + a) if b < 0.0 else 0.0
