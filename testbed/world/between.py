"""What happens between two engine steps, in one compiled call: sense, estimate, record, control, plant.

The order is that of the whole testbed (see simulation.py); the parts that are due come as flags.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.compiled import njit
from testbed.control.valve_loop import valve_command
from testbed.estimation.live import chain_kernel
from testbed.formats.records import Record, part
from testbed.laws.drill import (
    IN_HOLE_KG,
    IN_MAST_KG,
    KNOWN,
    MAST_MIDDLE,
    REACTION,
    STORED_KG,
    THRUST,
)
from testbed.recording.rows import DataRow, TruthRow
from testbed.world import plant, sensing

SENSE, ESTIMATE, RECORD, CONTROL, PLANT, SLOW, MOVE, PLACE, FEET = 1, 2, 4, 8, 16, 32, 64, 128, 256
"""SLOW marks a step at which tasks, expected loads or the judge are due: the parts are called one by one then. MOVE
takes over the engine's pose and belongs to every step, FEET finds the foot forces with it;
PLACE does so for a body at rest."""


class RecordedRow(Record):
    """One row of both series."""

    known = part(DataRow, "row of `data`")
    truth = part(TruthRow, "row of `truth`")


@njit
def between_steps(
    due: int, boards: Any, estimator: Any, noises: Any, row: Any, recorded: Any
) -> None:
    """Do the parts named by the flags `due`, after the engine steps that the board's clock counts.

    boards: array of one Board; estimator: the live chain's arrays; noises: Noise, taken in turn by the samples; row:
    array of one DataRow, the running one; recorded: RecordedRow, filled from the board's clock.recorded on.
    """
    board = boards[0]
    if due & (MOVE | PLACE):
        plant.follow_engine(board, due & PLACE != 0, due & FEET != 0)
    t = board.clock.step * board.clock.step_s
    if due & SENSE:
        sample = board.clock.step // board.clock.steps_a_sample
        sensing.sense(row[0], board, noises[sample % noises.shape[0]], t, sample)
    if due & ESTIMATE:
        estimate(row[0], board, estimator)
    if due & RECORD:
        recorded["known"][board.clock.recorded] = row[0]
        plant.write_truth(recorded[board.clock.recorded].truth, board, t)
        board.clock.recorded += 1
    if due & CONTROL:
        control(row[0], board)
    if due & PLANT:
        plant.plant_step(board)


@njit
def estimate(row: Any, board: Any, estimator: Any) -> None:
    """One step of the live chain on a DataRow, and its answers into the same row."""
    legs, common, state, body, own, out = estimator
    common[chain_kernel.OIL] = row.oil_temperature
    common[chain_kernel.SUPPLY] = row.supply_pressure
    inertial, drill = np.empty(6), np.zeros(KNOWN)
    for k in range(3):
        inertial[k], inertial[3 + k] = row.angular_rate[k], row.specific_force[k]
    drill[THRUST], drill[REACTION] = row.ordered_thrust, row.ordered_torque
    drill[IN_HOLE_KG], drill[IN_MAST_KG] = row.rods_in_hole, row.rods_in_mast
    drill[MAST_MIDDLE], drill[STORED_KG] = row.rods_mast_height, row.rods_stored
    chain_kernel.step_chain(
        row.pressure_a,
        row.pressure_b,
        row.position,
        board.gravity_in_body,
        row.valve,
        row.rope_tension,
        row.attitude,
        inertial,
        row.carrying,
        drill,
        legs,
        common,
        state,
        body,
        own,
        out,
    )
    for leg in range(4):
        loads, interval, force = row.estimate, row.estimate_own, row.own
        loads.one_chamber[leg], loads.two_chamber[leg] = out[0, leg], out[1, leg]
        loads.friction[leg], loads.kbf[leg] = out[2, leg], out[3, leg]
        loads.modified_kbf[leg], loads.own[leg] = out[4, leg], out[5, leg]
        interval.low[leg], interval.high[leg], interval.sd[leg] = (
            out[6, leg],
            out[7, leg],
            out[8, leg],
        )
        force.x[leg], force.y[leg], force.z[leg] = out[12, leg], out[13, leg], out[14, leg]
        force.x_sd[leg], force.y_sd[leg] = out[15, leg], out[16, leg]
        force.z_sd[leg] = out[17, leg]
        row.contact[leg] = out[11, leg]


@njit
def control(row: Any, board: Any) -> None:
    """Set points move on, and the valves get their commands."""
    dt = board.clock.control_step_s
    for i in range(12):
        loop = board.loops[i]
        loop.reference += loop.reference_rate * dt
        row.reference[i] = loop.reference
        locked = board.valves_locked != 0
        board.inputs[i].command = 0.0 if locked else valve_command(loop, row.position[i], dt)
