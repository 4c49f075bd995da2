"""How steep the ground under the feet seems: an earlier recording from the same place says how
steep it is.

Four feet that stand show the ground in the body's frame, and the inertial unit says how the body is
tilted. The ground stays as it is; what makes it seem otherwise than before is a unit that sits
askew, an encoder's zero, or a foot that sank. One recording alone does not show it, for nobody
surveys the slope. The places are the same where the surveys have the same ropes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot.balance import BodyBalance
from testbed.diagnosis.robot.bins import Bins
from testbed.diagnosis.robot.evidence import PIECE_S, RawGroup
from testbed.diagnosis.robot.walking_bias import hangs
from testbed.effects.signature import Change
from testbed.machine.names import LEGS
from testbed.robot.model import rotation_from_attitude

Array = npt.NDArray[np.float64]
CARRIES = 0.99
"""A foot stands in a bin of which it is meant to carry this share."""
UNEVEN_RAD = 5.0e-3
"""By how much ground differs in steepness between standing places, 10 mm over two metres: from one
recording to the other, and as much from piece to piece. How the feet's plane turns within a
recording is the places of the feet's to tell, which must not count twice (E).
"""
ANY_RAD = 1.0
"""How steep it may be where nobody was before."""
SAME_WAY = 1.0e-6
"""Ropes that were surveyed elsewhere do not have the same directions to this share."""
STEP_RAD = 1.0e-4
"""And metres: steps by which derivatives are taken."""


@dataclass(frozen=True, eq=False)
class Ground(RawGroup):
    """The group: pitch and roll of the ground in the frame of gravity, rad, over pieces of a
    recording.
    """

    ropes_in_world: Array | None = None
    """(2, 3) as surveyed: they tell one place from another."""

    @property
    def scatter_rad(self) -> float:
        """Root mean square by which the pieces of the recording lie about their means: how uneven
        the ground is that its feet came over.
        """
        both = self.missing.reshape(-1, 2)
        return float(np.sqrt(np.mean((both - both.mean(axis=0)) ** 2)))

    def knowing(self, sound: RawGroup, recalled: float | None = None) -> RawGroup:
        """By how much it seems steeper than in the earlier recording, of the same place."""
        assert isinstance(sound, Ground)
        was = sound.missing.reshape(-1, 2).mean(axis=0)
        uneven = float(np.linalg.norm([UNEVEN_RAD, self.scatter_rad, sound.scatter_rad]))
        pieces = len(self.missing) // 2
        lasting = alike(pieces, uneven)
        noise = uneven**2 * np.eye(2 * pieces) + lasting
        return replace(
            self, missing=self.missing - np.tile(was, pieces), noise=noise, lasting=lasting
        )


def is_same_place(here: RawGroup | None, before: RawGroup | None) -> bool:
    """Whether both grounds are of one place, as their surveys tell."""
    if not isinstance(here, Ground) or not isinstance(before, Ground):
        return False
    one, other = here.ropes_in_world, before.ropes_in_world
    if one is None or other is None:
        return False
    return bool(np.allclose(one, other, rtol=0.0, atol=SAME_WAY))


def alike(pieces: int, sd_rad: float) -> Array:
    """Covariance (2 pieces, 2 pieces) of a pitch and a roll that are the same in all pieces."""
    return np.asarray(sd_rad**2 * np.kron(np.ones((pieces, pieces)), np.eye(2)))


def group_of(balance: BodyBalance, bins: Bins, ropes_in_world: Array) -> Ground | None:
    """The group of a measured robot; None where it never stands on all feet, or hangs on no ropes
    that would tell its place.
    """
    pieces = list(_pieces(bins))
    if not pieces or not hangs(balance.seen, balance.foot_force):
        return None
    seen, attitude = balance.seen, bins.attitude_rad

    middles = [int(piece[len(piece) // 2]) for piece in pieces]
    steepnesses = steepness(seen.foot_m[middles], attitude[middles])

    def means(change: Change) -> Array:
        """By how much it seems steeper by one unit of a change, piece by piece."""
        feet_m, turned = seen.foot_m[middles], attitude[middles]
        if change.feet is None and change.unit_turned is None:
            return np.zeros(steepnesses.size)
        if change.feet is not None:
            feet_m = feet_m + STEP_RAD * change.feet[middles]
        if change.unit_turned is not None:
            turned = turned + STEP_RAD * change.unit_turned
        return np.ravel((steepness(feet_m, turned) - steepnesses) / STEP_RAD)

    slopes = [steepness(seen.foot_m[piece], attitude[piece]).mean(axis=0) for piece in pieces]
    return Ground(
        missing=np.concatenate(slopes),
        time_s=np.repeat([bins.time_s[k] for k in middles], 2),
        noise=UNEVEN_RAD**2 * np.eye(2 * len(pieces)) + alike(len(pieces), ANY_RAD),
        tolerated=np.zeros((2 * len(pieces), 1)),
        rows_of=means,
        ropes_in_world=ropes_in_world,
    )


def steepness(feet_m: Array, attitude_rad: Array) -> Array:
    """(n, 2) pitch and roll, rad, of the ground on which feet stand (n, 4, 3) of a body with these
    attitudes (n, 3): of its normal in the frame of gravity.
    """
    middle = feet_m - feet_m.mean(axis=1, keepdims=True)
    normal = np.linalg.svd(middle)[2][:, 2]
    normal *= np.sign(normal[:, 2:])
    rotation = np.array([rotation_from_attitude(one) for one in attitude_rad])
    up = (rotation @ normal[:, :, None])[:, :, 0]
    return np.column_stack([np.arctan2(up[:, 0], up[:, 2]), np.arcsin(up[:, 1])])


def _pieces(bins: Bins) -> Iterator[npt.NDArray[np.intp]]:
    """Indices of the bins in which all feet stand, piece by piece."""
    stands = (bins.carrying > CARRIES).sum(axis=1) == len(LEGS)
    piece = ((bins.time_s - bins.time_s[0]) // PIECE_S).astype(int)
    for k in range(int(piece[-1]) + 1):
        found = np.flatnonzero(stands & (piece == k))
        if len(found):
            yield found


def _turns(change: Change) -> bool:
    return change.feet is not None or change.unit_turned is not None


def _by(change: Change, feet_m: Array, attitude_rad: Array, k: int, steep: Array) -> Array:
    """(2,) by how much the ground seems steeper in bin k, where it is `steep` (2,), by one unit of
    a change.
    """
    moved, turned = feet_m, attitude_rad
    if change.feet is not None:
        moved = feet_m + STEP_RAD * change.feet[k]
    if change.unit_turned is not None:
        turned = attitude_rad + STEP_RAD * change.unit_turned
    return np.asarray((steepness(moved, turned) - steep) / STEP_RAD)
