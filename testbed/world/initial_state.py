"""The Board of a run at its start: the machine's numbers, what its world hides, and every state in
equilibrium.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.control.valve_loop import position_loops
from testbed.effects.terms import Hidden
from testbed.laws.initial import start_axes, start_supply
from testbed.laws.rope import unstrained_length, unstrained_sagging
from testbed.laws.traction import RESERVE_M
from testbed.machine.names import AXES, GRAVITY_M_S2, JOINTS
from testbed.robot.robot import Robot
from testbed.robot.traction import traction_parameters
from testbed.scenario.scenario import Scenario
from testbed.world.board import Board
from testbed.world.engine import Engine
from testbed.world.ground.terrain import Ground
from testbed.world.hydraulic_parameters import axis_parameters, unit_parameters
from testbed.world.sensing import sensor_records
from testbed.world.start import Start
from testbed.world.switches import switch_off
from testbed.world.undeclared import (
    attachments_of,
    put_into_cylinders,
    put_into_other_sensors,
    put_into_sensors,
    put_into_supply,
)

SEAL_STREAM = 41
"""Stream of random numbers of the seals' start."""


@dataclass(frozen=True)
class Truth:
    """What a scenario's world is made of: ground, true robot, and what they hide."""

    scenario: Scenario
    ground: Ground
    robot: Robot
    hidden: Hidden
    sensor_rng: np.random.Generator


def initial_boards(truth: Truth, belief: Robot, engine: Engine, start: Start) -> NDArray[Any]:
    """An array of one Board for a machine that stands as `start` has it, the engine reset to it.

    Only the position loops are made from what is believed. They begin to hold each joint where its
    own encoder has it, as a controller does that is switched on while the machine stands: set
    points taken from anywhere else would press the feet against each other, 2 kN for a tenth of a
    millimetre. Raises InputError for numbers that cannot be.
    """
    boards = Board.zeros()
    board = boards[0]
    _start_clock(board, truth.scenario)
    _place_bodies(board, truth, engine)
    board["ground_normals"] = truth.ground.normal_in_world
    _fill_hydraulics(board, truth, start)
    _hang_ropes(board, truth, start)
    _fit_sensors(board, truth)
    board["loops"] = position_loops(belief.machine, belief.linkages.gain_arms(start.joints))
    board["loops"]["reference"] = start.joints + board.sensors.joint_offset
    board["valves_locked"] = truth.scenario.hydraulics.valves_locked
    return boards


def _start_clock(board: Any, scenario: Scenario) -> None:
    rates, clock = scenario.rates, board.clock
    clock["step_s"] = 1.0 / rates.physics_hz
    clock["control_step_s"] = clock["step_s"] * (rates.physics_hz // rates.control_hz)
    clock["steps_a_sample"] = rates.physics_hz // rates.sensor_hz
    clock["substeps"] = rates.hydraulic_substeps


def _place_bodies(board: Any, truth: Truth, engine: Engine) -> None:
    """Masses and places of body and legs; hidden masses sit in the links."""
    board["base_turn"], board["base_centre"] = engine.base_turn, engine.base_inertial_m
    board["drill_point"] = truth.robot.model.drill_mount_m
    board["legs"] = truth.robot.model.leg_numbers()
    board["legs"]["hip"] -= engine.base_inertial_m
    soles = truth.robot.model.foot_positions_m(np.zeros(len(AXES)))[:, 2]
    board["foot_height"] = soles - engine.base_inertial_m[2]
    for number, axis in enumerate(AXES):
        leg, joint = divmod(number, len(JOINTS))
        board["legs"]["links"]["mass"][leg, joint] += truth.hidden.cylinders[axis].mass_kg


def _fill_hydraulics(board: Any, truth: Truth, start: Start) -> None:
    """Parameters of axes and power unit, chambers that hold the joints, a charged supply."""
    machine, hydraulics = truth.robot.machine, truth.scenario.hydraulics
    degc = hydraulics.oil_temperature_degc
    parameters = axis_parameters(machine, locked=hydraulics.valves_locked, oil_degc=degc)
    unit = unit_parameters(machine, pump_on=hydraulics.pump, oil_degc=degc)
    switch_off(hydraulics.without, parameters, unit)
    put_into_cylinders(truth.hidden, parameters)
    put_into_supply(truth.hidden, unit)
    extension, arms = truth.robot.linkages.rods(start.joints)
    forces = start.joint_forces / arms
    board["parameters"], board["unit"] = parameters, unit
    board["linkages"] = truth.robot.linkages.records
    supply = start_supply(unit, degc, machine.power_unit.tank_oil_m3)
    board["supply"] = supply
    seals = np.random.default_rng([truth.scenario.seed, SEAL_STREAM])
    stuck = hydraulics.stuck_seals * seals.uniform(-1.0, 1.0, len(AXES))
    board["axes"] = start_axes(
        parameters,
        extension,
        forces,
        supply=supply,
        tank_pa=float(unit["tank_pressure"]),
        stuck=stuck,
    )


def _hang_ropes(board: Any, truth: Truth, start: Start) -> None:
    """Ropes that pull as the start has it, and traction devices at the beginning of their
    stroke.
    """
    r, numbers, model = truth.scenario.ropes, truth.robot.machine.rope, truth.robot.model
    ropes, devices = board["ropes"], board["devices"]
    board["traction"] = traction_parameters(truth.robot.machine, strokes=r.strokes, roped=r.enabled)
    devices["way"], devices["place"] = -1.0, RESERVE_M
    ropes["anchor"] = start.anchors_m
    ropes["attachment"] = attachments_of(truth.hidden, model.rope_attachments_m)
    stiffness = truth.hidden.rope_stiffness_factor * r.stiffness_ea_n
    ropes["stiffness_ea"], ropes["damping"] = stiffness, r.damping_n_s_m
    ropes["breaking_load"], ropes["whole"] = r.breaking_load_n, float(r.enabled)
    ropes["tension"] = start.rope_tension_n
    if r.sag:
        ropes["weight"] = numbers.mass_per_length_kg_m * GRAVITY_M_S2
        ropes["clearance"] = numbers.clearance_m
    for rope in ropes:
        chord = rope.anchor - (start.position_m + start.rotation @ rope.attachment)
        length, tension = float(np.linalg.norm(chord)), float(rope.tension)
        if r.sag:
            across = rope.weight * float(np.hypot(chord[0], chord[1])) / length
            rope.unstrained = unstrained_sagging(
                length, tension, stiffness, across, numbers.clearance_m
            )
        else:
            rope.unstrained = unstrained_length(length, tension, stiffness)


def _fit_sensors(board: Any, truth: Truth) -> None:
    scenario = truth.scenario
    transducers, others = sensor_records(
        truth.robot.machine, scenario.sensors, truth.sensor_rng, scenario.machine.seed
    )
    put_into_sensors(truth.hidden, transducers, 1.0 / scenario.rates.sensor_hz)
    put_into_other_sensors(truth.hidden, others)
    board["transducers"], board["sensors"] = transducers, others
