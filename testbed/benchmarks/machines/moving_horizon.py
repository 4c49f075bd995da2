"""The whole-body estimate's rival: moving-horizon estimation of ground forces (after Kang, Wang and
Xiong, arXiv 2411.12047).

Every STEP_S it looks for the foot forces x_1 .. x_K of the last K nodes, body frame, N, which
together miss least, each by its own standard deviation:

    arrival     x_1 is what the window before found
    process     x_k+1 - x_k is noise: loads change
    cylinders   x_k is what the legs' three cylinders say, friction in the middle of its set
    dynamics    feet, weight, inertia, ropes and drill add up to nothing on the body

under the contact's conditions: a foot pushes and does not pull, within its friction cone; and its
gap g and its force exclude each other, 0 <= g, x_z >= 0, g x_z = 0. The ground's shape is not
known, so a gap is known where the foot was drawn up off the place where it last carried. With the
gaps given, this is a quadratic program, which daqp solves.

What cylinders and dynamics are off by lasts longer than a window: K nodes tell no more than one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import daqp
import numpy as np
from numpy.typing import NDArray

from testbed.estimation.live.believed import Believed
from testbed.estimation.live.joined import replay_rows
from testbed.estimation.live.wrench import Pulls, foot_point, other_wrench, view_of
from testbed.formats.arrays import Array
from testbed.formats.records import SET
from testbed.machine.names import LEGS

STEP_S, NODES = 0.02, 4
CONE = 1.0
"""Friction that ground may have at most (E)."""
LIFTED_M = 0.005
"""A foot that is drawn up so far off the place where it last carried is in the air."""
PROCESS_SD_N, ARRIVAL_SD_N = 400.0, 800.0
"""By how much a foot's force changes from node to node, and how far the window before is trusted
(E)."""
FORCES = len(LEGS) * 3
INFINITE = 1e30


@dataclass(frozen=True, eq=False)
class Node:
    """What is known at one moment."""

    force_n: Array
    """(12,) of the legs' cylinders, foot by foot."""
    sd_n: Array
    carries: NDArray[np.bool_]
    """(4,) feet without a gap."""
    by_force: Array
    """(6, 12) wrench on the body by the feet's forces."""
    other: Array
    """(6,) wrench of all else, N and N m."""


@dataclass(frozen=True, eq=False)
class Horizon:
    """A window that moves over nodes; `dynamics_sd` (6,): of the balance, N and N m."""

    dynamics_sd: Array

    def estimate(self, nodes: list[Node], before: Array | None) -> tuple[Array, Array]:
        """Forces (k, 12) of these nodes and the last one's standard deviations (12,), N; `before`
        (12,): what the window before has for the first node.
        """
        count = len(nodes)
        hessian, gradient = np.zeros((count, FORCES, count, FORCES)), np.zeros((count, FORCES))
        weight = 1.0 / (count * self.dynamics_sd**2)
        for k, node in enumerate(nodes):
            trust = 1.0 / (count * node.sd_n**2)
            hessian[k, :, k] += np.diag(trust) + (node.by_force.T * weight) @ node.by_force
            gradient[k] += node.by_force.T @ (weight * node.other) - trust * node.force_n
        changes = np.eye(FORCES) / PROCESS_SD_N**2
        for k in range(count - 1):
            for row, column, sign in ((k, k, 1), (k + 1, k + 1, 1), (k, k + 1, -1), (k + 1, k, -1)):
                hessian[row, :, column] += sign * changes
        if before is not None:
            hessian[0, :, 0] += np.eye(FORCES) / ARRIVAL_SD_N**2
            gradient[0] -= before / ARRIVAL_SD_N**2
        square = hessian.reshape(count * FORCES, -1)
        sd = np.sqrt(np.diag(np.linalg.inv(square))[-FORCES:])
        return _constrained(square, gradient.ravel(), nodes).reshape(count, FORCES), sd


