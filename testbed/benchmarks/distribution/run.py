"""One case of the force-distribution benchmark under one controller, or under the oracle that knows
the truth.

One second of position hold brings the footing in, then the controller takes over; a second later
the measuring begins, and a second after that the drill. The oracle is the quadratic program on the
true foot loads, rope tensions and attitude.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from testbed.control.distribution.controllers import controller
from testbed.control.distribution.distribution import Controller, Distribution
from testbed.control.distribution.quadratic import Constraints, Quadratic
from testbed.control.distribution.statics import FEET, NORMALS, UNKNOWNS, Balance, Statics
from testbed.control.gait import Layered, Measured
from testbed.control.layers import Trim
from testbed.formats.arrays import Array, Flags
from testbed.machine.names import LEGS
from testbed.scenario.scenario import Scenario, load_scenario

if TYPE_CHECKING:
    from testbed.world.simulation import Simulation


# The held-out cases of the force-distribution benchmark, and what is measured of one.
#
# A case: slope, friction, payload, ropes, drill and (in a third) one undeclared effect, drawn from
# the set `distribution` of randomisation.yaml, and a footing: each foot's height error, which the
# machine cannot know.

HELD_OUT_SEED = 987_001
FOOTING_SD_M = 7.0e-4
"""Height error of a footing (E): two or three millimetres of rock under a plate that settles,
levelled by eye.
"""


@dataclass(frozen=True)
class Case:
    """One held-out case."""

    seed: int
    overrides: tuple[str, ...]
    footing_m: tuple[float, float, float, float]
    block: int = 0
    """Which of the held-out sets it is of."""
    number: int = 0

    @property
    def key(self) -> str:
        """Its name in a folder."""
        return f"{self.number:04d}" if self.block == 0 else f"{self.block}-{self.number:04d}"

    @property
    def affected(self) -> bool:
        """Whether the world has an effect that the model lacks."""
        return "undeclared=[]" not in self.overrides

    def scenario(self) -> Scenario:
        """The case as a scenario of its own."""
        return load_scenario("drill_slope_45", list(self.overrides), seed=self.seed)


@dataclass(frozen=True)
class Outcome:
    """One controller's run of one case."""

    controller: str
    friction_use: float
    """95th percentile over time of the highest tangential / (true friction * normal)."""
    lowest_normal_n: float
    losses: int
    hours: float
    body_motion_m: float
    rope_range_n: float
    valve_effort: float
    """Mean opening of the vertical joints' valves, share of full."""
    plans_checked: int
    infeasible: int
    """Plans that break a constraint although some plan would not."""
    solve_p99_s: float
    verdict: str


def draw_cases(count: int, seeds: int = 1, machine: str | None = None) -> list[Case]:
    """The first `count` held-out cases of each of `seeds` sets; a case does not depend on how many
    there are.

    `machine`: tolerances from which each case draws its world's machine.
    """
    from testbed.envs.randomisation import draw_overrides, named_set

    cases = []
    for block in range(seeds):
        for index in range(count):
            rng = np.random.default_rng([HELD_OUT_SEED + block, index])
            overrides = tuple(draw_overrides(named_set("distribution"), rng))
            if machine is not None:
                overrides += (f"machine.draw={machine}", f"machine.seed={index}")
            footing = rng.normal(0.0, FOOTING_SD_M, len(LEGS))
            cases.append(
                Case(int(rng.integers(2**31)), overrides, tuple(footing.tolist()), block, index)
            )
    return cases


ON_S, MEASURE_S = 1.0, 2.0
LOST_N, LOST_ROWS, FLOOR_N = 100.0, 20, 100.0
"""A foot is lost when its normal load stays below LOST_N for LOST_ROWS ms; friction use counts no
less than FLOOR_N.
"""
ORACLE = "oracle"
PUT_RIGHT_S = 0.2


class Informed(Statics):
    """The oracle's balance: what is measured, put right by the truth.

    The truth comes in over PUT_RIGHT_S: the friction in fast pressures damps the loops, and a loop
    that hears the bare truth hunts.
    """

    def __init__(self, known: Statics) -> None:
        self.__dict__.update(known.__dict__)
        self.truth = np.zeros(UNKNOWNS)
        """(14,) true foot forces and rope pulls."""
        self.attitude_rad = np.zeros(3)
        self._error: Array | None = None

    def balance(self, measured: Measured, stance: Flags) -> Balance:
        """The balance now."""
        now = super().balance(measured.but(attitude=self.attitude_rad), stance)
        error = now.measured - self.truth
        self._error = (
            error
            if self._error is None
            else self._error + 0.01 / PUT_RIGHT_S * (error - self._error)
        )
        return replace(now, measured=now.measured - self._error)

    def tell(self, truth: dict[str, float]) -> None:
        """The truth of the last tick: means, so that blows between two ticks are no alias."""
        from scipy.spatial.transform import Rotation

        for index, side in enumerate(("left", "right")):
            self.truth[FEET + index] = np.linalg.norm(
                [truth[f"rope_force_in_world_{side}_{axis}"] for axis in "xyz"]
            )
        turned = Rotation.from_quat(
            [truth[f"body_pose_in_world_{part}"] for part in ("qx", "qy", "qz", "qw")]
        )
        force = np.array(
            [[truth[f"foot_force_in_world_{leg}_{axis}"] for axis in "xyz"] for leg in LEGS]
        )
        self.truth[:FEET] = (force @ turned.as_matrix())[:, [2, 0, 1]].ravel()
        yaw, pitch, roll = turned.as_euler("ZYX")
        self.attitude_rad = np.array([roll, pitch, yaw])


