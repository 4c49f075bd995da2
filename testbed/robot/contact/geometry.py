"""Compiled: from legs and normals to contact axes, to the contact solver, and back to what a foot
reports.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.formats.arrays import Array, Flags
from testbed.machine.names import LEGS
from testbed.robot.contact.solver import Feet, solve_contacts

ALONG_X = 1e-9
"""Size of a tangent below which the normal lies along body x."""
UNLOADS_N_N = -1e-9
"""A push takes load from a foot where its load's slope is below this."""
BALANCED = 1e-6
"""Equilibrium counts as reached when the missing wrench is below this share of the load."""


@njit
def contact_axes(normals: Array) -> Array:
    """Rotations (n, 3, 3) whose columns are the normal, a tangent near body x and a tangent near
    body y.

    A normal along body x has no tangent near it: NaN.
    """
    frames = np.empty((normals.shape[0], 3, 3))
    for index in range(normals.shape[0]):
        x, y, z = normals[index, 0], normals[index, 1], normals[index, 2]
        size = np.sqrt((1.0 - x * x) ** 2 + (x * y) ** 2 + (x * z) ** 2)
        size = size if size > ALONG_X else np.nan
        a, b, c = (1.0 - x * x) / size, -x * y / size, -x * z / size
        frames[index, 0, 0], frames[index, 1, 0], frames[index, 2, 0] = x, y, z
        frames[index, 0, 1], frames[index, 1, 1], frames[index, 2, 1] = a, b, c
        frames[index, 0, 2], frames[index, 1, 2], frames[index, 2, 2] = (
            y * c - z * b,
            z * a - x * c,
            x * b - y * a,
        )
    return frames


@njit
def contact_maps(
    undersides: Array, axes: Array, frames: Array, radii_m: Array, about: Array
) -> Array:
    """Wrenches (n, 6, 3) about the point `about` (3,) of unit forces along the contact axes.

    The foot's sphere touches at its centre (underside + radius along the leg's axis) less radius
    along the normal.
    """
    maps = np.empty((undersides.shape[0], 6, 3))
    for index in range(undersides.shape[0]):
        radius_m = radii_m[index]
        px, py, pz = (
            undersides[index, 0] + radius_m * (axes[index, 0] - frames[index, 0, 0]) - about[0],
            undersides[index, 1] + radius_m * (axes[index, 1] - frames[index, 1, 0]) - about[1],
            undersides[index, 2] + radius_m * (axes[index, 2] - frames[index, 2, 0]) - about[2],
        )
        for k in range(3):
            x, y, z = frames[index, 0, k], frames[index, 1, k], frames[index, 2, k]
            maps[index, 0, k], maps[index, 1, k], maps[index, 2, k] = x, y, z
            maps[index, 3, k], maps[index, 4, k], maps[index, 5, k] = (
                py * z - pz * y,
                pz * x - px * z,
                px * y - py * x,
            )
    return maps


@njit
def contact_compliances(jacobians: Array, joints: Array, extra: Array, frames: Array) -> Array:
    """Compliances (n, 3, 3) m/N in contact axes: joints (12,) through the Jacobians (n, 3, 12),
    plus `extra` (n, 3, 3).

    `extra` is in the body frame: the ground's and the frame's.
    """
    n = frames.shape[0]
    out, body = np.zeros((n, 3, 3)), np.empty((3, 3))
    for index in range(n):
        for j in range(3):
            for k in range(3):
                body[j, k] = extra[index, j, k]
                for axis in range(joints.shape[0]):
                    body[j, k] += (
                        jacobians[index, j, axis] * joints[axis] * jacobians[index, k, axis]
                    )
        for a in range(3):
            for b in range(3):
                for j in range(3):
                    for k in range(3):
                        out[index, a, b] += frames[index, j, a] * body[j, k] * frames[index, k, b]
    return out


@njit
def _moved(wrench: Array, point: Array) -> Array:
    """A wrench about the origin, expressed about `point`: the moment loses point x force."""
    out = np.empty(6)
    for index in range(6):
        out[index] = wrench[index]
    out[3] -= point[1] * wrench[2] - point[2] * wrench[1]
    out[4] -= point[2] * wrench[0] - point[0] * wrench[2]
    out[5] -= point[0] * wrench[1] - point[1] * wrench[0]
    return out


@njit
def _move_gradient(gradient: Array, point: Array) -> None:
    """To the derivative by a wrench about the origin, from that by the wrench about `point`
    (transpose of `_moved`).
    """
    gradient[0] -= gradient[4] * point[2] - gradient[5] * point[1]
    gradient[1] -= gradient[5] * point[0] - gradient[3] * point[2]
    gradient[2] -= gradient[3] * point[1] - gradient[4] * point[0]


@njit
def _in_body(
    axes: Array, frames: Array, forces: Array, per_height: Array, per_load: Array
) -> tuple[Array, ...]:
    """Forces (n, 3) in the body frame, and loads (n,), loads per height (n, n), per wrench (n, 6)
    along `axes`.
    """
    n = forces.shape[0]
    in_body, load = np.zeros((n, 3)), np.zeros(n)
    by_height, by_wrench = np.zeros((n, n)), np.zeros((n, 6))
    for index in range(n):
        for k in range(3):
            along = 0.0
            for j in range(3):
                in_body[index, j] += frames[index, j, k] * forces[index, k]
                along += axes[index, j] * frames[index, j, k]
            load[index] += along * forces[index, k]
            for j in range(n):
                by_height[index, j] += along * per_height[index, k, j]
            for j in range(6):
                by_wrench[index, j] += along * per_load[index, k, j]
    return in_body, load, by_height, by_wrench


