"""What the ropes' traction devices are at, reckoned from what they were told: nothing on board says
where their pistons are.

A device at the end of its stroke goes back while a clamp holds its rope, and one that is not wanted
for a moment does so as well (laws/traction.py). So a body that rests altogether while one device
goes back lets the other one go back beside it; one that creeps on waits twice.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.compiled import njit
from testbed.formats.arrays import Array
from testbed.laws.traction import GRIPPED, RESERVE_M, TractionState, traction_step
from testbed.machine.names import SIDES
from testbed.machine.scale import ROBOCLIMBER, Scale

STEPS = 10
"""Steps of the law in one tick of control."""
HAULING_M_S = 1.0e-3
"""A rope that moves by less has no stroke to end soon."""
NEAR_END_M = 0.006
"""So near to the end of a stroke the body slows down (E)."""
END_SHARE = 0.3
"""And to this share of its speed, at which it comes to the end (E)."""


class Strokes:
    """Both devices of a machine, left and right."""

    def __init__(self, device: Any, stiffness_ea_n: float, scale: Scale = ROBOCLIMBER) -> None:
        """Device: TractionParameters of one; stiffness_ea_n: of the ropes, by strain."""
        self._device = np.array([device])
        self._state = TractionState.zeros(len(SIDES))
        self._state["way"], self._state["place"] = -1.0, RESERVE_M
        self._near_m = scale.length * NEAR_END_M
        self._rates = np.zeros(len(SIDES))
        self.stiffness_ea_n = stiffness_ea_n

    @property
    def owed_m(self) -> Array:
        """(2) rope that was wanted and is not yet paid out; negative: not yet hauled in."""
        return np.asarray(self._state["owed"])

    @property
    def gripped(self) -> bool:
        """Whether both ropes can be moved."""
        return bool((self._state["mode"] == GRIPPED).all())

    @property
    def left_m(self) -> Array:
        """(2) what is left of the strokes in the way that the ropes are moved."""
        place = self._state["place"]
        left = np.where(self._rates < 0.0, self._device["stroke"] - place, place)
        ends = (np.abs(self._rates) > HAULING_M_S) & (self._device["stroke"] > 0.0)
        return np.where(ends, left, np.inf)

    def follow(self, rates_m_s: Array, tension_n: Array, supply_pa: float, dt: float) -> None:
        """What the devices do in the dt s in which they are told `rates_m_s` (2; negative hauls
        in), with tension_n (2) measured and the supply at supply_pa, gauge.
        """
        self._rates = rates_m_s
        follow_strokes(self._state, self._device, rates_m_s, tension_n, supply_pa, dt)

    def readiness(self) -> float:
        """0 to 1: how fast the body may move for the strokes' sake."""
        if not self.gripped:
            return 0.0
        return min(max(float(self.left_m.min()) / self._near_m, END_SHARE), 1.0)


@njit
def follow_strokes(
    states: Any, device: Any, rates: Any, tension: Any, supply_pa: float, dt: float
) -> None:
    """See Strokes.follow."""
    for side in range(states.shape[0]):
        for _ in range(STEPS):
            traction_step(
                states[side], device[0], rates[side], tension[side], supply_pa, dt / STEPS
            )
