"""Expected foot loads against the simulated truth, in quiet stands over random postures, slopes,
ropes and drills.

A case: the robot is put down on a plane, valves shut, each leg longer than its encoder says by a
normal error of FOOTING_SD_M; rope pulls and the drill's thrust and torque are drawn. When it has
come to rest, the truth is read and compared with

- what is expected with the feet's true heights under load and the ground's true stiffness,
- what is expected from encoder readings, load pins, inertial unit and nominal geometry alone: its
  three combinations that equilibrium fixes, and for each foot an interval that is to cover nine
  times in ten.

Then the thrust rises until the first foot leaves: its name and the thrust are compared with those
predicted.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from testbed.benchmarks.climbs.stands import (
    fixed_combinations,
    heights_under_load,
    load_interval_n,
    loads_of_measured_posture,
)
from testbed.benchmarks.harness import Answers, Benchmark, rms
from testbed.formats.arrays import Array
from testbed.machine.build import build_machine
from testbed.machine.names import GRAVITY_M_S2, LEGS, VERTICAL
from testbed.report.page import Table
from testbed.robot.contact.geometry import FootLoads
from testbed.robot.loads.foot_loads import ExpectedLoads, Footing, drill_wrench
from testbed.robot.model import RobotModel, attitude_gravity, rotation_from_attitude
from testbed.scenario.scenario import load_scenario

if TYPE_CHECKING:
    from testbed.world.simulation import Simulation


SEED = 52_000
FOOTING_SD_M = 3.0e-4
"""Error of a foot's height, which its encoder does not see (E): its zero, or a plate on levelled
rock; with more, feet stand in the air."""
DROP_M = 5.0e-4
"""Legs that start on the ground reach for it, and would make up for what their footing errs."""
SETTLE_S, RAMP_S = 1.5, 3.0
GONE_N = 5.0
NEAR = 0.10
"""A foot is about to leave when its reserve along the drill axis is below this share of the weight
on the slope. The question is asked when the rising thrust has come so near."""
QUARTER_N = 1000.0 * GRAVITY_M_S2


@dataclass(frozen=True)
class Case:
    """One stand. Loads N, along the vertical joints; LEGS order."""

    number: int
    slope_deg: float
    normal_load_n: float
    true_n: list[float]
    known_n: list[float]
    """With true heights and stiffness."""
    combination_error_n: list[float]
    """Encoders alone: the three combinations that equilibrium fixes, size 1."""
    low_n: list[float]
    high_n: list[float]
    first_true: str | None
    """First foot to leave, None if none did within the ramp."""
    reserve_true_n: float
    first_known: str | None
    reserve_known_n: float
    first_nominal: str | None
    near_true_n: float
    """Reserve left when the question was asked again, and the answers then."""
    near_known: str | None
    near_nominal: str | None
    call_us: float


@dataclass(frozen=True)
class Drawn:
    """What a case draws: changes of a stand's scenario, how much longer each leg is than its
    encoder says (4), and what the drill does.
    """

    overrides: list[str]
    footing_m: Array
    thrust_n: float
    torque_n_m: float


def draw(number: int) -> Drawn:
    """What case `number` draws."""
    rng = np.random.default_rng([SEED, number])
    slope = float(rng.uniform(0.0, 80.0))
    length_m = rng.uniform(0.15, 0.35)
    footing_m = rng.normal(0.0, FOOTING_SD_M, len(LEGS))
    share = float(rng.uniform(0.85, 1.0)) if slope > 20.0 else float(rng.uniform(0.0, 1.0))
    along = 4000.0 * GRAVITY_M_S2 * np.sin(np.radians(slope)) * share / 2.0
    pull = along * rng.uniform(0.95, 1.05, 2)
    thrust = float(rng.uniform(0.0, 0.6)) * 4000.0 * GRAVITY_M_S2 * np.cos(np.radians(slope))
    overrides = [
        f"terrain.slope_deg={slope:.3f}",
        f"robot.vertical_m={(length_m + footing_m).tolist()}",
        f"robot.height_offset_m={DROP_M}",
        f"robot.radial_m={rng.uniform(0.05, 0.35, len(LEGS)).tolist()}",
        f"robot.rotation_deg={rng.uniform(-20.0, 20.0, len(LEGS)).tolist()}",
        f"ropes.tension_n={pull.tolist()}",
        "hydraulics.valves_locked=true",
        "rates.record_hz=10",
    ]
    return Drawn(overrides, footing_m, thrust, float(rng.uniform(0.0, 500.0)))


def stand(number: int) -> Case | None:
    """One case; None where the drawn stance does not stand."""
    from testbed.world.simulation import Simulation

    drawn = draw(number)
    world = Simulation(
        load_scenario("stand_slope_45", drawn.overrides, seed=number, duration=SETTLE_S + RAMP_S)
    )
    try:
        board = world.machine.board
        board.drill.feed, board.drill.torque = drawn.thrust_n, drawn.torque_n_m
        world.run_block(round(10 * SETTLE_S))
        if world.verdict != "stood" or np.count_nonzero(board.normal_force > GONE_N) < 3:
            return None
        now, true = _look(world, drawn, drawn.thrust_n), board.normal_force.copy()
        combinations = fixed_combinations(
            world.machine.belief.model.foot_positions_m(now.position)[:, :2]
        )
        first, reserve, near, near_n = _first_to_leave(world, drawn)
        return Case(
            number,
            world.scenario.terrain.slope_deg,
            float(true.sum()),
            true.tolist(),
            now.known.normal_n.tolist(),
            (combinations @ (now.nominal.vertical_load_n - true)).tolist(),
            now.low.tolist(),
            now.high.tolist(),
            first,
            reserve,
            now.known.unloads_first,
            now.known.unload_reserve_n,
            now.nominal.unloads_first,
            near_n,
            None if near is None else near.known.unloads_first,
            None if near is None else near.nominal.unloads_first,
            now.call_us,
        )
    finally:
        world.close()


def _nominal() -> ExpectedLoads:
    machine = build_machine()
    return ExpectedLoads(RobotModel(machine.urdf), machine)


@dataclass(frozen=True)
class Look:
    """What is expected at one moment, informed and from sensors alone, and the interval of the
    latter.
    """

    position: Array
    known: FootLoads
    nominal: FootLoads
    low: Array
    high: Array
    call_us: float


def _look(world: Simulation, drawn: Drawn, thrust_n: float) -> Look:
    position, gravity, acts = _sensed(world, drawn, thrust_n)
    expected = _nominal()
    acts["joint_compliance"] = _give(expected, position, world.row)
    started = time.perf_counter()
    nominal = expected.solve(position, gravity, **acts)
    call_us = 1e6 * (time.perf_counter() - started)
    low, high = load_interval_n(expected, position, gravity, FOOTING_SD_M, **acts)
    return Look(position, _informed(world, drawn, thrust_n), nominal, low, high, call_us)


def _give(expected: ExpectedLoads, position: Array, row: Any) -> Array:
    """Compliance of the joints (12) at the pressures that sensors read, each the mean of its kind:
    what a leg carries, which its own pressure would tell, is not to be expected from it.
    """
    of_each = expected.oil.joint_compliance(position, (row["pressure_a"], row["pressure_b"]))
    return np.tile(of_each.reshape(len(LEGS), -1).mean(axis=0), len(LEGS))


def _sensed(
    world: Simulation, drawn: Drawn, thrust_n: float
) -> tuple[Array, Array, dict[str, Any]]:
    """Joint positions, gravity in the body frame and acting loads as the sensors have them."""
    row = world.row
    attitude = row["attitude"].copy()
    directions = world.machine.expectation.rope_directions_in_world @ rotation_from_attitude(
        attitude
    )
    acts = {
        "rope_forces_in_body": row["rope_tension"][:, None] * directions,
        "drill_wrench_in_body": drill_wrench(
            world.machine.belief.model, thrust_n, -drawn.torque_n_m
        ),
    }
    position = row["position"].copy()
    position[list(VERTICAL)] -= drawn.footing_m
    return (
        position,
        attitude_gravity(attitude[0], attitude[1]),
        acts,
    )


def _informed(world: Simulation, drawn: Drawn, thrust_n: float) -> FootLoads:
    """With the feet's true heights under load, the ground's true stiffness and friction, and the
    true loads.
    """
    machine, board, terrain = world.machine, world.machine.board, world.scenario.terrain
    rotation = board.rotation
    informed = ExpectedLoads(
        machine.kinematics,
        world.machines.truth,
        friction=terrain.friction,
        ground_compliance_m_n=1.0 / terrain.stiffness_n_m,
    )
    normals = np.tile(machine.ground.normal_in_world @ rotation, (len(LEGS), 1))
    heights = heights_under_load(informed, board.engine.joint, normals)
    return loads_of_measured_posture(
        informed,
        board.engine.joint,
        rotation.T @ np.array([0.0, 0.0, -GRAVITY_M_S2]),
        Footing(normals_in_body=normals, heights_m=heights),
        rope_forces_in_body=board.ropes["force"] @ rotation,
        drill_wrench_in_body=drill_wrench(world.machine.belief.model, thrust_n, -drawn.torque_n_m),
    )


def _first_to_leave(
    world: Simulation, drawn: Drawn
) -> tuple[str | None, float, Look | None, float]:
    """Raise the thrust slowly until a foot's load is gone.

    Its name, the thrust it took N, what was expected when NEAR of the load was left, and what was
    left then, N.
    """
    board = world.machine.board
    if (board.normal_force <= GONE_N).any():
        return None, float("inf"), None, float("inf")
    start, total = float(board.drill.feed), float(board.normal_force.sum())
    weight = 4000.0 * GRAVITY_M_S2 * math.cos(math.radians(world.scenario.terrain.slope_deg))
    looks: list[tuple[float, Look]] = []
    for share in np.linspace(0.0, 1.0, round(RAMP_S * 10)):
        board.drill.feed = start + share * total
        world.run_block(1)
        if (board.normal_force <= GONE_N).any():
            leg, reserve = LEGS[int(np.argmin(board.normal_force))], float(share * total)
            near = [(reserve - at, look) for at, look in looks if reserve - at <= NEAR * weight]
            return leg, reserve, *((near[0][1], near[0][0]) if near else (None, float("inf")))
        looks.append((float(share * total), _look(world, drawn, start + share * total)))
        if world.finished:
            break
    return None, float("inf"), None, float("inf")


@dataclass(frozen=True)
class ExpectedLoadStands(Benchmark[int]):
    """The first `count` stands."""

    name = "expected_loads"
    noun = "stands"
    count: int = 400

    def cases(self) -> Mapping[str, int]:
        """The stands' numbers."""
        return {str(number): number for number in range(self.count)}

    def work(self, case: int) -> Case | None:
        """See stand."""
        return stand(case)

    def without(self) -> tuple[str, ...]:
        """The other benchmarks of this folder."""
        return ("benchmarks/climbs/climbs.py", "benchmarks/climbs/stands.py")

    def summarise(self, answers: Answers) -> dict[str, float]:
        """See scores."""
        return scores([Case(**answer) for answer in answers.values() if answer is not None])

    def tables(self, result: dict[str, float]) -> Sequence[Table]:
        """One table."""
        return [table(result)]


