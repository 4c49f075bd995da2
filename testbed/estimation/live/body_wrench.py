"""The wrench of weight, ropes and drill as believed, and how far each unknown of the filter
(fusion.py) puts it off. Compiled.

`rows` (6, unknowns) are the six equations of the balance: force and moment about the body's origin,
body frame, N and N m; a column is the derivative of all six by one unknown.
"""

from __future__ import annotations

import math

import numpy as np

from testbed.compiled import njit
from testbed.estimation.live import unknowns
from testbed.estimation.live.body_records import BodyBelief, BodyState
from testbed.estimation.live.wrench import (
    Pulls,
    View,
    add_force,
    other_wrench,
    rope_direction,
    view_of,
)
from testbed.formats.arrays import Array
from testbed.recording.rows import DataRow

SMALL_RAD = 1.0e-4
"""Step of the numerical derivative by the misalignment of the inertial unit, rad."""


@njit
def write_body_wrench(
    row: DataRow, angular_acceleration: Array, belief: BodyBelief, state: BodyState, rows: Array
) -> Array:
    """Return the believed wrench (6) of weight, ropes and drill on the body, N and N m, and write
    its derivatives by the filter's unknowns into rows (6, unknowns).
    """
    means, roll, pitch = state.means, belief.unit_roll, belief.unit_pitch
    attitude, felt = row.attitude, means.specific_force
    pulls = Pulls(means.rope_tension, state.ropes.direction)
    view = view_of(attitude, felt, roll, pitch, belief.gravity)
    wrench = other_wrench(row, view, angular_acceleration, pulls, belief)
    for axis in range(2):
        turn = (SMALL_RAD, 0.0) if axis == 0 else (0.0, SMALL_RAD)
        other = view_of(attitude, felt, roll + turn[0], pitch + turn[1], belief.gravity)
        turned = other_wrench(row, other, angular_acceleration, pulls, belief)
        for index in range(6):
            rows[index, unknowns.UNIT + axis] = (wrench[index] - turned[index]) / SMALL_RAD
    moment = np.zeros(3)
    for k in range(3):
        rows[k, unknowns.MASS] = view.specific_force[k]
        moment[:] = 0.0
        moment[k] = 1.0
        put_moment(rows, unknowns.MOMENT + k, moment, view.specific_force)
    for k in range(2):
        write_rope_errors(k, view, pulls, belief, rows)
    return wrench


@njit
def write_rope_errors(k: int, view: View, pulls: Pulls, belief: BodyBelief, rows: Array) -> None:
    """Write the derivatives of rope k's wrench by its unknowns into rows (6, unknowns): azimuth and
    elevation, gain and zero of the load pin, height of the attachment.
    """
    tension = pulls.tension[k]
    if tension <= 0.0:
        return
    along, left, up = np.empty(3), np.zeros(3), np.zeros(3)
    rope_direction(view, pulls.direction[k], along)
    level = math.sqrt(along[0] ** 2 + along[1] ** 2)
    left[0], left[1] = -along[1], along[0]
    if level > 0.0:
        up[0], up[1], up[2] = -along[2] * along[0] / level, -along[2] * along[1] / level, level
    point = belief.rope_point[k]
    put_force(rows, unknowns.AZIMUTH + k, left, -tension, point)
    put_force(rows, unknowns.ELEVATION + k, up, -tension, point)
    put_force(rows, unknowns.PIN_GAIN + k, along, tension, point)
    put_force(rows, unknowns.PIN_ZERO + k, along, 1.0, point)
    lever = np.zeros(3)
    lever[2] = -tension
    put_moment(rows, unknowns.ROPE_HEIGHT + k, lever, along)


@njit
def put_force(rows: Array, column: int, direction: Array, size: float, point: Array) -> None:
    """Write the wrench of a force, `size` along `direction` at `point`, into a column of rows."""
    wrench, force = np.zeros(6), np.empty(3)
    for index in range(3):
        force[index] = size * direction[index]
    add_force(wrench, force, point)
    for r in range(6):
        rows[r, column] = wrench[r]


@njit
def put_moment(rows: Array, column: int, lever: Array, force: Array) -> None:
    """Write the moment alone of `force` (3) at `lever` (3) into a column of rows (6, unknowns)."""
    wrench = np.zeros(6)
    add_force(wrench, force, lever)
    for index in range(3, 6):
        rows[index, column] = wrench[index]