def _constrained(hessian: Array, gradient: Array, nodes: list[Node]) -> Array:
    """The least x' H x / 2 + g' x under the contact's conditions."""
    unit = PROCESS_SD_N**2  # keeps daqp's numbers near 1
    carries = np.concatenate([node.carries for node in nodes])
    held = np.repeat(carries, 3)
    low, high = np.where(held, -INFINITE, 0.0), np.where(held, INFINITE, 0.0)
    low[2::3] = 0.0
    cone = np.kron(np.eye(len(carries)), [[1, 0, CONE], [-1, 0, CONE], [0, 1, CONE], [0, -1, CONE]])
    found: Any = daqp.solve(
        unit * hessian,
        unit * gradient,
        cone,
        np.concatenate([high, np.full(len(cone), INFINITE)]),
        np.concatenate([low, np.zeros(len(cone))]),
        np.zeros(len(low) + len(cone), dtype=np.int32),
    )
    return np.asarray(found[0], dtype=np.float64)


def loads(data: Mapping[str, Array], belief: Believed) -> tuple[Array, Array]:
    """Foot loads (4, n) and their standard deviations over a recording's columns, N.

    `belief`: of a chain that estimates each leg by itself (without the balance of the body). From
    one node to the next a load follows what its cylinders say.
    """
    rows = replay_rows(data, belief)
    body = belief.body
    assert body is not None
    every = round(STEP_S / belief.dt_s)
    horizon = Horizon(np.hypot(body["balance_sd"][0], np.sqrt(_variances(body[0]))))
    gaps = _gaps(rows)
    read = rows["own"]["z"]
    load, sd = read.copy(), rows["own"]["z_sd"].copy()
    window: list[Node] = []
    found: Array | None = None
    for start in range(0, len(rows), every):
        past = slice(max(start - every, 0), start + 1)
        if not np.isfinite(read[past]).all():
            continue
        window = [*window[1 - NODES :], node_of(rows[past], ~gaps[start], body[0])]
        before = None if found is None else found[1 - len(window)]
        found, spread = horizon.estimate(window, before)
        span = slice(start, start + every)
        load[span] += found[-1, 2::3] - read[start]
        load[span][:, gaps[start]] = 0.0
        sd[span] = spread[2::3]
    return load.T, sd.T


def _variances(body: Any) -> Array:
    return np.repeat([body["force_variance"], body["moment_variance"]], 3)


def _gaps(rows: NDArray[Any]) -> NDArray[np.bool_]:
    """(n, 4) feet that were drawn up off the place where they last carried."""
    height, carrying = rows["position"][:, 2::3], rows["carrying"] >= SET
    index = np.arange(len(rows))[:, None]
    last = np.maximum.accumulate(np.where(carrying, index, 0), axis=0)
    stood = np.take_along_axis(height, last, axis=0)
    lifted: NDArray[np.bool_] = ~carrying & (stood - height > LIFTED_M)
    return lifted


def node_of(rows: NDArray[Any], carries: NDArray[np.bool_], body: Any) -> Node:
    """The node at the end of some rows: forces are of the last one, the body's motion of all."""
    row, own = rows[-1], rows["own"][-1]
    tension = (rows["rope_tension"].mean(axis=0) - body["pin_zero"]) / body["pin_gain"]
    lift = rows["specific_force"].mean(axis=0)
    unit = float(body["unit_roll"]), float(body["unit_pitch"])
    view = view_of(row["attitude"], lift, *unit, float(body["gravity"]))
    by_force, point = np.zeros((6, FORCES)), np.empty(3)
    for leg in range(len(LEGS)):
        joints = row["position"][3 * leg : 3 * leg + 3]
        foot_point(body["legs"][leg], joints, float(body["foot_height"][leg]), point)
        own_columns = slice(3 * leg, 3 * leg + 3)
        by_force[:3, own_columns] = np.eye(3)
        by_force[3:, own_columns] = np.cross(point, np.eye(3)).T
    force = np.column_stack([own["x"], own["y"], own["z"]]).ravel()
    sd = np.column_stack([own["x_sd"], own["y_sd"], own["z_sd"]]).ravel()
    return Node(
        np.where(np.repeat(carries, 3), force, 0.0),
        sd,
        carries,
        by_force,
        other_wrench(row, view, np.zeros(3), Pulls(tension, body["rope_direction"]), body),
    )