def scores(cases: Sequence[Case]) -> dict[str, float]:
    """The numbers of the table. Errors as shares of a quarter of the weight."""
    true = np.array([case.true_n for case in cases])
    near = [case for case in cases if case.near_known is not None]
    far = [case for case in cases if case.first_true is not None]
    inside = (true >= [case.low_n for case in cases]) & (true <= [case.high_n for case in cases])
    return {
        "cases": len(cases),
        "known_rms": rms(np.array([case.known_n for case in cases]) - true) / QUARTER_N,
        "combination_rms": rms([case.combination_error_n for case in cases]) / QUARTER_N,
        "interval_cover": float(inside.mean()),
        "interval_width_n": float(
            np.median(np.subtract([case.high_n for case in cases], [case.low_n for case in cases]))
        ),
        "near": len(near),
        "named_near": float(np.mean([case.near_known == case.first_true for case in near]))
        if near
        else float("nan"),
        "named_near_nominal": float(
            np.mean([case.near_nominal == case.first_true for case in near])
        )
        if near
        else float("nan"),
        "named_all": float(np.mean([case.first_known == case.first_true for case in far]))
        if far
        else float("nan"),
        "call_us": float(np.median([case.call_us for case in cases])),
    }


def table(scored: Mapping[str, float]) -> Table:
    """What is known, what came of it."""
    of_weight = f"share of weight / 4, {scored['cases']:.0f} stands"
    near = f"first foot to leave named, where one is near to it ({scored['near']:.0f} stands)"
    footing = f"the same, footing known to {1000 * FOOTING_SD_M:g} mm"
    cover = (
        f"{100 * scored['interval_cover']:.1f} % (median width {scored['interval_width_n']:.0f} N)"
    )
    sensors = "encoders, load pins, inertial unit"

    def share(name: str, digits: int = 1) -> str:
        return f"{100 * scored[name]:.{digits}f} %"

    rows = [
        ["true heights under load and stiffness", f"RMS error of a load, {of_weight}"],
        [sensors, "RMS error of the fixed combinations, share of weight / 4"],
        [footing, "loads inside their 90 % interval"],
        ["true heights", near],
        ["true heights", "first foot to leave named, all stands"],
        ["encoders alone", "first foot to leave named, where one is near to it"],
        ["", "time of a call, median"],
    ]
    values = [share("known_rms", 2), share("combination_rms", 2), cover, share("named_near")]
    values += [share("named_all"), share("named_near_nominal"), f"{scored['call_us']:.0f} us"]
    heads = ["what is known", "quantity", "of these stands"]
    shown = [[*row, value] for row, value in zip(rows, values, strict=True)]
    return Table("Expected foot loads", heads, shown)
