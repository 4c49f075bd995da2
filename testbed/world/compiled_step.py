"""What happens between two engine steps, in one compiled call: sense, estimate, record, control,
plant; and the rows that it records, which end the run where no machine can give them.

The order is that of the whole testbed (see simulation.py); the parts that are due come as flags,
which a run's Schedule has for every step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.control.valve_loop import valve_command
from testbed.errors import SimulationFault
from testbed.estimation.live.chain import ChainBelief, ChainState, step_chain
from testbed.formats.arrays import Array
from testbed.formats.records import Record, Records, part
from testbed.machine.names import AXES
from testbed.recording.rows import DataRow, TruthRow
from testbed.scenario.parts import TICK_HZ
from testbed.world import plant, sensing
from testbed.world.board import Board
from testbed.world.sensing import Noise

if TYPE_CHECKING:
    from testbed.scenario.parts import Rates

DATA_COLUMNS: tuple[str, ...] = tuple(DataRow.column_names())
TRUTH_COLUMNS: tuple[str, ...] = tuple(TruthRow.column_names())
LOADS = [
    k
    for k, name in enumerate(TRUTH_COLUMNS)
    if name.startswith(("foot_force_in_world_", "rope_force_in_world_", "drill_wrench_in_world_f"))
]
MOST_WEIGHTS = 1000.0
"""A load of so many times the weight of the machine is a fault of the simulation, no physics
(E).
"""


def check_rows(data: Array, truth: Array, weight_n: float) -> None:
    """Raise SimulationFault where a row of data or truth cannot be of a machine of this weight."""
    for name, block, columns in (("data", data, DATA_COLUMNS), ("truth", truth, TRUTH_COLUMNS)):
        finite = np.isfinite(block)
        if not finite.all():
            row, column = np.argwhere(~finite)[0]
            raise SimulationFault(
                f"{name} column {columns[column]} is not finite at t = {block[row, 0]:.3f} s"
            )
    beyond = np.abs(truth[:, LOADS]) > MOST_WEIGHTS * weight_n
    if beyond.any():
        row, column = np.argwhere(beyond)[0]
        raise SimulationFault(
            f"{TRUTH_COLUMNS[LOADS[column]]} is {truth[row, LOADS[column]]:.3g} N at "
            f"t = {truth[row, 0]:.3f} s, more than {MOST_WEIGHTS:g} times the machine's weight"
        )


SENSE, ESTIMATE, RECORD, CONTROL, PLANT, SLOW, MOVE, PLACE, FEET = 1, 2, 4, 8, 16, 32, 64, 128, 256
"""SLOW marks a step at which tasks, expected loads or the judge are due: the parts are called one
by one then. MOVE takes over the engine's pose and belongs to every step, FEET finds the foot forces
with it; PLACE does so for a body at rest."""


class RecordedRow(Record):
    """One row of both series."""

    known = part(DataRow, "row of `data`")
    truth = part(TruthRow, "row of `truth`")


@njit
def between_steps(
    due: int,
    boards: Records[Board],
    estimator: tuple[Records[ChainBelief], Records[ChainState]],
    noises: Records[Noise],
    row: Records[DataRow],
    recorded: NDArray[Any],
) -> None:
    """Do the parts named by the flags `due`, after the engine steps that the board's clock counts.

    boards, estimator, row: arrays of one record each, `row` the running one; noises: taken in turn
    by the samples; recorded: RecordedRow (n,), filled from the board's clock.recorded on.
    """
    board = boards[0]
    if due & (MOVE | PLACE):
        plant.follow_engine(board, due & PLACE != 0, due & FEET != 0)
    t = board.clock.step * board.clock.step_s
    if due & SENSE:
        sample = board.clock.step // board.clock.steps_a_sample
        sensing.sense(row[0], board, noises[sample % noises.shape[0]], t, sample)
    if due & ESTIMATE:
        beliefs, states = estimator
        step_chain(row[0], beliefs[0], states[0])
    if due & RECORD:
        recorded["known"][board.clock.recorded] = row[0]
        plant.write_truth(recorded[board.clock.recorded].truth, board, t)
        board.clock.recorded += 1
    if due & CONTROL:
        control(row[0], board)
    if due & PLANT:
        plant.plant_step(board)


@njit
def control(row: DataRow, board: Board) -> None:
    """Set points move on, and the valves get their commands."""
    dt = board.clock.control_step_s
    for index in range(len(AXES)):
        loop = board.loops[index]
        loop.reference += loop.reference_rate * dt
        row.reference[index] = loop.reference
        locked = board.valves_locked != 0
        board.inputs[index].command = (
            0.0 if locked else valve_command(loop, row.position[index], dt)
        )


@dataclass(frozen=True)
class Schedule:
    """Periods in physics steps."""

    flags: tuple[int, ...]
    """What is due after step k, as flags for between_steps: entry k modulo the length."""
    tick: int
    """The slow tick: events, drill, gait, judge, ground."""
    expected: int
    """Foot loads that the model expects."""
    sensor: int
    record: int
    last: int
    """Number of the last step, a tick."""


def schedule_of(rates: Rates, duration_s: float, chain_is_all: bool) -> Schedule:
    """The schedule of a run of duration_s (s); `chain_is_all`: the compiled chain steps every
    estimate.
    """
    hz = rates.physics_hz
    tick = max(1, hz // TICK_HZ)
    every = {
        SENSE: hz // rates.sensor_hz,
        ESTIMATE: hz // rates.estimator_hz,
        RECORD: hz // rates.record_hz,
        CONTROL: hz // rates.control_hz,
        PLANT: 1,
        MOVE: 1,
        FEET: 1,
    }
    slow = [tick, hz // rates.expected_loads_hz]
    if not chain_is_all:
        slow.append(every[ESTIMATE])
    flags = tuple(
        sum(flag for flag, steps in every.items() if k % steps == 0)
        | (SLOW if any(k % steps == 0 for steps in slow) else 0)
        for k in range(math.lcm(*every.values(), *slow))
    )
    last = max(math.ceil(duration_s * hz / tick - 1e-9), 1) * tick
    return Schedule(flags, tick, slow[1], every[SENSE], every[RECORD], last)
