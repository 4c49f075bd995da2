"""What of a motion makes a piston's force or friction unsure: turning round, shaking, switching,
lying at an end stop, and how the body's last motion left the seals.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from testbed.effects.signature import RobotSeen

Array = npt.NDArray[np.float64]
END_SHARE = 0.005
"""A piston within this share of its stroke of either end may lie at its stop (E)."""
SURE_BINS = 1
"""A piston slides surely about a bin of a slide that lasts for this many bins to either side of
one: what is over sooner was partly at rest.
"""
TURNING_BINS = 2
"""A piston turns round within so many bins to either side."""


def oil_force_n(seen: RobotSeen) -> Array:
    """(n, 12) force of the oil on the pistons, N, without what end cushions brake."""
    return seen.pressure_a_pa * seen.area_a_m2 - seen.pressure_b_pa * seen.area_b_m2


def taken_by_stops(seen: RobotSeen) -> Array:
    """(n, 12) force that an end stop may take, N: as much as the oil can push, where the piston may
    lie at it.
    """
    from_end = np.minimum(seen.extension_m, seen.stroke_m - seen.extension_m)
    most = seen.supply_pa[:, None] * seen.area_a_m2
    return np.asarray(np.where(from_end < END_SHARE * seen.stroke_m, most, 0.0))


def switched_n(seen: RobotSeen) -> Array:
    """(n, 12) by how much the force of a piston changes from bin to bin about each bin, N."""
    piston = oil_force_n(seen)
    changed = np.abs(np.diff(piston, axis=0, prepend=piston[:1]))
    later = np.vstack([changed[1:], changed[-1:]])
    return np.asarray(np.maximum(changed, later))


def swings(values: Array) -> Array:
    """(n, k) by how much values (n, k) leave the straight line through the bins beside them, the
    most of each bin and its neighbours: what shakes, or an impact.
    """
    off = np.zeros_like(values)
    off[1:-1] = np.abs(values[1:-1] - 0.5 * (values[2:] + values[:-2]))
    near = np.vstack([off[:1], off, off[-1:]])
    return np.asarray(np.maximum(np.maximum(near[:-2], near[2:]), off))


def shaken_n(seen: RobotSeen) -> Array:
    """(n, 1) a foot's part of the force that the whole machine's shaking asks for, N."""
    force = np.einsum("nij,nj->ni", seen.asked_by_gravity[:, :3], swings(seen.gravity))
    return np.asarray(np.linalg.norm(force, axis=1, keepdims=True) / seen.foot_m.shape[1])


def left_by_motions(seen: RobotSeen) -> Array:
    """(n, 12, 6) how the pistons slide when the body moves along and turns about its axes on its
    feet, by their root mean square: what friction of stuck seals is left by such a motion.
    """
    legs = seen.foot_m.shape[1]
    turned = -np.cross(seen.foot_m[:, :, None, :], np.eye(3))  # of a foot, by unit turns (3)
    moved = np.broadcast_to(np.eye(3), turned.shape)
    ways = np.concatenate([moved, turned], axis=2)  # (n, 4, 6, 3) of the body under each foot
    joints = -np.linalg.solve(seen.foot_by_joint, np.swapaxes(ways, 2, 3))
    pistons = joints.reshape(seen.bins, legs * 3, 6) * seen.arm_m[:, :, None]
    size = np.sqrt(np.mean(pistons**2, axis=1, keepdims=True))
    return np.asarray(np.clip(pistons / size, -1.0, 1.0))


def slides_surely(direction: Array) -> Array:
    """(n, k) share, 0 to 1, to which a piston slides in a bin that belongs to a slide which lasts;
    `direction` (n, k) is its sense of sliding.
    """
    same = _beside(direction, SURE_BINS) * np.sign(direction)
    within = np.clip(same.min(axis=0), 0.0, 1.0) > 0.0
    lasts = _beside(within, SURE_BINS).any(axis=0)
    return np.asarray(np.abs(direction) * lasts)


def turning_from(direction: Array) -> Array:
    """(n, k) sense, -1 to 1, that a piston turns from about a bin: half of what its sense
    `direction` (n, k) loses from so many bins before to so many after; 0 where it goes on.
    """
    near = _beside(direction, TURNING_BINS)
    return np.asarray(0.5 * (near[0] - near[-1]))


def _beside(values: npt.NDArray[np.generic], reach: int) -> Array:
    """(2 reach + 1, n, k) values (n, k) of the bins about each bin."""
    bins = np.arange(len(values))
    near = [np.clip(bins + k, 0, len(values) - 1) for k in range(-reach, reach + 1)]
    return np.array([values[index] for index in near])


def turns(direction: Array) -> Array:
    """(n, 12) how far a piston turns round about a bin: half the span of its sense over the bins
    beside it, 0 to 1.
    """
    near = _beside(direction, TURNING_BINS)
    return np.asarray(0.5 * (near.max(axis=0) - near.min(axis=0)))
