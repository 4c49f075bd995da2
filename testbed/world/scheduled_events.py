"""What happens to the machine: events of the scenario, pushes while they last, ropes that part."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.laws.oil import ATMOSPHERE_PA
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.scenario.events import (
    A_MOMENT,
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
from testbed.world.plant import push_foot


class ScheduledEvents:
    """The events still to come, each let happen in its time, and what keeps on acting of them."""

    def __init__(self, machine: Assembled, row: NDArray[Any], events: Iterable[Any]) -> None:
        self._machine, self._row = machine, row
        self._pending = sorted(events, key=lambda event: event.at_s)
        self._shoves: list[tuple[Shove, float]] = []
        """Pushes that are not over, each with the time at which it begins, s."""
        self._whole = machine.boards["ropes"]["whole"][0]
        self._was_whole = (self._whole != 0.0).tolist()

    def due(self, t: float, dt: float) -> list[tuple[Any, float]]:
        """The events whose time has come at the tick from t to t + dt (s), the earliest first, and
        when they happen; they are pending no longer. A push happens at its own time within the
        tick, all else at its beginning.
        """
        if not self._pending:
            return []
        soon = t + (1.0 - A_MOMENT) * dt
        due = [
            (event, max(event.at_s, t) if isinstance(event, Shove) else t)
            for event in self._pending
            if event.at_s <= t + 1e-9 or (isinstance(event, Shove) and event.at_s < soon)
        ]
        taken = {id(event) for event, _ in due}
        self._pending = [event for event in self._pending if id(event) not in taken]
        return due

    def happen(self, event: Any, t: float) -> None:
        """Let an event happen to the machine; those that a gait carries out do nothing here."""
        m = self._machine
        if isinstance(event, CutRope):
            side = SIDES.index(event.rope)
            m.board.ropes[side].whole = 0.0
            self._was_whole[side] = False
        elif isinstance(event, SetSupply):
            found_pa = m.hidden.pump_pressure_factor * event.pressure_pa
            m.board.unit.set_pressure = found_pa + ATMOSPHERE_PA
        elif isinstance(event, FailSensor):
            axis, chamber = AXES.index(event.at), sensing.CHAMBERS.index(event.chamber)
            reading = float(self._row[0][f"pressure_{event.chamber}"][axis])
            sensing.fail(
                m.board.transducers[chamber, axis], reading if event.how == "stuck" else 0.0
            )
        elif isinstance(event, Shove):
            self._shoves.append((event, t))
        elif isinstance(event, SetFriction):
            m.set_friction(event.friction)
        elif isinstance(event, Payload):
            m.engine.add_store_mass(event.mass_kg)

    def push(self, t: float, dt: float) -> None:
        """Put the pushes of the time from t to t + dt (s) on the board: on the body, and on each
        foot. One that begins or ends meanwhile acts all through it with the force that gives the
        same momentum.
        """
        if not self._shoves:
            return
        board = self._machine.board
        board["shove"], board["foot_shove"] = 0.0, 0.0
        for shove, begins_s in self._shoves:
            share = share_of_tick(t, dt, begins_s, shove.duration_s)
            put_push(board, shove, share)
        self._shoves = [
            (shove, at_s) for shove, at_s in self._shoves if t < at_s + shove.duration_s
        ]

    def order(self, event: Any, t: float, rest_s: float) -> None:
        """Let an event happen now, between two ticks: what the engine is given for the next step is
        made already, and the tick lasts another `rest_s`.
        """
        self.happen(event, t)
        if not isinstance(event, Shove):
            return
        self.push(t, rest_s)
        board = self._machine.board
        share = share_of_tick(t, rest_s, t, event.duration_s)
        if event.at == "body":
            board["given"]["force"] += share * np.array(event.force_in_world_n)
            return
        pushes, leg = board["foot_shove"].copy(), LEGS.index(event.at)
        board["foot_shove"][leg] = share * np.array(event.force_in_world_n)
        push_foot(board, leg)
        board["foot_shove"] = pushes

    def broken_ropes(self) -> list[str]:
        """The ropes that have parted by themselves since this was last asked."""
        whole = [value != 0.0 for value in self._whole.tolist()]
        if whole == self._was_whole:
            return []
        ropes = zip(SIDES, self._was_whole, whole, strict=True)
        broken = [side for side, was, now in ropes if was and not now]
        self._was_whole = [was and now for was, now in zip(self._was_whole, whole, strict=True)]
        return broken


def put_push(board: Any, shove: Shove, share: float) -> None:
    """Add a push to those on the board; `share` of its force."""
    force_n = share * np.array(shove.force_in_world_n)
    if shove.at == "body":
        board["shove"] += force_n
    else:
        board["foot_shove"][LEGS.index(shove.at)] += force_n
