"""A scenario turned into a machine on its ground, in equilibrium, with its electronics."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.control.drilling.thrust import ThrustBound, thrust_bound, thrust_events
from testbed.control.gait import BelievedStart, Gait
from testbed.control.gaits.table import gait_of
from testbed.control.valve_loop import gains
from testbed.effects.hidden import Hidden
from testbed.errors import naming
from testbed.estimation.live.believed import Believed
from testbed.estimation.live.body_belief import packed
from testbed.estimation.live.chain import EstimatorChain
from testbed.estimation.live.expected import Expectation
from testbed.laws import drill as d
from testbed.laws import traction as tr
from testbed.laws.initial import start_axes, start_supply
from testbed.laws.rope import unstrained_length, unstrained_sagging
from testbed.machine.groups import Rope
from testbed.machine.model import Machine
from testbed.machine.names import AXES, GRAVITY_M_S2, JOINTS, LEGS
from testbed.robot.linkage import RotationLinkage
from testbed.robot.loads.foot_forces import LegNumbers
from testbed.robot.loads.foot_loads import ExpectedLoads
from testbed.robot.model import RobotModel
from testbed.robot.robot import Robot
from testbed.scenario.machines import Machines
from testbed.scenario.scenario import Scenario
from testbed.world import plant, sensing
from testbed.world.board import Board
from testbed.world.drilling.drilling import Drilling, drill_known, drilling_of
from testbed.world.engine import Engine
from testbed.world.ground.footing import Footing, sinking
from testbed.world.ground.terrain import Ground, make_ground
from testbed.world.plumbing import axis_parameters, traction_numbers, unit_parameters
from testbed.world.start import Start, find_start
from testbed.world.switches import switch_off
from testbed.world.undeclared import (
    bodies_of,
    hidden_of,
    put_into_cylinders,
    put_into_sensors,
    put_into_supply,
)
from testbed.world.verdict import Judge

Array = NDArray[np.float64]


@dataclass
class Assembled:
    """Everything one run steps: truth on the left of the wall, electronics on the right."""

    board: Board
    # truth
    engine: Engine
    ground: Ground
    footing: Footing | None
    drill: Drilling
    noise_rng: np.random.Generator
    added_noise_rng: np.random.Generator
    judge: Judge
    kinematics: RobotModel
    belief: Robot
    start_joints: Array
    start_base: Array
    start_events: list[dict[str, Any]]
    thrust: ThrustBound
    thrust_factor: float
    """True thrust over the ordered one."""
    # electronics
    locked: bool
    chain: EstimatorChain
    expectation: Expectation
    gait: Gait
    _drill_known: Array = field(default_factory=partial(np.zeros, d.KNOWN))

    def drill_known(self) -> Array:
        """What the drill's own controls know (KNOWN): ordered thrust and torque, no blows, and where its rods are."""
        return drill_known(self.drill, self._drill_known)

    def limit_thrust(self) -> None:
        """Hold the feed that the drill orders to what the stance allows; what comes of it may be another thrust."""
        feed = self.drill.loads[d.FEED]
        if feed > self.thrust.most_n:
            self.drill.ordered[0] -= feed - self.thrust.most_n
            self.drill.loads[d.FEED] = self.thrust.most_n
        self.drill.loads[d.FEED] *= self.thrust_factor

    def origin_in_world(self) -> Array:
        """Origin of the body frame, (3), m."""
        b = self.board
        return np.asarray(b.base[:3] - b.rotation @ b.body[plant.COM])

    def feet_in_world(self) -> Array:
        """Undersides of the feet, (4, 3), m."""
        b = self.board
        return np.asarray(
            self.origin_in_world() + self.kinematics.foot_positions_m(b.q) @ b.rotation.T
        )

    def settlement(self) -> dict[str, dict[str, float]]:
        """How far loose ground has given way under each foot, m; nothing on firm ground."""
        if self.footing is None or not self.footing.loose:
            return {}
        return {"settlement_m": dict(zip(LEGS, self.footing.settlement_m.tolist(), strict=True))}

    def picture(self, width: int, height: int) -> NDArray[np.uint8]:
        """The robot on its slope, seen from the lower left, with ropes and drill rod."""
        from testbed.world.scene import picture

        return picture(self, width, height)


