"""A scenario turned into a machine on its ground, in equilibrium, with its electronics."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed import resources
from testbed.control.believed_model import believed_model
from testbed.control.drilling.thrust import ThrustBound, thrust_bound, thrust_events
from testbed.control.gait import BelievedStart, Gait
from testbed.control.gaits.table import gait_of
from testbed.control.valve_loop import position_loops
from testbed.effects.hidden import Hidden
from testbed.errors import naming
from testbed.estimation.live.believed import Believed
from testbed.estimation.live.body_belief import packed
from testbed.estimation.live.chain import EstimatorChain
from testbed.estimation.live.expected import Expectation
from testbed.laws.drill import DrillLoads
from testbed.laws.initial import start_axes, start_supply
from testbed.laws.rope import unstrained_length, unstrained_sagging
from testbed.laws.traction import RESERVE_M
from testbed.machine.names import AXES, GRAVITY_M_S2, JOINTS, LEGS
from testbed.machine.provenance import Parameters, roboclimber
from testbed.recording.rows import DrillKnown
from testbed.robot.kinematics import LegKinematics
from testbed.robot.linkage import RotationLinkage
from testbed.robot.loads.foot_loads import ExpectedLoads
from testbed.robot.model import Payload, RobotModel
from testbed.scenario.scenario import Scenario
from testbed.world.board import Board
from testbed.world.drilling.drilling import Drilling, drill_known, drilling_of
from testbed.world.engine import Engine
from testbed.world.ground.footing import Footing
from testbed.world.ground.terrain import Ground, make_ground
from testbed.world.plumbing import axis_parameters, traction_parameters, unit_parameters
from testbed.world.sensing import sensor_records
from testbed.world.start import Start, find_start
from testbed.world.switches import switch_off
from testbed.world.undeclared import (
    hidden_of,
    put_into_cylinders,
    put_into_sensors,
    put_into_supply,
)
from testbed.world.verdict import Judge

Array = NDArray[np.float64]


@dataclass
class Machine:
    """Everything one run steps: truth on the left of the wall, electronics on the right."""

    boards: NDArray[Any]
    """The world outside the engine, as an array of one Board."""
    # truth
    engine: Engine
    ground: Ground
    footing: Footing | None
    drill: Drilling
    noise_rng: np.random.Generator
    added_noise_rng: np.random.Generator
    judge: Judge
    kinematics: RobotModel
    start_joints: Array
    start_base: Array
    start_events: list[dict[str, Any]]
    thrust: ThrustBound
    # electronics
    chain: EstimatorChain
    expectation: Expectation
    gait: Gait

    @property
    def board(self) -> Any:
        """The world outside the engine: one Board, its parts by name."""
        return self.boards[0]

    def drill_known(self) -> Any:
        """What the drill's own controls know: ordered thrust and torque, no blows, and where its rods are."""
        return drill_known(self.drill, DrillKnown.zeros()[0])

    def limit_thrust(self) -> None:
        """Hold the feed that the drill orders to what the stance allows."""
        feed = self.drill.loads.feed
        if feed > self.thrust.most_n:
            self.drill.ordered.thrust -= feed - self.thrust.most_n
            self.drill.loads.feed = self.thrust.most_n

    def origin_in_world(self) -> Array:
        """Origin of the body frame, (3), m."""
        b = self.board
        return np.asarray(b.body.position - b.rotation @ b.base_centre)

    def feet_in_world(self) -> Array:
        """Undersides of the feet, (4, 3), m."""
        b = self.board
        return np.asarray(
            self.origin_in_world() + self.kinematics.foot_positions_m(b.engine.joint) @ b.rotation.T
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


def assemble(scenario: Scenario, model: str | Path | None, gui: bool) -> Machine:
    """Build the world of a scenario and start it in equilibrium.

    Raises InputError for numbers that cannot be, a URDF that does not load, a model file that is none.
    """
    machine = roboclimber()
    true = machine.replaced(scenario.hydraulics.parameters)
    if scenario.hydraulics.supply_pressure_pa is not None:
        true = true.replaced(
            {"power_unit.supply_pressure_pa": scenario.hydraulics.supply_pressure_pa}
        )
    believed = machine.replaced(scenario.model.parameters)
    seeds = [np.random.default_rng([scenario.seed, k]) for k in range(3)]
    t, r = scenario.terrain, scenario.rates
    ground = make_ground(t)
    linkage = RotationLinkage.from_parameters(true)
    params = axis_parameters(true, linkage.stroke_m, locked=scenario.hydraulics.valves_locked)
    unit = unit_parameters(true, pump_on=scenario.hydraulics.pump)
    switch_off(scenario.hydraulics.without, params, unit)
    transducers, sensors = sensor_records(true, scenario.sensors, seeds[0])
    hidden = hidden_of(scenario.undeclared)
    put_into_cylinders(hidden, params)
    put_into_supply(hidden, unit)
    put_into_sensors(hidden, transducers, 1.0 / r.sensor_hz)
    rod_store = true["rod_store_body"]
    drill = drilling_of(scenario.task, DrillLoads.zeros()[0], scenario.seed, true)
    payload = (
        Payload(scenario.carried_kg, rod_store["position_m"]) if scenario.carried_kg > 0 else None
    )
    urdf = Path(scenario.robot.urdf) if scenario.robot.urdf else resources.urdf()
    kinematics = RobotModel(urdf, payload, scenario.ropes.attachment_height_m)
    engine = Engine(
        urdf,
        ground,
        step_s=1.0 / r.physics_hz,
        robot_first=t.loading_order == "robot_first",
        gui=gui,
        sinking=t.loose,
    )
    try:
        if payload is not None:
            engine.add_store_mass(payload.mass_kg)
        for number, axis in enumerate(AXES):
            engine.add_link_mass(number, hidden.cylinders[axis].mass_kg)
        known = drill_known(drill, DrillKnown.zeros()[0])
        start = find_start(scenario, ground, kinematics, engine, true, known)
        return _build(
            scenario,
            model,
            true,
            believed,
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
    true: Parameters,
    believed: Parameters,
    ground: Ground,
    engine: Engine,
    kinematics: RobotModel,
    start: Start,
    drill: Drilling,
    linkage: RotationLinkage,
    params: NDArray[Any],
    unit: Any,
    transducers: NDArray[Any],
    sensors: Any,
    seeds: list[np.random.Generator],
    hidden: Hidden,
) -> Machine:
    engine.reset(start.position_m, start.rotation, start.joints)
    extension, arms = start.joints.copy(), np.ones(len(AXES))
    for i in range(0, len(AXES), 3):
        extension[i] = linkage.extension_m(start.joints[i])
        arms[i] = linkage.moment_arm_m(start.joints[i])
    boards = Board.zeros()
    b = boards[0]
    _start_clock(b.clock, scenario)
    b["parameters"], b["unit"] = params, unit
    b["transducers"], b["sensors"] = transducers, sensors
    b["axes"] = start_axes(params, extension, start.joint_forces / arms)
    b["supply"] = start_supply(
        unit, scenario.hydraulics.oil_temperature_degc, true["power_unit"]["tank_oil_m3"]
    )
    b["linkage"] = linkage.geometry
    b["base_turn"], b["base_centre"] = engine.base_turn, engine.base_inertial_m
    b["legs"] = kinematics.leg_numbers()
    b["legs"]["hip"] -= engine.base_inertial_m
    for number, axis in enumerate(AXES):
        leg, joint = divmod(number, len(JOINTS))
        b["legs"]["links"]["mass"][leg, joint] += hidden.cylinders[axis].mass_kg
    b["ground_normals"] = ground.normal_in_world
    _hang_ropes(b, scenario, start, kinematics, true["rope"])
    b["traction"] = traction_parameters(true, strokes=scenario.ropes.strokes)
    b["drill_point"] = kinematics.drill_mount_m
    b["loops"] = position_loops(believed, float(arms[0]))
    b["loops"]["reference"] = start.joints
    b["valves_locked"] = scenario.hydraulics.valves_locked
    b["drill"] = drill.loads
    drill.loads = b.drill
    weight = kinematics.total_mass_kg * GRAVITY_M_S2
    raised = float(np.mean(scenario.robot.vertical_m)) > 0.05
    expected = ExpectedLoads(kinematics)
    pulls = start.rope_tension_n[:, None] * (start.rope_directions @ start.rotation)
    gravity = start.rotation.T @ np.array([0.0, 0.0, -GRAVITY_M_S2])
    thrust = thrust_bound(scenario, expected, start.joints, gravity, pulls)
    return Machine(
        boards=boards,
        engine=engine,
        ground=ground,
        footing=start.footing,
        drill=drill,
        noise_rng=seeds[1],
        added_noise_rng=np.random.default_rng([scenario.seed, 40]),
        judge=Judge(start.rotation, weight, raised),
        kinematics=kinematics,
        start_joints=start.joints,
        start_base=start.position_m.copy(),
        start_events=thrust_events(scenario.task, thrust),
        thrust=thrust,
        chain=_chain(scenario, model, believed, kinematics, start.rope_directions),
        expectation=Expectation(expected, start.rope_directions),
        gait=gait_of(scenario, _believed_start(scenario, believed, start)),
    )


def _believed_start(scenario: Scenario, believed: Parameters, start: Start) -> BelievedStart:
    """What people measured of the place and the load before the run, and what control believes of the machine."""
    return BelievedStart(
        joints=start.joints,
        load_n=start.foot_forces_in_body[:, 2],
        rope_tension_n=start.rope_tension_n,
        rope_directions_in_body=start.rope_directions @ start.rotation,
        anchors_in_body_m=(start.anchors_m - start.position_m) @ start.rotation,
        legs=LegKinematics.from_parameters(believed),
        make_model=partial(believed_model, scenario),
    )


def _chain(
    scenario: Scenario,
    model: str | Path | None,
    believed: Parameters,
    kinematics: RobotModel,
    rope_directions: Array,
) -> EstimatorChain:
    from dataclasses import replace

    dt = 1.0 / scenario.rates.estimator_hz
    if model is None:
        belief = Believed.from_machine(believed, dt)
    else:
        from testbed.effects import read_believed

        with naming(model):
            belief = Believed.from_model(
                read_believed(model), dt, believed["sensor"]["encoder_linear_m"]
            )
    wanted = {
        "kbf_q_n2": scenario.estimator.process_variance_n2,
        "kbf_r_n2": scenario.estimator.measurement_variance_n2,
        "e_max_n": scenario.estimator.innovation_limit_n,
        "contact_off_n": scenario.estimator.contact_threshold_n,
    }
    changes = {name: value for name, value in wanted.items() if value is not None}
    body = packed(believed, kinematics, belief.legs, dt, rope_directions)
    return EstimatorChain(replace(belief, tuning=replace(belief.tuning, **changes), body=body))


def _start_clock(clock: Any, scenario: Scenario) -> None:
    rates = scenario.rates
    clock["step_s"] = 1.0 / rates.physics_hz
    clock["control_step_s"] = clock["step_s"] * (rates.physics_hz // rates.control_hz)
    clock["steps_a_sample"] = rates.physics_hz // rates.sensor_hz
    clock["substeps"] = rates.hydraulic_substeps


def _hang_ropes(
    board: Any, scenario: Scenario, start: Start, kinematics: RobotModel, numbers: Parameters
) -> None:
    """Ropes and traction devices of the Board as they are at the start."""
    r = scenario.ropes
    ropes, devices = board["ropes"], board["devices"]
    devices["way"], devices["place"] = -1.0, RESERVE_M
    ropes["anchor"], ropes["attachment"] = start.anchors_m, kinematics.rope_attachments_m
    ropes["stiffness_ea"], ropes["damping"] = r.stiffness_ea_n, r.damping_n_s_m
    ropes["breaking_load"], ropes["whole"] = r.breaking_load_n, float(r.enabled)
    ropes["tension"] = start.rope_tension_n
    if r.sag:
        ropes["weight"] = numbers["mass_per_length_kg_m"] * GRAVITY_M_S2
        ropes["clearance"] = numbers["clearance_m"]
    for rope in ropes:
        point = start.position_m + start.rotation @ rope.attachment
        chord = rope.anchor - point
        length, tension = float(np.linalg.norm(chord)), float(rope.tension)
        if r.sag:
            across = rope.weight * float(np.hypot(chord[0], chord[1])) / length
            rope.unstrained = unstrained_sagging(
                length, tension, r.stiffness_ea_n, across, numbers["clearance_m"]
            )
        else:
            rope.unstrained = unstrained_length(length, tension, r.stiffness_ea_n)