class Legs(NamedTuple):
    """The legs at one posture, in the body frame."""

    undersides: Array
    """Lowest point of each foot, (n, 3), m."""
    jacobians: Array
    """Motion of the undersides by the joints, (n, 3, 12)."""
    verticals: NDArray[np.int64]
    """Each leg's vertical joint among the twelve, (n,)."""
    radii_m: Array
    """Of the feet, (n,)."""
    compliance: Array
    """Of the joints, (12,), m/N or rad/(N m)."""


class Ground(NamedTuple):
    """What the feet stand on, in the body frame."""

    normals: Array
    """(n, 3)."""
    compliance: Array
    """Of the ground and of what else gives at a foot, (n, 3, 3), m/N."""
    heights: Array
    """How far it stands proud of the plane through the unloaded feet, (n,), m."""
    reached: Flags
    """Under feet that may touch, (n,)."""
    friction: Array
    """(n,)."""


class FootLoads(NamedTuple):
    """Expected loads of the four feet (LEGS order), ground on foot, N; body frame."""

    force_in_body_n: Array
    """(4, 3)."""
    normal_n: Array
    """(4,) along the ground's normal."""
    tangential_n: Array
    """(4,) size of the friction force."""
    vertical_load_n: Array
    """(4,) along the vertical joint's axis: what its cylinder feels of the ground."""
    friction_use: Array
    """(4,) tangential / (friction * normal); 1 slides; 0 for a foot in the air."""
    in_contact: Flags
    """(4,) feet that carry."""
    load_per_height_n_m: Array
    """(4, 4): change of vertical load i by raising the ground under foot j, N/m."""
    load_per_wrench: Array
    """(4, 6): change of vertical load i by a wrench on the body, N/N and N/(N m)."""
    reserve_n: Array
    """(4,) further push away from the slope, along the drill axis, at which a foot leaves, if
    friction holds until then and no other foot leaves before; infinite if it never does."""
    missing_wrench: Array
    """(6,) wrench that the feet cannot balance; about zero when `balanced`."""
    balanced: bool
    """Whether feet that never pull, within friction, hold the machine."""

    @property
    def unloads_first(self) -> str | None:
        """The leg whose foot leaves first under a push along the drill axis (None: no foot
        would).
        """
        first = int(np.argmin(self.reserve_n))
        return LEGS[first] if np.isfinite(self.reserve_n[first]) else None

    @property
    def unload_reserve_n(self) -> float:
        """Further push along the drill axis at which the first foot leaves, N."""
        return float(self.reserve_n.min())


@njit
def feet_under_load(
    load: Array, centre: Array, legs: Legs, ground: Ground, push: Array
) -> FootLoads:
    """Expected loads, from legs and load; `push` (6,) is the wrench along which reserves are
    counted.

    Solved about the centre of mass `centre` (3,), so that a load the feet cannot balance pushes it
    away, not over.
    """
    n, friction = ground.friction.shape[0], ground.friction
    axes = np.empty((n, 3))
    for index in range(n):
        for k in range(3):
            axes[index, k] = -legs.jacobians[index, k, legs.verticals[index]]
    frames = contact_axes(ground.normals)
    feet = Feet(
        contact_maps(legs.undersides, axes, frames, legs.radii_m, centre),
        contact_compliances(legs.jacobians, legs.compliance, ground.compliance, frames),
        ground.heights,
        ground.reached,
    )
    found, missing, per_height, per_load = solve_contacts(_moved(load, centre), feet, friction)
    forces = found.forces
    back = np.empty(3)
    for k in range(3):
        back[k] = -centre[k]
    missing = _moved(missing, back)
    for index in range(n):
        for k in range(3):
            _move_gradient(per_load[index, k], centre)
    in_body, vertical, by_height, by_wrench = _in_body(axes, frames, forces, per_height, per_load)
    normal, reserve = np.empty(n), np.empty(n)
    tangential, use = np.zeros(n), np.zeros(n)
    for index in range(n):
        normal[index], reserve[index] = forces[index, 0], np.inf
        tangential[index] = np.sqrt(forces[index, 1] ** 2 + forces[index, 2] ** 2)
        if not found.touches[index]:
            continue
        if friction[index] > 0.0:
            use[index] = tangential[index] / (friction[index] * forces[index, 0])
        slope = 0.0
        for k in range(6):
            slope += per_load[index, 0, k] * push[k]
        if slope < UNLOADS_N_N:
            reserve[index] = -forces[index, 0] / slope
    lacks = carries = 0.0
    for k in range(6):
        lacks += missing[k] ** 2
        carries += load[k] ** 2
    return FootLoads(
        in_body,
        normal,
        tangential,
        vertical,
        use,
        found.touches,
        by_height,
        by_wrench,
        reserve,
        missing,
        lacks <= BALANCED**2 * carries,
    )