def assemble(
    scenario: Scenario, machines: Machines, model: str | Path | None, gui: bool
) -> Assembled:
    """Build the world of a scenario and start it in equilibrium.

    Raises InputError for numbers that cannot be, a URDF that does not load, a model file that is none.
    """
    carried, height = scenario.carried_kg, scenario.ropes.attachment_height_m
    true = machines.truth
    belief = Robot.of(machines.belief, carried, height)
    seeds = [np.random.default_rng([scenario.seed, k]) for k in range(3)]
    t, r = scenario.terrain, scenario.rates
    ground = make_ground(t)
    params = axis_parameters(true, locked=scenario.hydraulics.valves_locked)
    unit = unit_parameters(true, pump_on=scenario.hydraulics.pump)
    switch_off(scenario.hydraulics.without, params, unit)
    transducers, sensors = sensing.sensor_arrays(true, scenario.sensors, seeds[0])
    hidden = hidden_of(scenario.undeclared)
    put_into_cylinders(hidden, params)
    put_into_supply(hidden, unit)
    put_into_sensors(hidden, transducers, 1.0 / r.sensor_hz)
    drill = drilling_of(scenario.task, np.zeros(d.DRILL_COLUMNS), scenario.seed, true)
    with bodies_of(hidden, true.urdf) as urdf:
        truth = Robot.of(true, carried, height, urdf)
        engine = Engine(
            urdf,
            ground,
            step_s=1.0 / r.physics_hz,
            robot_first=t.loading_order == "robot_first",
            gui=gui,
            sinking=t.loose or sinking(tuple(hidden.feet.values())),
        )
    linkage, kinematics = truth.linkage, truth.model
    try:
        if carried > 0.0:
            engine.add_store_mass(carried)
        for number, axis in enumerate(AXES):
            engine.add_link_mass(number, hidden.cylinders[axis].mass_kg)
        start = find_start(
            scenario,
            ground,
            kinematics,
            engine,
            true,
            drill_known(drill, np.zeros(d.KNOWN)),
            hidden,
        )
        return _build(
            scenario,
            model,
            true,
            belief,
            ground,
            engine,
            kinematics,
            start,
            drill,
            linkage,
            params,
            unit,
            transducers,
            sensors,
            seeds,
            hidden,
        )
    except BaseException:
        engine.close()
        raise


def _build(
    scenario: Scenario,
    model: str | Path | None,
    true: Machine,
    belief: Robot,
    ground: Ground,
    engine: Engine,
    kinematics: RobotModel,
    start: Start,
    drill: Drilling,
    linkage: RotationLinkage,
    params: Array,
    unit: Array,
    transducers: Array,
    sensors: Array,
    seeds: list[np.random.Generator],
    hidden: Hidden,
) -> Assembled:
    engine.reset(start.position_m, start.rotation, start.joints)
    extension, arms = start.joints.copy(), np.ones(len(AXES))
    for i in range(0, len(AXES), 3):
        extension[i] = linkage.extension_m(start.joints[i])
        arms[i] = linkage.moment_arm_m(start.joints[i])
    b = Board()
    b.params[:], b.unit[:], b.transducers[:], b.sensors[:] = params, unit, transducers, sensors
    b.axes[:] = start_axes(params, extension, start.joint_forces / arms)
    b.supply[:] = start_supply(
        unit, scenario.hydraulics.oil_temperature_degc, true.power_unit.tank_oil_m3
    )
    b.geometry[:] = linkage.geometry
    b.base_turn[:] = engine.base_turn
    legs = kinematics.leg_numbers()
    legs["hip"] -= engine.base_inertial_m
    for number, axis in enumerate(AXES):
        leg, joint = divmod(number, len(JOINTS))
        legs["links"]["mass"][leg, joint] += hidden.cylinders[axis].mass_kg
    b.legs[:] = LegNumbers.as_table(legs)
    b.ground_normals[:] = ground.normal_in_world
    b.ropes[:] = _ropes(scenario, start, kinematics, true.rope, hidden.rope_stiffness_factor)
    b.body[plant.COM] = engine.base_inertial_m
    b.body[plant.DRILL_POINT] = kinematics.drill_mount_m
    b.body[plant.TRACTION_NUMBERS] = traction_numbers(true, strokes=scenario.ropes.strokes)
    b.gains[:] = gains(belief.machine, float(arms[0]))
    b.reference[:] = start.joints
    b.drill_loads[:] = drill.loads
    drill.loads = b.drill_loads
    weight = kinematics.total_mass_kg * GRAVITY_M_S2
    raised = float(np.mean(scenario.robot.vertical_m)) > 0.05
    expected = ExpectedLoads(belief.model, belief.machine)
    pulls = start.rope_tension_n[:, None] * (start.surveyed_directions @ start.rotation)
    gravity = start.rotation.T @ np.array([0.0, 0.0, -GRAVITY_M_S2])
    thrust = thrust_bound(scenario, expected, start.joints, gravity, pulls)
    return Assembled(
        board=b,
        engine=engine,
        ground=ground,
        footing=start.footing,
        drill=drill,
        noise_rng=seeds[1],
        added_noise_rng=np.random.default_rng([scenario.seed, 40]),
        judge=Judge(start.rotation, weight, raised),
        kinematics=kinematics,
        belief=belief,
        start_joints=start.joints,
        start_base=start.position_m.copy(),
        start_events=thrust_events(scenario.task, thrust),
        thrust=thrust,
        thrust_factor=hidden.thrust_factor,
        locked=scenario.hydraulics.valves_locked,
        chain=_chain(scenario, model, belief, start.surveyed_directions),
        expectation=Expectation(expected, start.surveyed_directions),
        gait=gait_of(scenario, _believed_start(belief, start)),
    )


