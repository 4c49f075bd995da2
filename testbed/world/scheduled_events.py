"""What happens to the machine: events of the scenario, pushes while they last, ropes that part."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from numpy.typing import NDArray

from testbed.laws.oil import ATMOSPHERE_PA
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.scenario.events import CutRope, FailSensor, Payload, SetFriction, SetSupply, Shove
from testbed.world import sensing
from testbed.world.assembly import Assembled


class ScheduledEvents:
    """The events still to come, each let happen in its time, and what keeps on acting of them."""

    def __init__(self, machine: Assembled, row: NDArray[Any], events: Iterable[Any]) -> None:
        self._machine, self._row = machine, row
        self._pending = sorted(events, key=lambda event: event.at_s)
        self._shoves: list[Shove] = []
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
            self._shoves.append(event)
        elif isinstance(event, SetFriction):
            m.set_friction(event.friction)
        elif isinstance(event, Payload):
            m.engine.add_store_mass(event.mass_kg)

    def push(self, t: float) -> None:
        """Put the pushes of this instant on the board: on the body, and on each foot."""
        if not self._shoves:
            return
        board = self._machine.board
        board["shove"], board["foot_shove"] = 0.0, 0.0
        for shove in self._shoves:
            if shove.at_s <= t < shove.at_s + shove.duration_s:
                if shove.at == "body":
                    board["shove"] += shove.force_in_world_n
                else:
                    board["foot_shove"][LEGS.index(shove.at)] += shove.force_in_world_n

    def broken_ropes(self) -> list[str]:
        """The ropes that have parted by themselves since this was last asked."""
        whole = self._machine.board.ropes["whole"] != 0.0
        broken = [SIDES[k] for k in (self._was_whole & ~whole).nonzero()[0]]
        self._was_whole &= whole
        return broken
