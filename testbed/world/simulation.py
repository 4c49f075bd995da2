"""One run: the world, the machine's electronics and the recorder's rows, and the order of one step.

Simulation.STEP lists the parts of a step in their order: the engine, then sensors and estimators,
the recorder, then the slow tick (events, drill, gait, judge, ground), last what acts in the next
step: valve loops and plant. Sensors see the state after the engine's step; the loops act on it in
the next one. Gaits, valve loops and estimators are handed measurements only.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.control.command import Command, SetPoints
from testbed.control.gaits.chain import chain_in
from testbed.control.gaits.table import NOTHING_OWN, OwnParts
from testbed.control.measured import Measured
from testbed.errors import InputError, SimulationFault
from testbed.estimation.detectors.table import LIVE
from testbed.estimation.estimator import SHIPPED
from testbed.estimation.live.chosen import ChosenEstimator
from testbed.estimation.live.judged import Judge
from testbed.formats.sockets import user_code
from testbed.laws.oil import ATMOSPHERE_PA
from testbed.machine.folder import is_shipped_urdf
from testbed.machine.names import AXES, LEGS, SIDES, VERTICAL
from testbed.recording.rows import DataRow, TruthRow
from testbed.scenario.events import (
    CutRope,
    FailSensor,
    LiftFoot,
    Payload,
    SetFriction,
    SetRope,
    SetSupply,
    Shove,
)
from testbed.scenario.machines import machines_of
from testbed.scenario.scenario import Scenario
from testbed.world import first_start, sensing
from testbed.world.assembly import Assembled, assemble
from testbed.world.between import (
    CONTROL,
    ESTIMATE,
    FEET,
    MOVE,
    PLACE,
    PLANT,
    RECORD,
    SENSE,
    SLOW,
    RecordedRow,
    between_steps,
)
from testbed.world.drilling.drilling import drill_known
from testbed.world.drilling.hold import DrillHold
from testbed.world.progress import progress
from testbed.world.saved import State, restore, save
from testbed.world.verdict import LOOK_TICKS

Array = NDArray[np.float64]
TICK_HZ = 100
DATA_COLUMNS: tuple[str, ...] = tuple(DataRow.column_names())
TRUTH_COLUMNS: tuple[str, ...] = tuple(TruthRow.column_names())
SAMPLES = 1000
"""Samples whose noise is drawn at once."""
LOADS = [
    k
    for k, name in enumerate(TRUTH_COLUMNS)
    if name.startswith(("foot_force_in_world_", "rope_force_in_world_", "drill_wrench_in_world_f"))
]
MOST_WEIGHTS = 1000.0
"""A load of so many times the weight of the machine is a fault of the simulation, no physics
(E).
"""


class Simulation:
    """A scenario on its way. `run_block(n)` gives the next n rows of data and truth until
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
        compiled = first_start.beside()
        self.machines = machines_of(scenario)
        self.machine: Assembled = assemble(scenario, self.machines, model, gui, own)
        self.data_columns, self.truth_columns = list(DATA_COLUMNS), list(TRUTH_COLUMNS)
        self.events: list[dict[str, Any]] = list(self.machine.start_events)
        self.finished = False
        self._step = 0
        self._block = RecordedRow.zeros(0)
        rates = scenario.rates
        hz = rates.physics_hz
        self.dt = 1.0 / hz
        self._every_tick = max(1, hz // TICK_HZ)
        self._last = (
            math.ceil(scenario.duration_s * hz / self._every_tick - 1e-9) * self._every_tick
        )
        self._every_sensor = hz // rates.sensor_hz
        self._flags = self._schedule()
        self._every_expected = hz // rates.expected_loads_hz
        self._pending = sorted(scenario.events, key=lambda e: e.at_s)
        self._shoves: list[Shove] = []
        self._row = DataRow.zeros()
        self._noise = sensing.Noise.zeros(SAMPLES)
        self._hold = DrillHold()
        self._chain = chain_in(self.machine.gait)
        m, b = self.machine, self.machine.board
        self._rope_was_whole = [bool(whole) for whole in b.ropes["whole"]]
        self._row["reference"] = m.start_joints
        self._row["carrying"] = 1.0
        self._ticks = -1
        self._command = Command(m.start_joints)
        self._set_points = SetPoints(m.start_joints)
        self._resting = True
        self._nowhere = RecordedRow.zeros()
        self._fixed = m.boards, (m.chain.belief, m.chain.state), self._noise, self._row
        detector = scenario.estimator.detector
        method = scenario.estimator.method
        self._method = self._judge = None
        if (detector, method) != (LIVE, SHIPPED):  # those two the chain steps itself
            self._judge = Judge(detector, m.chain.belief)
        if method != SHIPPED:
            self._method = ChosenEstimator(method, float(m.chain.belief["dt"][0]))
        compiled()
        m.engine.read(m.boards["engine"])
        self._do(PLACE | SENSE | ESTIMATE)
        self._expect()
        self._tick(0.0)
        m.chain.forget()  # the first sample is not recorded: what is recorded is all that the estimates come from
        self._do(CONTROL | PLANT)

    def _schedule(self) -> list[int]:
        """What is due after step k, as flags for between_steps, over the longest period; index k
        modulo its length.
        """
        r, hz = self.scenario.rates, self.scenario.rates.physics_hz
        every = {
            SENSE: hz // r.sensor_hz,
            ESTIMATE: hz // r.estimator_hz,
            RECORD: hz // r.record_hz,
            CONTROL: hz // r.control_hz,
            PLANT: 1,
            MOVE: 1,
            FEET: 1,
        }
        slow: tuple[int, ...] = (self._every_tick, hz // r.expected_loads_hz)
        chosen = self.scenario.estimator
        if (chosen.detector, chosen.method) != (LIVE, SHIPPED):
            slow = (*slow, every[ESTIMATE])  # what the chain does not step itself
        length = math.lcm(*every.values(), *slow)
        return [
            sum(flag for flag, n in every.items() if k % n == 0)
            | (SLOW if any(k % n == 0 for n in slow) else 0)
            for k in range(length)
        ]

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
    """A step at which everything is due, part by part; a step leaves out what is not."""

    def run_block(self, rows: int) -> tuple[Array, Array]:
        """Step until `rows` rows are there or the run ends; returns data (n, ..) and truth (n,
        ..).
        """
        return self._advance(rows, self._last)

    def run_steps(self, steps: int) -> tuple[Array, Array]:
        """Make `steps` physics steps, fewer where the run ends; returns the rows recorded
        meanwhile, as run_block.
        """
        every = self.scenario.rates.physics_hz // self.scenario.rates.record_hz
        return self._advance(steps // every + 1, self._step + steps)

    def _advance(self, rows: int, last: int) -> tuple[Array, Array]:
        """Step until `rows` rows are there, step number `last` is done or the run ends."""
        engine, boards = self.machine.engine, self.machine.boards
        recorded = self._block = RecordedRow.zeros(rows)
        boards["clock"]["recorded"] = 0
        apply, advance, read, do = engine.apply, engine.step, engine.read, self._do
        given, state = boards["given"], boards["engine"]
        flags, period, count, k = self._flags, len(self._flags), 0, self._step
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
        self._check_rows(data, truth)
        return data, truth

    def _tables(self, count: int) -> tuple[Array, Array]:
        """The first `count` rows of the block as tables of data and truth."""
        rows = self._block[:count]
        return RecordedRow.part_as_table(rows, "known"), RecordedRow.part_as_table(rows, "truth")

    def _slow_step(self, k: int, due: int, recorded: NDArray[Any]) -> None:
        """A step at which expected loads, tasks or the judge are due: the same order, part by
        part.
        """
        if k % self._every_expected == 0 or self._judge is not None:
            self._do(due & (MOVE | FEET | SENSE | ESTIMATE))
            if k % self._every_expected == 0:
                self._expect()
            if self._judge is not None and due & ESTIMATE:
                if self._method is not None:
                    self._method.estimate(self._row)
                self._judge.judge(self._row)
            self._do(due & RECORD, recorded)
        else:
            self._do(due & (MOVE | FEET | SENSE | ESTIMATE | RECORD), recorded)
        if k >= self._last:
            self.finished = True
        if k % self._every_tick == 0:
            self._tick(k * self.dt)
        self._do(due & (CONTROL | PLANT))

    def _do(self, due: int, recorded: NDArray[Any] | None = None) -> None:
        """Do what the flags `due` name; a record goes to the next row of `recorded`."""
        if due & SENSE and (self._step // self._every_sensor) % SAMPLES == 0:
            m = self.machine
            self._noise[:] = sensing.draw_noise(SAMPLES, m.noise_rng, m.added_noise_rng)
        between_steps(due, *self._fixed, self._nowhere if recorded is None else recorded)

    def _expect(self) -> None:
        row, m = self._row[0], self.machine
        row["expected"] = m.expectation.loads(
            row["position"],
            m.boards["gravity_in_body"][0],
            row["rope_tension"],
            row["attitude"],
            m.drill_known(),
            row["carrying"],
        )

    # ---- the slow tick ---------------------------------------------------------------------------

    def _tick(self, t: float) -> None:
        m = self.machine
        while self._pending and self._pending[0].at_s <= t + 1e-9:
            self._happen(self._pending.pop(0), t)
        m.drill.most_n = m.thrust.most_n
        m.drill.feed_n, m.drill.hammer = self._command.feed_n, self._command.hammer
        for news in self._drill(t):
            self.events.append({"t": t, **news})
        m.limit_thrust()
        drill_known(m.drill, self._row[0])
        if m.drill.store_change_kg:
            m.engine.add_store_mass(m.drill.store_change_kg)
            m.drill.store_change_kg = 0.0
        if self._shoves:
            m.board["shove"], m.board["foot_shove"] = 0.0, 0.0
            for shove in self._shoves:
                if shove.at_s <= t < shove.at_s + shove.duration_s:
                    if shove.at == "body":
                        m.board["shove"] += shove.force_in_world_n
                    else:
                        m.board["foot_shove"][LEGS.index(shove.at)] += shove.force_in_world_n
        self._follow(m.gait.command(t, self._every_tick * self.dt, self._measured()), t)
        self._watch(t)
        if m.footing is not None:
            b = m.board
            m.footing.update(
                m.feet_in_world, b.normal_force, b.ground_normals, self._every_tick * self.dt
            )

    def _drill(self, t: float) -> list[dict[str, Any]]:
        """Let the drill work, in a chain of tasks from its turn on; returns what has happened."""
        m, dt = self.machine, self._every_tick * self.dt
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
        """Hand a command to the loops, the ropes and the rows: the one place where set points begin
        to move.

        They move at their rate from where the last command left them (between_steps adds it up,
        tick by tick), and rest where the same command comes again.
        """
        dithers = self.scenario.control.dither_m > 0.0
        if command is self._command and self._resting and not dithers:
            return
        b, dt = self.machine.board, self._every_tick * self.dt
        reference, rate = self._set_points.follow(command, dt)
        b.loops["reference"], b.loops["reference_rate"] = reference, rate
        b.ropes["wanted_rate"] = command.rope_rates_m_s
        self._row["carrying"] = command.stance
        self._resting = not rate.any()
        self._command = command
        if dithers:
            self._dither(t)

    def _dither(self, t: float) -> None:
        """Let the vertical set points wander about where they are."""
        depth = self.scenario.control.dither_m
        turn = 2.0 * math.pi * self.scenario.control.dither_hz
        vertical = self.machine.board.loops[2::3]
        vertical["reference"] += depth * math.sin(turn * t)
        vertical["reference_rate"] += depth * turn * math.cos(turn * t)

    def _measured(self) -> Measured:
        """This tick's row of data as control sees it."""
        return Measured(self._row)

    def _watch(self, t: float) -> None:
        m = self.machine
        whole = m.boards["ropes"]["whole"][0].tolist()
        for k, side in enumerate(SIDES):
            if self._rope_was_whole[k] and whole[k] == 0.0:
                self._rope_was_whole[k] = False
                self.events.append({"t": t, "kind": "rope_broke", "rope": side})
                m.judge.verdict, self.finished = "rope broke", True
        body, pressure = m.boards["body"], m.boards["axes"]["a"]["pressure"]
        watched = body["position"][0, 0] + body["quaternion"][0, 0] + pressure[0, VERTICAL[0]]
        if not math.isfinite(watched):
            raise SimulationFault(f"a state is not finite at t = {t:.3f} s")
        self._ticks += 1
        if self._ticks % LOOK_TICKS:
            return
        belly_n = m.engine.contacts(np.empty((4, 3)), np.empty(4))
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

    def _happen(self, event: Any, t: float) -> None:
        m = self.machine
        self.events.append({"t": t, **event.model_dump(exclude={"at_s"})})
        if isinstance(event, CutRope):
            side = SIDES.index(event.rope)
            m.board.ropes[side].whole = 0.0
            self._rope_was_whole[side] = False
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

    def _check_rows(self, data: Array, truth: Array) -> None:
        """Raise SimulationFault for rows that no machine can give: not finite, or loads beyond all
        physics.
        """
        for name, block, columns in (("data", data, DATA_COLUMNS), ("truth", truth, TRUTH_COLUMNS)):
            finite = np.isfinite(block)
            if not finite.all():
                row, column = np.argwhere(~finite)[0]
                raise SimulationFault(
                    f"{name} column {columns[column]} is not finite at t = {block[row, 0]:.3f} s"
                )
        beyond = np.abs(truth[:, LOADS]) > MOST_WEIGHTS * self.machine.judge.weight_n
        if beyond.any():
            row, column = np.argwhere(beyond)[0]
            raise SimulationFault(
                f"{TRUTH_COLUMNS[LOADS[column]]} is {truth[row, LOADS[column]]:.3g} N at t = {truth[row, 0]:.3f} s, "
                f"more than {MOST_WEIGHTS:g} times the machine's weight"
            )

    def last_rows(self) -> tuple[Array, Array]:
        """The rows of the last block as far as it came: after a SimulationFault, what led to it."""
        return self._tables(int(self.machine.board.clock.recorded))

    @property
    def row(self) -> Any:
        """The running row of data: one DataRow, what the electronics know now."""
        return self._row[0]

    # ---- other ways to go on ---------------------------------------------------------------------

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
        """Another simulation that stands where this one does and goes its own way; `seed`: with
        other noise from here on.

        Raises InputError where a gait or controller came as an object: two runs cannot share it.
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
        """Let everything random that is still to come come from another seed."""
        m = self.machine
        m.noise_rng, m.added_noise_rng = (np.random.default_rng([seed, k]) for k in (1, 40))
        self._noise[:] = sensing.draw_noise(SAMPLES, m.noise_rng, m.added_noise_rng)

    def happen(self, event: Any) -> None:
        """Let an event happen now, whatever its time. Raises InputError for one that a gait carries
        out.
        """
        if isinstance(event, LiftFoot | SetRope):
            raise InputError(
                "is carried out by the task from its start on",
                field="event",
                value=event.kind,
                allowed="an event of the scenario, or one that happens to the machine",
            )
        self._happen(event, self.t_s)

    # ---- what others ask -------------------------------------------------------------------------

    @property
    def t_s(self) -> float:
        """Simulated time so far, s."""
        return self._step * self.dt

    @property
    def verdict(self) -> str:
        """stood, fell, slid or rope broke."""
        return self.machine.judge.verdict

    def summary(self) -> dict[str, Any]:
        """What only the world knows of the whole run."""
        m = self.machine
        return {
            "foot_slip_m": m.judge.slip_m,
            "rope_slip_m": float(m.board.devices["slipped"].max()),
            "turn_max_deg": math.degrees(m.judge.turn_rad),
            **m.drill.summary(),
            **m.settlement(),
            "progress": progress(m.gait, m.drill, self.t_s),
            "pump_work_j": float(m.board.supply.pump_work),
            "oil_temperature_degc": float(m.board.supply.temperature),
            "total_mass_kg": float(m.engine.masses().sum()),
            "thrust_reserve_n": m.thrust.reserve_n,
            "body_travel_m": float(np.linalg.norm(m.origin_in_world() - m.start_base)),
        }

    def surveyed(self) -> dict[str, Any]:
        """What people measured of the place and the load before the run, and what is believed of
        the machine: its URDF, how far it may be from its drawing.
        """
        directions = self.machine.expectation.rope_directions_in_world
        believed_urdf = self.machines.belief.urdf
        return {
            "rope_directions_in_world": {s: directions[k].tolist() for k, s in enumerate(SIDES)},
            "payload_kg": self.scenario.carried_kg,
            "urdf": None if is_shipped_urdf(believed_urdf) else str(believed_urdf),
            "tolerances": self.scenario.tolerances,
        }

    def picture(self, width: int, height: int) -> NDArray[np.uint8]:
        """The robot on its ground with ropes and drill rod, (height, width, 3)."""
        return self.machine.picture(width, height)

    def close(self) -> None:
        """Give the engine back."""
        self.machine.engine.close()
