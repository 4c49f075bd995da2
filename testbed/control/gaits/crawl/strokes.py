"""Where the pistons of the ropes' traction devices are, computed from the commands: no sensor
measures it.

A device at the end of its stroke goes back while a clamp holds its rope, and one that is not wanted
for a moment does so as well (laws/traction.py). So a body that rests altogether while one device
goes back lets the other one go back beside it; one that creeps on waits twice.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.compiled import njit
from testbed.formats.arrays import Array, Flags
from testbed.formats.records import Records
from testbed.laws.traction import (
    GRIPPED,
    IDLE_S,
    RESERVE_M,
    STILL_M_S,
    TractionParameters,
    TractionState,
    goes_back_at_rest,
    traction_step,
)
from testbed.machine.names import SIDES
from testbed.machine.scale import ROBOCLIMBER, Scale

STEPS = 10
"""Steps of the law in one tick of control."""
RENEWING_S = IDLE_S + 0.3
"""Within this time of rest a device has begun to go back."""
WORN_SHARE = 0.6
"""A stroke of which more is left is not given up for a new one (E)."""
END_M = 0.004
"""So near to the end of a stroke the body rests, that both devices go back together (E)."""


class Strokes:
    """Both devices of a machine, left and right."""

    def __init__(self, device: Any, stiffness_ea_n: float, scale: Scale = ROBOCLIMBER) -> None:
        """Device: TractionParameters of one; stiffness_ea_n: of the ropes, by strain."""
        self._device = np.array([device])
        self._state = TractionState.zeros(len(SIDES))
        self._state["way"], self._state["place"] = -1.0, RESERVE_M
        self._end_m = scale.length * END_M
        self._hauls = np.ones(len(SIDES), dtype=bool)
        self._renewing_s = np.inf
        self._rested = False
        """Whether the body has rested at this end of a stroke."""
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
        place, stroke = self._state["place"], self._device["stroke"]
        left = np.where(self._hauls, stroke - place, place)
        return np.where(stroke > 0.0, left, np.inf)

    @property
    def reserve_m(self) -> Array:
        """(2) rope that each device can pay out at the beginning of a stroke."""
        return np.where(self._device["stroke"] > 0.0, RESERVE_M, np.inf).repeat(len(SIDES))

    @property
    def goes_back(self) -> Flags:
        """(2) whether a device would go back at rest."""
        device = self._device[0]
        return np.array([goes_back_at_rest(state, device) for state in self._state])

    def renew(self, way_m: float) -> None:
        """Let the body rest until both devices have gone back for whole strokes, if one does not
        last for so much rope, is not as good as new either, and would go back.
        """
        whole = float(self._device["stroke"][0]) - RESERVE_M
        self._rest_for(self.left_m < min(way_m, WORN_SHARE * whole))

    def _rest_for(self, worn: Flags) -> None:
        if (worn & self.goes_back).any() and self._renewing_s >= RENEWING_S:
            self._renewing_s = 0.0

    def follow(self, rates_m_s: Array, tension_n: Array, supply_pa: float, dt: float) -> None:
        """What the devices do in the dt s in which they are commanded `rates_m_s` (2; negative
        hauls in), with tension_n (2) measured and the supply at supply_pa, gauge.
        """
        moves = np.abs(rates_m_s) > STILL_M_S
        self._hauls = np.where(moves, rates_m_s < 0.0, self._hauls)
        self._renewing_s += dt
        follow_strokes(self._state, self._device, rates_m_s, tension_n, supply_pa, dt)

    def readiness(self) -> float:
        """0 to 1: how fast the body may move for the strokes' sake.

        A device that would not go back at rest, or has not, is let run to its end.
        """
        if not self.gripped:
            self._rested = False
            return 0.0
        worn = self.left_m < self._end_m
        if worn.any() and not self._rested:
            self._rested = True
            self._rest_for(worn)
        return 1.0 if self._renewing_s >= RENEWING_S else 0.0


@njit
def follow_strokes(
    states: Records[TractionState],
    device: Records[TractionParameters],
    rates: Array,
    tension: Array,
    supply_pa: float,
    dt: float,
) -> None:
    """See Strokes.follow."""
    for side in range(states.shape[0]):
        for _ in range(STEPS):
            traction_step(
                states[side], device[0], rates[side], tension[side], supply_pa, dt / STEPS
            )
