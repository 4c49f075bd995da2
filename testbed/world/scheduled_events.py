"""What happens to the machine: events of the scenario, pushes while they last, ropes that part."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.laws.oil import ATMOSPHERE_PA
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.scenario.events import (
    CutRope,
    FailSensor,
    Payload,
    SetFriction,
    SetSupply,
    Shove,
    share_of_tick,
)
from testbed.world import sensing
from testbed.world.assembly import Assembled


class ScheduledEvents:
    """The events still to come, each let happen in its time, and what keeps on acting of them."""

    def __init__(self, machine: Assembled, row: NDArray[Any], events: Iterable[Any]) -> None:
        self._machine, self._row = machine, row
        self._pending = sorted(events, key=lambda event: event.at_s)
        self._shoves: list[tuple[Shove, float]] = []
        """Pushes under way, each with the time that it still lasts, s."""
        self._was_whole = machine.board.ropes["whole"] != 0.0

    def due(self, t: float) -> list[Any]:
        """The events whose time has come, the earliest first; they are pending no longer."""
        due = [event for event in self._pending if event.at_s <= t + 1e-9]
        del self._pending[: len(due)]
        return due

    def happen(self, event: Any) -> None:
        """Let an event happen to the machine; those that a gait carries out do nothing here."""
        m = self._machine
        if isinstance(event, CutRope):
            side = SIDES.index(event.rope)
            m.board.ropes[side].whole = 0.0
            self._was_whole[side] = False
        elif isinstance(event, SetSupply):
            m.board.unit.set_pressure = event.pressure_pa + ATMOSPHERE_PA
        elif isinstance(event, FailSensor):
            axis, chamber = AXES.index(event.at), sensing.CHAMBERS.index(event.chamber)
            reading = float(self._row[0][f"pressure_{event.chamber}"][axis])
            sensing.fail(
                m.board.transducers[chamber, axis], reading if event.how == "stuck" else 0.0
            )
        elif isinstance(event, Shove):
            self._shoves.append((event, event.duration_s))
        elif isinstance(event, SetFriction):
            m.set_friction(event.friction)
        elif isinstance(event, Payload):
            m.engine.add_store_mass(event.mass_kg)

    def push(self, dt: float) -> None:
        """Put the pushes of the tick of dt s that begins on the board: on the body, and on each
        foot. A push that ends within the tick acts all through it with the force that gives the
        same momentum.
        """
        if not self._shoves:
            return
        board = self._machine.board
        board["shove"], board["foot_shove"] = 0.0, 0.0
        for shove, left_s in self._shoves:
            share = share_of_tick(0.0, dt, 0.0, left_s)
            force_n = share * np.array(shove.force_in_world_n)
            if shove.at == "body":
                board["shove"] += force_n
            else:
                board["foot_shove"][LEGS.index(shove.at)] += force_n
        left = [(shove, left_s - dt) for shove, left_s in self._shoves]
        self._shoves = [(shove, left_s) for shove, left_s in left if left_s > -dt]

    def broken_ropes(self) -> list[str]:
        """The ropes that have parted by themselves since this was last asked."""
        whole = self._machine.board.ropes["whole"] != 0.0
        broken = [SIDES[k] for k in (self._was_whole & ~whole).nonzero()[0]]
        self._was_whole &= whole
        return broken
