"""A scenario turned into a machine on its ground, in equilibrium, with its electronics."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.control.gait import BelievedStart, Gait
from testbed.control.gaits.table import NOTHING_OWN, OwnParts, gait_of
from testbed.control.thrust import ThrustBound, thrust_bound, thrust_events
from testbed.effects.terms import Hidden
from testbed.estimation.live.chain import EstimatorChain
from testbed.formats.arrays import Array
from testbed.machine.names import AXES, GRAVITY_M_S2, LEGS
from testbed.recording.rows import DrillKnown
from testbed.robot.loads.foot_loads import Expectation, ExpectedLoads
from testbed.robot.model import RobotModel
from testbed.robot.robot import Robot
from testbed.robot.rope_bearings import SurveyedRopes
from testbed.scenario.machines import Machines
from testbed.scenario.scenario import Scenario
from testbed.world.believed_robot import BelievedRobot, believed_robot
from testbed.world.drilling.drilling import Drilling, DrillReporter, drill_known, drilling_of
from testbed.world.engine import Engine
from testbed.world.first_start import compile_apart
from testbed.world.ground.footing import Footing, sinking
from testbed.world.ground.terrain import Ground, make_ground
from testbed.world.initial_state import Truth, initial_boards
from testbed.world.start import Start, find_start
from testbed.world.undeclared import bodies_of, hidden_beside
from testbed.world.verdict import Judge


@dataclass
class Assembled:
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
    hidden: Hidden
    belief: Robot
    start_joints: Array
    """(12) as its encoders have them, rad and m: where the position loops hold it at first."""
    start_base: Array
    start_events: list[dict[str, Any]]
    thrust: ThrustBound
    thrust_factor: float
    """True thrust over the ordered one."""
    # electronics
    chain: EstimatorChain
    expectation: Expectation
    gait: Gait

    @property
    def board(self) -> Any:
        """The world outside the engine: one Board, its parts by name."""
        return self.boards[0]

    def drill_known(self) -> Any:
        """What the drill's own controls know: ordered thrust and torque, no blows, and where its
        rods are.
        """
        return drill_known(self.drill, DrillKnown.zeros()[0])

    def limit_thrust(self) -> None:
        """Hold the feed that the drill orders to what the stance allows; what comes of it may be
        another thrust.
        """
        ordered, loads, most_n = self.drill.ordered, self.drill.loads, self.thrust.most_n
        ordered.thrust = min(ordered.thrust, most_n)
        loads.feed = self.thrust_factor * min(loads.feed, most_n)

    def origin_in_world(self) -> Array:
        """Origin of the body frame, (3), m."""
        b = self.boards
        return np.asarray(b["body"]["position"][0] - b["rotation"][0] @ b["base_centre"][0])

    def feet_in_world(self) -> Array:
        """Undersides of the feet, (4, 3), m."""
        b = self.boards
        return np.asarray(
            self.origin_in_world()
            + self.kinematics.foot_positions_m(b["engine"]["joint"][0]) @ b["rotation"][0].T
        )

    def set_friction(self, friction: float) -> None:
        """Another friction of the ground, but for patches and feet with one of their own."""
        self.engine.set_friction(friction)
        if self.footing is not None:
            self.footing.set_friction(friction)
            return
        for leg in range(len(LEGS)):
            ground = self.ground
            self.engine.set_footing(leg, friction, ground.stiffness_n_m, ground.damping_n_s_m)

    def settlement(self) -> dict[str, dict[str, float]]:
        """How far loose ground has given way under each foot, m; nothing on firm ground."""
        if self.footing is None or not self.footing.loose:
            return {}
        return {"settlement_m": dict(zip(LEGS, self.footing.settlement_m.tolist(), strict=True))}

    def picture(self, width: int, height: int) -> NDArray[np.uint8]:
        """The robot on its slope, seen from the lower left, with ropes and drill rod."""
        from testbed.world.scene import picture

        return picture(self, width, height)

    def seen(self) -> NDArray[Any]:
        """All that a picture shows now, for `show`."""
        return self.boards.copy()

    def show(self, seen: NDArray[Any]) -> None:
        """Put everything as it was `seen`, for pictures: no step goes on from there."""
        from testbed.world.scene import show

        show(self, seen)


def assemble(
    scenario: Scenario,
    machines: Machines,
    model: str | Path | None,
    gui: bool,
    own: OwnParts = NOTHING_OWN,
) -> Assembled:
    """Build the world of a scenario and start it in equilibrium.

    Raises InputError for numbers that cannot be, a URDF that does not load, a model file that is
    none.
    """
    carried, height = scenario.carried_kg, scenario.ropes.attachment_height_m
    believed = believed_robot(machines.belief, model, scenario.tolerances)
    with believed.bodies() as urdf:
        belief = Robot.of(believed.machine, carried, height, urdf)
    seeds = [np.random.default_rng([scenario.seed, index]) for index in range(3)]
    site = _true_site(scenario, machines)
    ground = make_ground(site.terrain)
    hidden = hidden_beside(machines.drawn.undeclared, scenario.undeclared)
    drill = drilling_of(scenario.drilling, scenario.seed, machines.truth)
    compile_apart()  # a scenario that cannot be is refused before that
    with bodies_of(hidden, machines.truth.urdf) as urdf:
        robot = Robot.of(machines.truth, carried, height, urdf)
        engine = Engine(
            urdf,
            ground,
            step_s=1.0 / scenario.rates.physics_hz,
            robot_first=scenario.terrain.loading_order == "robot_first",
            gui=gui,
            sinking=scenario.terrain.loose or sinking(tuple(hidden.feet.values())),
        )
    try:
        if carried > 0.0:
            engine.add_store_mass(carried)
        for number, axis in enumerate(AXES):
            engine.add_link_mass(number, hidden.cylinders[axis].mass_kg)
        known = drill_known(drill, DrillKnown.zeros()[0])
        start = find_start(site, ground, robot.model, engine, machines.truth, known, hidden)
        engine.reset(start.position_m, start.rotation, start.joints)
        truth = Truth(site, ground, robot, hidden, seeds[0])
        boards = initial_boards(truth, belief, engine, start)
        DrillReporter(drill).report(boards, known)
        seen = replace(start, joints=boards["loops"]["reference"][0].copy())
        electronics = _electronics(scenario, believed, belief, seen, own)
    except BaseException:
        engine.close()
        raise
    return Assembled(
        boards=boards,
        engine=engine,
        ground=ground,
        footing=start.footing,
        drill=drill,
        noise_rng=seeds[1],
        added_noise_rng=np.random.default_rng([scenario.seed, 40]),
        judge=Judge(
            start.rotation,
            robot.model.total_mass_kg * GRAVITY_M_S2,
            start.raised,
            machines.truth.scale,
        ),
        kinematics=robot.model,
        hidden=hidden,
        belief=belief,
        start_joints=seen.joints,
        start_base=start.position_m.copy(),
        thrust_factor=hidden.thrust_factor,
        **electronics,
    )


def _true_site(scenario: Scenario, machines: Machines) -> Scenario:
    """The scenario on the ground as it is, which nobody measured."""
    factor, terrain = machines.drawn.ground_stiffness_factor, scenario.terrain
    if factor == 1.0:
        return scenario
    true = terrain.model_copy(update={"stiffness_n_m": terrain.stiffness_n_m * factor})
    return scenario.model_copy(update={"terrain": true})


def _electronics(
    scenario: Scenario, believed: BelievedRobot, belief: Robot, start: Start, own: OwnParts
) -> dict[str, Any]:
    """What the machine's electronics run, and what people worked out before the run: fields of
    Assembled. The joints of `start` are those that the encoders read.
    """
    expected = ExpectedLoads(belief.model, belief.machine)
    pulls = start.rope_tension_n[:, None] * (start.surveyed_directions @ start.rotation)
    gravity = start.rotation.T @ np.array([0.0, 0.0, -GRAVITY_M_S2])
    thrust = thrust_bound(scenario, expected, start.joints, gravity, pulls)
    return {
        "start_events": thrust_events(scenario.drilling, thrust),
        "thrust": thrust,
        "chain": _chain(scenario, believed, belief, start.surveyed_ropes),
        "expectation": Expectation(expected, start.surveyed_ropes),
        "gait": gait_of(scenario, _believed_start(belief, start, scenario), own),
    }


def _believed_start(belief: Robot, start: Start, scenario: Scenario) -> BelievedStart:
    """What people measured of the place and the load before the run, and what control believes of
    the machine.
    """
    return BelievedStart(
        robot=belief,
        joints=start.joints,
        load_n=start.foot_forces_in_body[:, 2],
        rope_tension_n=start.rope_tension_n,
        rope_directions_in_body=start.surveyed_directions @ start.rotation,
        anchors_in_body_m=(start.surveyed_anchors_m - start.position_m) @ start.rotation,
        rope_strokes=scenario.ropes.enabled and scenario.ropes.strokes,
    )


def _chain(
    scenario: Scenario, believed: BelievedRobot, robot: Robot, ropes: SurveyedRopes
) -> EstimatorChain:
    belief = believed.legs(1.0 / scenario.rates.estimator_hz)
    wanted = {
        "kbf_q_n2": scenario.estimator.process_variance_n2,
        "kbf_r_n2": scenario.estimator.measurement_variance_n2,
        "e_max_n": scenario.estimator.innovation_limit_n,
        "contact_off_n": scenario.estimator.contact_threshold_n,
    }
    changes: dict[str, Any] = {name: value for name, value in wanted.items() if value is not None}
    belief = replace(belief, tuning=replace(belief.tuning, **changes))
    return EstimatorChain(believed.with_body(belief, robot.model, ropes))
