"""Whether and how a posture can be held: rope tensions and foot forces in equilibrium with the least use of friction.

Unlike the expected loads, nothing here asks how stiff the machine is: among all foot forces that never pull, rope
tensions that never push and friction within its cone, the ones are taken that use friction least and load the diagonals
evenly. A quadratic program with forces in units of the weight, cones as 16-sided pyramids inside the true cone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import daqp
import numpy as np
from numpy.typing import ArrayLike, NDArray

from testbed.errors import InputError
from testbed.machine.names import LEGS
from testbed.robot.contact.geometry import contact_axes, contact_maps
from testbed.robot.loads.foot_loads import external_wrench, point_wrench
from testbed.robot.model import Payload, RobotModel

Array = NDArray[np.float64]
SIDES_OF_CONE = 16
_FEET = 3 * len(LEGS)


@dataclass(frozen=True)
class StaticEquilibrium:
    """One way to hold the posture; body frame, N."""

    rope_tension_n: Array
    """(2,) left, right."""
    foot_forces_in_body_n: Array
    """(4, 3) ground on foot."""
    friction_use: Array
    """(4,) tangential / (friction * normal)."""
    joint_forces: Array
    """(12,) what the joints must exert, gravity included: N m for rotation, N for radial and vertical."""
    rope_share: float
    """Share of the pull along the slope that the ropes carry."""


def static_equilibrium(
    model: RobotModel,
    positions: ArrayLike,
    gravity_in_body: ArrayLike,
    friction: float,
    *,
    rope_directions_in_body: ArrayLike | None = None,
    rope_share: float | None = None,
    payload: Payload | None = None,
    drill_wrench_in_body: ArrayLike | None = None,
    normals_in_body: ArrayLike | None = None,
) -> StaticEquilibrium:
    """Hold joint positions (12,) under gravity (3,) in the body frame, with the least use of friction.

    rope_directions_in_body (2, 3): unit vectors from the attachment points towards the anchors; None: no ropes.
    rope_share: the ropes' part of the load along the feet's plane (0: slack, 1: the feet push no way); None: the best.
    Raises InputError if no such equilibrium exists, with the share that would do if there is one.
    """
    problem = _Problem(
        model,
        positions,
        gravity_in_body,
        friction,
        rope_directions_in_body,
        payload,
        drill_wrench_in_body,
        normals_in_body,
    )
    solution = problem.solve(rope_share)
    if solution is None:
        best = (
            None if rope_directions_in_body is None or rope_share is None else problem.solve(None)
        )
        if best is None:
            raise InputError(
                f"feet with friction {friction:g} and the ropes cannot hold this posture",
                field="posture",
            )
        raise InputError(
            f"the feet with friction {friction:g} cannot hold the rest",
            field="ropes.share",
            value=rope_share,
            allowed=f"at least about {problem.lowest_share():.3f}; {problem.share(best):.3f} uses friction least",
        )
    forces = problem.forces_in_body(solution)
    held = model.gravity_forces(positions, gravity_in_body)[6:]
    joints = held - np.einsum("kia,ki->a", model.feet(positions)[1], forces)
    return StaticEquilibrium(
        solution[_FEET:] * problem.scale,
        forces,
        problem.friction_use(solution),
        joints,
        problem.share(solution),
    )


class _Problem:
    """The quadratic program in z = (12 foot forces in contact axes, 2 rope tensions), in units of the load."""

    def __init__(
        self,
        model: RobotModel,
        positions: ArrayLike,
        gravity: ArrayLike,
        friction: float,
        ropes: ArrayLike | None,
        payload: Payload | None,
        drill: ArrayLike | None,
        normals: ArrayLike | None,
    ) -> None:
        load = external_wrench(model, positions, gravity, payload, None, drill)
        undersides, _ = model.feet(positions)
        up = (
            np.tile([0.0, 0.0, 1.0], (len(LEGS), 1))
            if normals is None
            else np.asarray(normals, dtype=float)
        )
        self.frames = contact_axes(up)
        maps = contact_maps(
            undersides,
            model.vertical_axes(positions),
            self.frames,
            model.foot_radius_m,
            np.zeros(3),
        )
        self.friction, self.scale = friction, float(np.linalg.norm(load[:3]))
        self.roped = ropes is not None
        pulls = np.zeros((2, 3)) if ropes is None else np.asarray(ropes, dtype=float)
        columns = [
            point_wrench(pull, at) for pull, at in zip(pulls, model.rope_attachments_m, strict=True)
        ]
        self.balance = np.hstack([*maps, np.array(columns).T])
        self.load = load / self.scale
        # The ropes' share is counted against the pull along the feet's mean plane.
        normal = up.mean(axis=0) / np.linalg.norm(up.mean(axis=0))
        pull = self.load[:3] - normal * (normal @ self.load[:3])
        size = float(np.linalg.norm(pull))
        self.pull = size if size > 1e-9 else 0.0
        self.along = np.zeros(_FEET + 2)
        if self.pull:
            self.along[_FEET:] = -pulls @ pull / size

    def solve(self, share: float | None) -> Array | None:
        """The best z for a share of the ropes (None: free), or None if there is none."""
        normals = np.full(len(LEGS), 1.0 / len(LEGS))
        solution = None
        for _ in range(4):
            # Weighting a foot's tangential force by 1 / normal makes equal use of friction the optimum.
            weights = np.zeros(_FEET + 2)
            weights[:_FEET:3] = 1.0
            weights[1:_FEET:3] = weights[2:_FEET:3] = 10.0 / np.maximum(normals, 0.02)
            weights[_FEET:] = 1e-3
            solution = self._minimise(np.diag(weights), np.zeros(_FEET + 2), share)
            if solution is None:
                return None
            normals = solution[:_FEET:3]
        return solution

    def lowest_share(self) -> float:
        """The smallest share of the ropes with which an equilibrium exists."""
        solution = self._minimise(1e-8 * np.eye(_FEET + 2), self.along, None)
        return float("nan") if solution is None else self.share(solution)

    def _minimise(self, weights: Array, costs: Array, share: float | None) -> Array | None:
        """argmin z.W z / 2 + c.z under balance, cones, ropes that pull, and the share if given."""
        equal, value = self.balance, -self.load
        if share is not None and self.roped and self.pull:
            equal, value = np.vstack([equal, self.along]), np.append(value, share * self.pull)
        cones = self._cones()
        rows = np.vstack([equal, cones])
        upper = np.concatenate([value, np.zeros(len(cones))])
        lower = np.concatenate([value, np.full(len(cones), -1e30)])
        free_low, free_high = np.full(_FEET + 2, -1e30), np.full(_FEET + 2, 1e30)
        free_low[:_FEET:3], free_low[_FEET:] = 0.0, 0.0
        if not self.roped:
            free_high[_FEET:] = 0.0
        sense = np.zeros(len(free_low) + len(rows), dtype=np.int32)
        sense[len(free_low) : len(free_low) + len(equal)] = 5
        found: Any = daqp.solve(
            weights,
            costs,
            np.ascontiguousarray(rows),
            np.concatenate([free_high, upper]),
            np.concatenate([free_low, lower]),
            sense,
            primal_tol=1e-10,
            iter_limit=5000,
        )
        z = np.asarray(found[0])
        reached = found[2] > 0 and bool(np.abs(equal @ z - value).max() < 1e-7)
        return z if reached else None

    def _cones(self) -> Array:
        """Rows r with r.z <= 0: facets of pyramids inscribed in the friction cones."""
        inside = self.friction * np.cos(np.pi / SIDES_OF_CONE)
        rows = np.zeros((len(LEGS) * SIDES_OF_CONE, _FEET + 2))
        for leg in range(len(LEGS)):
            for side in range(SIDES_OF_CONE):
                angle = 2 * np.pi * side / SIDES_OF_CONE
                rows[leg * SIDES_OF_CONE + side, 3 * leg : 3 * leg + 3] = (
                    -inside,
                    np.cos(angle),
                    np.sin(angle),
                )
        return rows

    def share(self, z: Array) -> float:
        """Share of the ropes in the pull along the plane (0 where nothing pulls)."""
        return float(self.along @ z / self.pull) if self.pull else 0.0

    def forces_in_body(self, z: Array) -> Array:
        """Foot forces (4, 3), N, body frame."""
        return np.asarray((self.frames @ z[:_FEET].reshape(len(LEGS), 3, 1))[:, :, 0] * self.scale)

    def friction_use(self, z: Array) -> Array:
        """(4,) tangential / (friction * normal), 0 for a foot in the air."""
        forces = z[:_FEET].reshape(len(LEGS), 3)
        capacity = self.friction * forces[:, 0]
        used = np.linalg.norm(forces[:, 1:], axis=1)
        return np.asarray(np.divide(used, capacity, out=np.zeros(len(LEGS)), where=capacity > 1e-9))


def balanced_attachment_height_m(
    model: RobotModel, positions: ArrayLike, rope_share: float, payload: Payload | None = None
) -> float:
    """Height of the ropes' attachment in the body frame at which pulls along the slope tip the machine neither way.

    Weight pulls downhill with P at the centre of mass (height c), the ropes uphill with s P at height h, the feet with
    (1 - s) P at their soles (height f): s h + (1 - s) f = c, so h = c + (1 - s) / s (c - f). Ropes parallel to the
    slope. The normal loads then stand under the centre of mass as on level ground; on 85 degrees each centimetre
    off shifts them by 11 cm, and half the footprint, 1.25 m, is all there is.
    """
    if not 0.0 < rope_share <= 1.5:
        raise InputError(
            "is no share that ropes can carry",
            field="rope_share",
            value=rope_share,
            allowed="0 to 1.5",
        )
    carrier = model if payload is None else model.with_payload(payload)
    centre = float(carrier.centre_of_mass_m(positions)[2])
    soles = float(carrier.foot_positions_m(positions)[:, 2].mean())
    return centre + (1.0 - rope_share) / rope_share * (centre - soles)
