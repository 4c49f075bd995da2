"""The simulation loop: the world, the machine's electronics, and the order of one step.

Simulation.STEP lists the parts of a step in order: engine, sensors, estimators, recorder, then the
slow tick (events, drill, gait, judge, ground), and finally what acts in the next step (valve loops
and plant). Sensors see the state after the engine's step; the valve loops act on it in the next
one. Gaits, valve loops and estimators get measurements only, never the truth.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.control.gait import Command, Measured, SetPoints
from testbed.control.gaits.chain import chain_in
from testbed.control.gaits.table import NOTHING_OWN, OwnParts
from testbed.errors import InputError, SimulationFault
from testbed.estimation.detectors.table import LIVE
from testbed.estimation.estimator import SHIPPED
from testbed.estimation.live.selected import SelectedDetector, SelectedEstimator
from testbed.formats.arrays import Array
from testbed.formats.sockets import user_code
from testbed.machine.names import VERTICAL
from testbed.recording.rows import DataRow
from testbed.scenario.events import LiftFoot, SetRope, Stop, Turn
from testbed.scenario.machines import machines_of
from testbed.scenario.scenario import Scenario
from testbed.world import sensing
from testbed.world.assembly import Assembled, assemble
from testbed.world.compiled_step import (
    CONTROL,
    DATA_COLUMNS,
    ESTIMATE,
    FEET,
    MOVE,
    PLACE,
    PLANT,
    RECORD,
    SENSE,
    SLOW,
    TRUTH_COLUMNS,
    RecordedRow,
    between_steps,
    check_rows,
    schedule_of,
)
from testbed.world.drilling.drilling import DrillHold, DrillReporter, drill_known
from testbed.world.saved import State, restore, save
from testbed.world.scheduled_events import ScheduledEvents
from testbed.world.verdict import LOOK_TICKS

SAMPLES = 1000
"""Noise is drawn for so many samples at a time."""


class Simulation:
    """A running scenario. `run_block(n)` returns the next n rows of data and truth, until
    `finished`.
    """

    def __init__(
        self,
        scenario: Scenario,
        model: str | Path | None = None,
        gui: bool = False,
        own: OwnParts = NOTHING_OWN,
    ) -> None:
        self.scenario, self._model, self._own = scenario, model, own
        self.has_window = gui
        self.machines = machines_of(scenario)
        self.machine: Assembled = assemble(scenario, self.machines, model, gui, own)
        self.data_columns, self.truth_columns = list(DATA_COLUMNS), list(TRUTH_COLUMNS)
        self.events: list[dict[str, Any]] = list(self.machine.start_events)
        self.finished = False
        self._step = 0
        self._block = RecordedRow.zeros(0)
        self.dt = 1.0 / scenario.rates.physics_hz
        detector, method = scenario.estimator.detector, scenario.estimator.method
        chain_is_all = (detector, method) == (LIVE, SHIPPED)
        self._schedule = schedule_of(scenario.rates, scenario.duration_s, chain_is_all)
        self._last = self._schedule.last
        self._row = DataRow.zeros()
        self._noise = sensing.Noise.zeros(SAMPLES)
        self._hold, self._reporter = DrillHold(), DrillReporter(self.machine.drill)
        self._chain = chain_in(self.machine.gait)
        m = self.machine
        self._scheduled = ScheduledEvents(m, self._row, scenario.events)
        self._row["reference"] = m.start_joints
        self._row["carrying"] = 1.0
        self._ticks = -1
        self._command = Command(m.start_joints)
        self._set_points = SetPoints(m.start_joints)
        self._resting = True
        self._nowhere = RecordedRow.zeros()
        self._fixed = m.boards, (m.chain.belief, m.chain.state), self._noise, self._row
        body, axes = m.boards["body"], m.boards["axes"]
        self._watched = body["position"][0], body["quaternion"][0], axes["a"]["pressure"][0]
        self._judge = None if chain_is_all else SelectedDetector(detector, m.chain.belief)
        self._method = None
        if method != SHIPPED:
            self._method = SelectedEstimator(method, float(m.chain.belief["dt"][0]))
        m.engine.read(m.boards["engine"])
        self._do(PLACE | SENSE | ESTIMATE)
        drill_known(m.drill, self._row[0])
        self._expect()
        self._tick(0.0)
        m.chain.forget()  # the first sample is not recorded, and estimates come from recorded ones alone
        self._do(CONTROL | PLANT)

    # ---- one step --------------------------------------------------------------------------------

    STEP = (
        "give",  # joint torques, force and torque on the body, to the engine
        "advance",  # the engine by one step
        "read",  # joints and body from the engine
        "move",  # the body's motion, as the recorder and the plant know it
        "feet",  # the forces of the ground on the feet
        "sense",  # what sensors read; their delays and noise
        "estimate",  # foot loads and contact states
        "expect",  # foot loads that the model expects
        "record",  # a row of data and truth
        "happen",  # events of the scenario
        "drill",  # what the drill orders, or that it waits
        "gait",  # the command for the next tick
        "judge",  # has it fallen, slid, come to a stop?
        "ground",  # loose ground gives way
        "control",  # valve loops: set points move on, valve commands
        "plant",  # hydraulics, ropes and drill, to be given to the engine
    )
    """The parts of a step at which everything is due; other steps leave out what is not."""

    def run_block(self, rows: int) -> tuple[Array, Array]:
        """Step until `rows` rows are there or the run ends; returns data (n, ..) and truth (n,
        ..).
        """
        return self._advance(rows, self._last)

    def run_steps(self, steps: int) -> tuple[Array, Array]:
        """Make `steps` physics steps, fewer where the run ends; returns the rows recorded
        meanwhile, as run_block.
        """
        return self._advance(steps // self._schedule.record + 1, self._step + steps)

    def _advance(self, rows: int, last: int) -> tuple[Array, Array]:
        """Step until `rows` rows are there, step number `last` is done or the run ends."""
        engine, boards = self.machine.engine, self.machine.boards
        recorded = self._block = RecordedRow.zeros(rows)
        boards["clock"]["recorded"] = 0
        apply, advance, read, do = engine.apply, engine.step, engine.read, self._do
        given, state = boards["given"], boards["engine"]
        flags, count, k = self._schedule.flags, 0, self._step
        period = len(flags)
        while count < rows and k < last and not self.finished:
            apply(given)
            advance()
            read(state)
            k += 1
            self._step = k
            due = flags[k % period]
            if due & SLOW:
                with user_code():
                    self._slow_step(k, due, recorded)
            else:
                do(due, recorded)
            if due & RECORD:
                count += 1
        data, truth = self._tables(count)
        check_rows(data, truth, self.machine.judge.weight_n)
        return data, truth

    def _tables(self, count: int) -> tuple[Array, Array]:
        """The first `count` rows of the block as tables of data and truth."""
        rows = self._block[:count]
        return RecordedRow.part_as_table(rows, "known"), RecordedRow.part_as_table(rows, "truth")

    def _slow_step(self, k: int, due: int, recorded: NDArray[Any]) -> None:
        """A step at which expected loads, tasks or the judge are due: the same order, part by
        part.
        """
        if k % self._schedule.expected == 0 or self._judge is not None:
            self._do(due & (MOVE | FEET | SENSE | ESTIMATE))
            if k % self._schedule.expected == 0:
                self._expect()
            if self._judge is not None and due & ESTIMATE:
                if self._method is not None:
                    self._method.fill(self._row)
                self._judge.fill(self._row)
            self._do(due & RECORD, recorded)
        else:
            self._do(due & (MOVE | FEET | SENSE | ESTIMATE | RECORD), recorded)
        if k >= self._last:
            self.finished = True
        if k % self._schedule.tick == 0:
            self._tick(k * self.dt)
        self._do(due & (CONTROL | PLANT))

    def _do(self, due: int, recorded: NDArray[Any] | None = None) -> None:
        """Run the compiled parts of a step that the flags `due` name; a record is written to the
        next row of `recorded`.
        """
        if due & SENSE and (self._step // self._schedule.sensor) % SAMPLES == 0:
            m = self.machine
            self._noise[:] = sensing.draw_noise(SAMPLES, m.noise_rng, m.added_noise_rng)
        between_steps(due, *self._fixed, self._nowhere if recorded is None else recorded)

    def _expect(self) -> None:
        """Write the foot loads that the believed model expects into the running row."""
        row, m = self._row[0], self.machine
        row["expected"] = m.expectation.loads(
            row["position"],
            m.boards["gravity_in_body"][0],
            row["rope_tension"],
            row["attitude"],
            row,
            row["carrying"],
        )

    # ---- the slow tick ---------------------------------------------------------------------------

    def _tick(self, t: float) -> None:
        """The slow part of a step, at 100 Hz: events, drill, gait, judge and ground."""
        m = self.machine
        dt = self._schedule.tick * self.dt
        for event, happens_s in self._scheduled.due(t, dt):
            self._scheduled.happen(event, happens_s)
            self._tell(event, happens_s)
        m.drill.most_n = m.thrust.most_n
        m.drill.feed_n, m.drill.hammer = self._command.feed_n, self._command.hammer
        for news in self._drill(t):
            self.events.append({"t": t, **news})
        m.limit_thrust()
        self._reporter.report(m.boards, self._row[0])
        if m.drill.store_change_kg:
            m.engine.add_store_mass(m.drill.store_change_kg)
            m.drill.store_change_kg = 0.0
        self._scheduled.push(t, dt)
        self._follow(m.gait.command(t, dt, Measured(self._row)), t)
        self._watch(t)
        if m.footing is not None:
            b = m.board
            m.footing.update(m.feet_in_world, b.normal_force, b.ground_normals, dt)

    def _drill(self, t: float) -> list[dict[str, Any]]:
        """Advance the drill, in a chain of tasks only once it is its turn; returns its events."""
        m, dt = self.machine, self._schedule.tick * self.dt
        chain = self._chain
        if chain is None:
            return self._hold.update(m.drill, t, dt, self._command.hold_drill)
        if t < chain.drill_began_s:
            return []
        since = t - chain.drill_began_s
        news = self._hold.update(m.drill, since, dt, self._command.hold_drill)
        chain.drill_done = bool(m.drill.progress().get("done", True))
        return news

    def _follow(self, command: Command, t: float) -> None:
        """Pass a command on to the valve loops, the ropes and the running row. Set points move from
        where the last command left them, and rest if the same command is given again.
        """
        dithers = self.scenario.control.dither_m > 0.0
        if command is self._command and self._resting and not dithers:
            return
        b, dt = self.machine.board, self._schedule.tick * self.dt
        reference, rate = self._set_points.follow(command, dt)
        b.loops["reference"], b.loops["reference_rate"] = reference, rate
        b.ropes["wanted_rate"] = command.rope_rates_m_s
        self._row["carrying"] = command.stance
        self._resting = not rate.any()
        self._command = command
        if dithers:
            self._dither(t)

    def _dither(self, t: float) -> None:
        """Add a sine of `control.dither_m` and `control.dither_hz` to the vertical set points."""
        depth = self.scenario.control.dither_m
        turn = 2.0 * math.pi * self.scenario.control.dither_hz
        vertical = self.machine.board.loops[2::3]
        vertical["reference"] += depth * math.sin(turn * t)
        vertical["reference_rate"] += depth * turn * math.cos(turn * t)

    def _watch(self, t: float) -> None:
        """End the run where a rope broke, a state is not finite, or the judge says so."""
        m = self.machine
        for rope in self._scheduled.broken_ropes():
            self.events.append({"t": t, "kind": "rope_broke", "rope": rope})
            m.judge.verdict, self.finished = "rope broke", True
        place, turn, pressure = self._watched
        if not math.isfinite(place[0] + turn[0] + pressure[VERTICAL[0]]):
            raise SimulationFault(f"a state is not finite at t = {t:.3f} s")
        self._ticks += 1
        if self._ticks % LOOK_TICKS:
            return
        belly_n = m.engine.feet.forces(np.empty((4, 3)), np.empty(4))
        feet = m.feet_in_world()
        end = m.judge.look(
            t,
            m.board.rotation,
            feet,
            self._command.stance,
            m.board.normal_force > m.judge.bears_n,
            belly_n,
        )
        if end is not None:
            self.events.append(end)
            self.finished = True

    def _tell(self, event: Any, t: float) -> None:
        self.events.append({"t": t, **event.model_dump(exclude={"at_s"})})

    def last_rows(self) -> tuple[Array, Array]:
        """The rows of the last block so far: after a SimulationFault, what led to it."""
        return self._tables(int(self.machine.board.clock.recorded))

    @property
    def row(self) -> Any:
        """The running row of data: one DataRow, what the electronics know now."""
        return self._row[0]

    # ---- saved states, branches, events from outside --------------------------------------------

    def save(self, *others: Any) -> State:
        """The run at this instant (saved.py), and the objects `others` that go with it."""
        return save(self, *others)

    def restore(self, state: State, *others: Any) -> None:
        """Go on from a saved state of this scenario. Raises InputError where it belongs to
        another.
        """
        last = self._last
        restore(state, self, *others)
        self._last = last
        self.finished = self._step >= last or self.verdict != "stood"

    def branch(self, seed: int | None = None) -> Simulation:
        """An independent copy of this simulation as it is now; `seed`: with other noise onwards.

        Raises InputError if a gait or controller is an object, which two runs cannot share.
        """
        for part in (self._own.gait, self._own.controller):
            if part is not None and not isinstance(part, str | type):
                raise InputError(
                    "is an object, which two runs cannot share",
                    field="gait or controller",
                    value=type(part).__name__,
                    allowed="a class, or FILE.py:Class",
                )
        other = Simulation(self.scenario, self._model, own=self._own)
        try:
            other.restore(self.save())
        except BaseException:
            other.close()
            raise
        if seed is not None:
            other.reseed(seed)
        return other

    def reseed(self, seed: int) -> None:
        """Draw all randomness from now on from another seed."""
        m = self.machine
        m.noise_rng, m.added_noise_rng = (np.random.default_rng([seed, k]) for k in (1, 40))
        self._noise[:] = sensing.draw_noise(SAMPLES, m.noise_rng, m.added_noise_rng)
        m.drill.reseed(seed)

    def happen(self, event: Any) -> None:
        """Make an event happen now. Raises InputError for one that the gait has to carry out."""
        if isinstance(event, LiftFoot | SetRope | Stop | Turn):
            raise InputError(
                "is carried out by the task from its start on",
                field="event",
                value=event.kind,
                allowed="an event of the scenario, or one that happens to the machine",
            )
        left = self._schedule.tick - self._step % self._schedule.tick
        self._scheduled.order(event, self.t_s, left * self.dt)
        self._tell(event, self.t_s)

    # ---- queries ---------------------------------------------------------------------------------

    @property
    def t_s(self) -> float:
        """Simulated time so far, s."""
        return self._step * self.dt

    @property
    def verdict(self) -> str:
        """stood, fell, slid or rope broke."""
        return self.machine.judge.verdict

    def picture(self, width: int, height: int) -> NDArray[np.uint8]:
        """The robot on its ground with ropes and drill rod, (height, width, 3)."""
        return self.machine.picture(width, height)

    def close(self) -> None:
        """Release the engine."""
        self.machine.engine.close()
