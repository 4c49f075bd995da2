"""What control wants of the machine during one tick: a value that nobody changes afterwards.

A gait returns one, layers make another of it, and the loop alone turns it into moving set points.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from testbed.formats.arrays import Array, Flags
from testbed.machine.names import AXES, LEGS, SIDES

REST_1_S = 1.0e-7
"""A set point that moves slower than this, rad/s or m/s, rests: the valve loop may close its
valve.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Command:
    """Set points, ropes, stance and drill for the tick from t to t + dt. Arrays are copied and
    cannot be written to.

    Returning the same object again says that nothing has changed.
    """

    joints: Array
    """(12) where the set points of the joints' position loops are to be at the end of the tick:
    AXES order, rad (rotation) and m."""
    joint_rates: Array | None = None
    """(12) how fast they move during the tick, rad/s and m/s; they then come from `joints -
    joint_rates * dt`. None: steadily from where the last command left them, which is what a motion
    wants. Feedback on forces sets it."""
    rope_rates_m_s: Array = field(default_factory=lambda: np.zeros(len(SIDES)))
    """(2) rate of the ropes' unstrained lengths, left and right: negative hauls in."""
    stance: Flags = field(default_factory=lambda: np.ones(len(LEGS), dtype=bool))
    """(4) which feet are meant to carry, LEGS order; the others swing."""
    hold_drill: bool = False
    """The drill is to stop pushing, pulling and turning, and to wait."""
    feed_n: float | None = None
    """Feed that the drill is to push with while it drills, N; None: what its task says."""
    hammer: float = 1.0
    """Share of a blow's energy that the hammer is to strike with, 0 to 1."""

    def __post_init__(self) -> None:
        """Copy and freeze the arrays."""
        object.__setattr__(self, "joints", _frozen(self.joints))
        if self.joint_rates is not None:
            object.__setattr__(self, "joint_rates", _frozen(self.joint_rates))
        object.__setattr__(self, "rope_rates_m_s", _frozen(self.rope_rates_m_s))
        object.__setattr__(self, "stance", _frozen(self.stance, np.bool_))

    def moved(self, offset: Array, offset_rate: Array) -> Command:
        """The same with set points `offset` (12) further at the end of the tick, an offset that
        grew at its rate.
        """
        rates = self.joint_rates
        return replace(
            self,
            joints=self.joints + offset,
            joint_rates=None if rates is None else rates + offset_rate,
        )


class SetPoints:
    """Where the set points of the position loops stand, moved by commands: the one place that adds
    up their rates.
    """

    def __init__(self, joints: Array) -> None:
        self.joints: Array = np.array(joints, dtype=np.float64)
        """(12) at the end of the last tick."""

    def follow(self, command: Command, dt: float) -> tuple[Array, Array]:
        """Move on by a tick of dt s: where the set points begin it (12), and their rates during it
        (12).
        """
        rates = command.joint_rates
        if rates is not None:
            self.joints = command.joints
            return command.joints - rates * dt, rates
        begin = self.joints
        rates = (command.joints - begin) / dt
        rates[np.abs(rates) < REST_1_S] = 0.0
        self.joints = begin + rates * dt
        return begin, rates


def along_vertical(per_leg: ArrayLike) -> Array:
    """(12) joints that are zero but for the vertical ones, which take `per_leg` (4)."""
    out = np.zeros(len(AXES))
    out[2::3] = per_leg
    return out


def _frozen(values: ArrayLike, kind: type = np.float64) -> NDArray[np.generic]:
    if isinstance(values, np.ndarray) and values.dtype == kind and not values.flags.writeable:
        return values
    out: NDArray[np.generic] = np.array(values, dtype=kind)
    out.flags.writeable = False
    return out