def run_case(case: Case, name: str, sharing: Controller | None = None) -> Outcome:
    """One case under one controller: a name of the table, `oracle`, or `sharing` under any name."""
    from testbed.world.simulation import Simulation

    spec = case.scenario()
    sim = Simulation(spec)
    try:
        return _run(sim, spec, case, name, sharing)
    finally:
        sim.close()


def _run(
    sim: Simulation, spec: Scenario, case: Case, name: str, sharing: Controller | None
) -> Outcome:
    machine = sim.machine
    trim = Trim()
    trim.goal_m = np.array(case.footing_m)
    machine.gait = Layered(machine.gait, (trim,))
    hz = spec.rates.record_hz
    blocks = [sim.run_block(round(ON_S * hz))]
    if sharing is None:
        sharing = Quadratic(spec.terrain.friction) if name == ORACLE else controller(name)
    ropes = machine.expectation.surveyed.turned(machine.ground.rotation_slope_to_world.T)
    statics = Statics(machine.belief.model, machine.belief.machine, ropes)
    oracle = Informed(statics) if name == ORACLE else None
    layer = Distribution(oracle or statics, sharing)
    machine.gait = Layered(machine.gait, (layer,))
    layer.timed = True
    judge, checked, infeasible = Quadratic(spec.terrain.friction), 0, 0
    while not sim.finished:
        if oracle is not None:
            oracle.tell(
                dict(zip(sim.truth_columns, blocks[-1][1][-hz // 100 :].mean(axis=0), strict=True))
            )
        blocks.append(sim.run_block(hz // 100 if oracle is not None else hz // 4))
        due = oracle is None or len(blocks) % 25 == 0
        if due and layer.plan is not None and layer.balance is not None and name != "position_hold":
            load = layer.balance.load if layer.plan.load is None else layer.plan.load
            wanted = judge.constraints(replace(layer.balance, load=load), 0.0)
            checked += 1
            bad = not layer.plan.feasible or breaks(layer.plan.forces / wanted.scale, wanted)
            infeasible += int(bad and possible(wanted))
    data, truth = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    return _measure(sim, spec, name, data, truth, layer, checked, infeasible)


def _measure(
    sim: Simulation,
    spec: Scenario,
    name: str,
    data: Array,
    truth: Array,
    layer: Distribution,
    checked: int,
    infeasible: int,
) -> Outcome:
    read = {column: truth[:, index] for index, column in enumerate(sim.truth_columns)}
    inside = read["t"] >= MEASURE_S
    if not inside.any():  # lost before the measuring began
        inside[-1] = True
    normal = np.stack([read[f"contact_normal_{leg}"] for leg in LEGS], axis=1)[inside]
    forces = np.stack(
        [[read[f"foot_force_in_world_{leg}_{axis}"] for axis in "xyz"] for leg in LEGS]
    ).transpose(2, 0, 1)
    across = np.sqrt(np.maximum((forces[inside] ** 2).sum(axis=2) - normal**2, 0.0))
    use = across / (spec.terrain.friction * np.maximum(normal, FLOOR_N))
    body = np.stack([read[f"body_pose_in_world_{axis}"] for axis in "xyz"], axis=1)[inside]
    seen = {column: data[:, index] for index, column in enumerate(sim.data_columns)}
    tension = np.stack([seen[f"rope_tension_{side}"] for side in ("left", "right")], axis=1)[inside]
    valves = np.stack([seen[f"valve_{leg}_vertical"] for leg in LEGS])[:, inside]
    return Outcome(
        controller=name,
        friction_use=float(np.quantile(use.max(axis=1), 0.95)),
        lowest_normal_n=float(normal.min()),
        losses=sum(count_losses(normal[:, leg]) for leg in range(len(LEGS)))
        + int(sim.verdict != "stood"),
        hours=float(inside.sum()) / spec.rates.record_hz / 3600.0,
        body_motion_m=float(np.linalg.norm(body - body[0], axis=1).max()),
        rope_range_n=float((tension.max(axis=0) - tension.min(axis=0)).max()),
        valve_effort=float(np.abs(valves).mean()),
        plans_checked=checked,
        infeasible=infeasible,
        solve_p99_s=float(
            np.quantile(layer.solve_s[2:] or [0.0], 0.99)
        ),  # lost before it planned: nothing to time
        verdict=str(sim.verdict),
    )


def count_losses(normal_n: Array) -> int:
    """How often a foot's normal load (n,) stays below LOST_N for LOST_ROWS rows."""
    low = np.concatenate([[False], normal_n < LOST_N, [False]])
    edges = np.flatnonzero(np.diff(low.astype(int)))
    return int(np.sum(edges[1::2] - edges[::2] >= LOST_ROWS))


def breaks(plan: Array, constraints: Constraints, tolerance: float = 1e-4) -> bool:
    """Whether a plan (14,), in units of the load, breaks a constraint by more than the
    tolerance.
    """
    over = max(
        float((constraints.rows @ plan - constraints.high).max()),
        float((constraints.low - constraints.rows @ plan).max()),
    )
    off = float(np.abs(constraints.balance @ plan - constraints.value).max())
    outside = max(float((constraints.below - plan).max()), float((plan - constraints.above).max()))
    return max(over, off, outside) > tolerance or bool((plan[NORMALS] < -tolerance).any())


def possible(constraints: Constraints) -> bool:
    """Whether a linear program finds any plan."""
    from scipy.optimize import linprog

    bounded = np.isfinite(constraints.low)
    found = linprog(
        np.zeros(len(constraints.below)),
        A_ub=np.vstack([constraints.rows, -constraints.rows[bounded]]),
        b_ub=np.concatenate([constraints.high, -constraints.low[bounded]]),
        A_eq=constraints.balance,
        b_eq=constraints.value,
        bounds=list(zip(constraints.below, constraints.above, strict=True)),
    )
    return bool(found.status == 0)