def _believed_start(belief: Robot, start: Start) -> BelievedStart:
    """What people measured of the place and the load before the run, and what control believes of the machine."""
    return BelievedStart(
        robot=belief,
        joints=start.joints,
        load_n=start.foot_forces_in_body[:, 2],
        rope_tension_n=start.rope_tension_n,
        rope_directions_in_body=start.surveyed_directions @ start.rotation,
        anchors_in_body_m=(start.surveyed_anchors_m - start.position_m) @ start.rotation,
    )


def _chain(
    scenario: Scenario,
    model: str | Path | None,
    robot: Robot,
    rope_directions: Array,
) -> EstimatorChain:
    from dataclasses import replace

    dt = 1.0 / scenario.rates.estimator_hz
    if model is None:
        belief = Believed.from_machine(robot.machine, dt)
    else:
        from testbed.effects import read_believed

        with naming(model):
            belief = Believed.from_model(read_believed(model), dt, robot.machine)
    wanted = {
        "kbf_q_n2": scenario.estimator.process_variance_n2,
        "kbf_r_n2": scenario.estimator.measurement_variance_n2,
        "e_max_n": scenario.estimator.innovation_limit_n,
        "contact_off_n": scenario.estimator.contact_threshold_n,
    }
    changes = {name: value for name, value in wanted.items() if value is not None}
    body = packed(robot.machine, robot.model, belief.legs, dt, rope_directions)
    return EstimatorChain(replace(belief, tuning=replace(belief.tuning, **changes), body=body))


def _ropes(
    scenario: Scenario, start: Start, kinematics: RobotModel, numbers: Rope, stiffness_factor: float
) -> Array:
    ropes = np.zeros((2, plant.ROPE_COLUMNS))
    r = scenario.ropes
    stiffness = stiffness_factor * r.stiffness_ea_n
    for k in range(2):
        point = start.position_m + start.rotation @ kinematics.rope_attachments_m[k]
        ropes[k, plant.ANCHOR] = start.anchors_m[k]
        ropes[k, plant.ATTACH] = kinematics.rope_attachments_m[k]
        chord = start.anchors_m[k] - point
        length, tension = float(np.linalg.norm(chord)), float(start.rope_tension_n[k])
        if r.sag:
            ropes[k, plant.WEIGHT] = numbers.mass_per_length_kg_m * GRAVITY_M_S2
            ropes[k, plant.CLEARANCE] = numbers.clearance_m
            across = ropes[k, plant.WEIGHT] * float(np.hypot(chord[0], chord[1])) / length
            ropes[k, plant.UNSTRAINED] = unstrained_sagging(
                length, tension, stiffness, across, numbers.clearance_m
            )
        else:
            ropes[k, plant.UNSTRAINED] = unstrained_length(length, tension, stiffness)
        ropes[k, plant.TRACTION.start + tr.WAY] = -1.0
        ropes[k, plant.TRACTION.start + tr.PLACE] = tr.RESERVE_M
        ropes[k, plant.TENSION] = start.rope_tension_n[k]
        ropes[k, plant.EA], ropes[k, plant.DAMPING] = stiffness, r.damping_n_s_m
        ropes[k, plant.BREAKING], ropes[k, plant.WHOLE] = r.breaking_load_n, float(r.enabled)
    return ropes
