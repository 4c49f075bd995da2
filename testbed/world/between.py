"""What happens between two engine steps, in one compiled call: sense, estimate, record, control, plant.

The order is that of the whole testbed (see simulation.py); the parts that are due come as flags.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from testbed.compiled import njit
from testbed.control.valve_loop import GAIN_COLUMNS, control_step
from testbed.estimation.live.chain_kernel import OIL, SUPPLY, step_chain
from testbed.laws import columns as c
from testbed.laws import drill as d
from testbed.robot.loads.foot_forces import LegNumbers
from testbed.world import plant, sensing
from testbed.world.board import OFFSETS

SENSE, ESTIMATE, RECORD, CONTROL, PLANT, SLOW, MOVE, PLACE, FEET = 1, 2, 4, 8, 16, 32, 64, 128, 256
"""SLOW marks a step at which tasks, expected loads or the judge are due: the parts are called one by one then. MOVE
takes over the engine's pose and belongs to every step, FEET finds the foot forces with it;
PLACE does so for a body at rest."""

_Q, _QD, _POSE, _BASE, _TURN = (OFFSETS[n] for n in ("q", "qd", "pose", "base", "base_turn"))
_Q_BEFORE, _QD_BEFORE = (OFFSETS[n] for n in ("q_before", "qd_before"))
_FOOT, _NORMAL, _LEGS, _GROUND = (
    OFFSETS[n] for n in ("foot_force", "normal_force", "legs", "ground_normals")
)
_TAU, _FORCE, _TORQUE = (OFFSETS[n] for n in ("joint_torque", "force", "torque"))
_AXES, _PARAMS, _SUPPLY, _UNIT = (OFFSETS[n] for n in ("axes", "params", "supply", "unit"))
_GEOMETRY, _ROPES, _BODY, _DRILL = (
    OFFSETS[n] for n in ("geometry", "ropes", "body", "drill_loads")
)
_WRENCH, _SCRATCH, _ROTATION = (OFFSETS[n] for n in ("drill_wrench", "scratch", "rotation"))
_TRANSDUCERS, _SENSORS, _LATE, _GRAVITY = (
    OFFSETS[n] for n in ("transducers", "sensors", "late", "gravity_in_body")
)
_COMMAND, _REFERENCE, _RATE = (OFFSETS[n] for n in ("command", "reference", "reference_rate"))
_INTEGRAL, _GAINS, _CHANGE = (OFFSETS[n] for n in ("integral", "gains", "change"))
LEG_NUMBERS = LegNumbers.dtype
_N_AXES, _N_PARAMS = 12 * c.AXIS_STATES, 12 * c.AXIS_PARAMETERS
_N_ROPES, _N_TRANSDUCERS, _N_LATE = (
    2 * plant.ROPE_COLUMNS,
    24 * sensing.PRESSURE_COLUMNS,
    24 * sensing.DELAY_LENGTH,
)

_ESTIMATES = len(sensing.MEASURED_COLUMNS)
N_ESTIMATES, N_CONTACT = 60, 4
_CONTACT_ROW, _FOOT_ROW = 11, 12
"""Rows of the chain's output: the contact word, the foot's force and its standard deviations (6)."""
_CARRYING = _ESTIMATES + N_ESTIMATES + 2 * N_CONTACT + 12
_DRILL_KNOWN = _CARRYING + N_CONTACT


@njit
def _write_estimates(row: Any, out: Any) -> None:
    """The chain's output into the data row: the methods' loads, the own foot forces, the contact words."""
    for leg in range(4):
        for k in range(9):
            row[_ESTIMATES + 4 * k + leg] = out[k, leg]
        for k in range(6):
            row[_ESTIMATES + 36 + 4 * k + leg] = out[_FOOT_ROW + k, leg]
        row[_ESTIMATES + N_ESTIMATES + leg] = out[_CONTACT_ROW, leg]


@njit
def between_steps(
    flags: int,
    step: int,
    sensor_step: int,
    sample: int,
    count: int,
    dt: float,
    control_dt: float,
    substeps: int,
    locked: bool,
    gravity: float,
    board: Any,
    row: Any,
    chain_legs: Any,
    chain_common: Any,
    chain_state: Any,
    chain_body: Any,
    chain_own: Any,
    chain_out: Any,
    noises: Any,
    data: Any,
    truth: Any,
) -> None:
    """Do the parts named by `flags` after `step` engine steps of `dt` s.

    board: Board.array; row: the running data row; chain_*: the estimator chain's arrays; noises: normal numbers, of
    which this sample takes row `sample`; a record goes to row `count` of data and truth.
    """
    t = step * dt
    base = board[_BASE:_TURN]
    rotation = board[_ROTATION:_TRANSDUCERS].reshape(3, 3)
    axes = board[_AXES : _AXES + _N_AXES].reshape(12, c.AXIS_STATES)
    supply = board[_SUPPLY : _SUPPLY + c.SUPPLY_STATES]
    ropes = board[_ROPES : _ROPES + _N_ROPES].reshape(2, plant.ROPE_COLUMNS)
    command = board[_COMMAND : _COMMAND + 12]
    foot_force = board[_FOOT:_NORMAL].reshape(4, 3)
    before, change = np.empty(6), board[_CHANGE : _CHANGE + 6]
    if flags & (MOVE | PLACE):
        for i in range(6):
            before[i] = base[7 + i]
        plant.move_base(board[_POSE:_BASE], board[_TURN : _TURN + 4], base, dt, bool(flags & PLACE))
        for i in range(6):
            change[i] = 0.0 if flags & PLACE else (base[7 + i] - before[i]) / dt
        change[2] += gravity
        if flags & FEET:
            plant.feet_under_motion(
                board[_LEGS:_GROUND].view(LEG_NUMBERS),
                board[_Q_BEFORE:_QD_BEFORE],
                board[_QD_BEFORE:_FOOT],
                board[_QD:_POSE],
                board[_TAU : _TAU + 12],
                rotation,
                before[3:6],
                change[3:6],
                change[0:3],
                board[_GROUND : _GROUND + 12].reshape(4, 3),
                foot_force,
                board[_NORMAL : _NORMAL + 4],
                dt,
            )
        plant.rotation_matrix(base[3:7], rotation)
    if flags & SENSE:
        sensing.sense(
            row,
            t,
            board[_Q:_QD],
            base,
            rotation,
            axes,
            supply,
            ropes,
            command,
            board[_TRANSDUCERS : _TRANSDUCERS + _N_TRANSDUCERS].reshape(
                24, sensing.PRESSURE_COLUMNS
            ),
            board[_SENSORS:_LATE],
            noises[sample],
            board[_LATE : _LATE + _N_LATE].reshape(24, sensing.DELAY_LENGTH),
            sensor_step,
            gravity,
            board[_GRAVITY : _GRAVITY + 3],
            board[_CHANGE : _CHANGE + 6],
            board[_BODY : _BODY + 3],
        )
    if flags & ESTIMATE:
        chain_common[OIL], chain_common[SUPPLY] = row[sensing.TEMPERATURE], row[sensing.SUPPLY]
        step_chain(
            row[13:25],
            row[25:37],
            row[1:13],
            board[_GRAVITY : _GRAVITY + 3],
            row[37:49],
            row[51:53],
            row[53:56],
            row[56:62],
            row[_CARRYING:_DRILL_KNOWN],
            row[_DRILL_KNOWN : _DRILL_KNOWN + d.KNOWN],
            chain_legs,
            chain_common,
            chain_state,
            chain_body,
            chain_own,
            chain_out,
        )
        _write_estimates(row, chain_out)
    if flags & RECORD:
        for i in range(row.shape[0]):
            data[count, i] = row[i]
        plant.write_truth(
            truth[count],
            t,
            base,
            board[_BODY : _BODY + 3],
            rotation,
            foot_force,
            board[_NORMAL : _NORMAL + 4],
            ropes,
            board[_WRENCH : _WRENCH + 6],
            axes,
            supply,
            board[_DRILL : _DRILL + d.DRILL_COLUMNS],
        )
    if flags & CONTROL:
        reference, rate = board[_REFERENCE : _REFERENCE + 12], board[_RATE : _RATE + 12]
        for i in range(12):
            reference[i] += rate[i] * control_dt
            row[_ESTIMATES + N_ESTIMATES + 2 * N_CONTACT + i] = reference[i]
        control_step(
            row[1:13],
            reference,
            rate,
            board[_INTEGRAL : _INTEGRAL + 12],
            board[_GAINS : _GAINS + 12 * GAIN_COLUMNS].reshape(12, GAIN_COLUMNS),
            locked,
            control_dt,
            command,
        )
    if flags & PLANT:
        for i in range(12):
            board[_Q_BEFORE + i] = board[_Q + i]
            board[_QD_BEFORE + i] = board[_QD + i]
        plant.plant_step(
            board[_Q:_QD],
            board[_QD:_POSE],
            base,
            command,
            foot_force,
            axes,
            board[_PARAMS : _PARAMS + _N_PARAMS].reshape(12, c.AXIS_PARAMETERS),
            supply,
            board[_UNIT : _UNIT + c.SUPPLY_PARAMETERS],
            board[_GEOMETRY : _GEOMETRY + 4],
            ropes,
            board[_BODY : _BODY + plant.BODY_COLUMNS],
            board[_DRILL : _DRILL + d.DRILL_COLUMNS],
            board[_SCRATCH : _SCRATCH + 60].reshape(5, 12),
            rotation,
            board[_TAU : _TAU + 12],
            board[_FORCE : _FORCE + 3],
            board[_TORQUE : _TORQUE + 3],
            board[_WRENCH : _WRENCH + 6],
            dt,
            substeps,
            gravity,
        )
