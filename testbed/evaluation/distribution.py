"""The force-distributing controllers on identical held-out cases, against an oracle that knows the truth.

A case: slope, friction, payload, ropes, drill and (in a third) one undeclared effect, drawn from the set `distribution`
of randomisation.yaml, and a footing: each foot's height error, which the machine cannot know. Its run: one second of
position hold brings the footing in, then the controller takes over; a second later the measuring begins, and a second
after that the drill. The oracle is the same quadratic program on the true foot loads, rope tensions and attitude.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.control.controllers import CONTROLLERS, controller, distributed
from testbed.control.distribution import Distribution, Sharing
from testbed.control.quadratic import Constraints, Quadratic
from testbed.control.references import Command, Measured
from testbed.control.statics import NORMALS
from testbed.control.trim import Trim
from testbed.errors import InputError
from testbed.parameters.names import LEGS
from testbed.parameters.scenario import Scenario, load_scenario

Array = NDArray[np.float64]
HELD_OUT_SEED = 987_001
FOOTING_SD_M = 7.0e-4
"""Height error of a footing (E): two or three millimetres of rock under a plate that settles, levelled by eye."""
ON_S, MEASURE_S = 1.0, 2.0
LOST_N, LOST_ROWS, FLOOR_N = 100.0, 20, 100.0
"""A foot is lost when its normal load stays below LOST_N for LOST_ROWS ms; friction use counts no less than FLOOR_N."""
ORACLE = "oracle"


@dataclass(frozen=True)
class Case:
    """One held-out case."""

    seed: int
    overrides: tuple[str, ...]
    footing_m: tuple[float, float, float, float]

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


def draw_cases(count: int, seed: int = HELD_OUT_SEED) -> list[Case]:
    """The first `count` held-out cases; case k does not depend on how many there are."""
    from testbed.envs.randomisation import draw_overrides, named_set

    cases = []
    for k in range(count):
        rng = np.random.default_rng([seed, k])
        overrides = tuple(draw_overrides(named_set("distribution"), rng))
        footing = rng.normal(0.0, FOOTING_SD_M, len(LEGS))
        cases.append(Case(int(rng.integers(2**31)), overrides, tuple(footing.tolist())))
    return cases


class Oracle:
    """A distribution whose measurements are replaced by the truth before each tick."""

    def __init__(self, inner: Distribution) -> None:
        self.inner = inner
        self.force_n = np.zeros((len(LEGS), 3))
        self.tension_n = np.zeros(2)
        self.attitude_rad = np.zeros(3)

    def update(self, t: float, dt: float, measured: Measured) -> Command:
        """See Program."""
        known = replace(
            measured, foot_force_in_body_n=self.force_n, rope_tension_n=self.tension_n, attitude_rad=self.attitude_rad
        )
        return self.inner.update(t, dt, known)

    def tell(self, truth: dict[str, float]) -> None:
        """The truth of the last tick: means, so that blows between two ticks are no alias."""
        from scipy.spatial.transform import Rotation

        for k, side in enumerate(("left", "right")):
            self.tension_n[k] = np.linalg.norm([truth[f"rope_force_in_world_{side}_{axis}"] for axis in "xyz"])
        turned = Rotation.from_quat([truth[f"body_pose_in_world_{k}"] for k in ("qx", "qy", "qz", "qw")])
        force = np.array([[truth[f"foot_force_in_world_{leg}_{axis}"] for axis in "xyz"] for leg in LEGS])
        self.force_n = force @ turned.as_matrix()
        yaw, pitch, roll = turned.as_euler("ZYX")
        self.attitude_rad = np.array([roll, pitch, yaw])


def run_case(case: Case, name: str, sharing: Sharing | None = None) -> Outcome:
    """One case under one controller: a name of the table, `oracle`, or `sharing` under any name."""
    from testbed.world.simulation import Simulation

    spec = case.scenario()
    sim = Simulation(spec)
    try:
        return _run(sim, spec, case, name, sharing)
    finally:
        sim.close()


def _run(sim: Any, spec: Scenario, case: Case, name: str, sharing: Sharing | None) -> Outcome:
    machine = sim.machine
    trim = Trim(machine.program)
    trim.goal_m = np.array(case.footing_m)
    machine.program = trim
    hz = spec.rates.record_hz
    blocks = [sim.run_block(round(ON_S * hz))]
    if sharing is None:
        sharing = Quadratic(spec.terrain.friction) if name == ORACLE else controller(name)
    ropes = machine.expectation.rope_directions_in_world @ machine.ground.rotation_slope_to_world
    program = distributed(spec, trim, ropes, sharing)
    oracle = Oracle(program) if name == ORACLE else None
    machine.program = oracle if oracle is not None else program
    judge, checked, infeasible = Quadratic(spec.terrain.friction), 0, 0
    while not sim.finished:
        if oracle is not None:
            oracle.tell(dict(zip(sim.truth_columns, blocks[-1][1][-hz // 100 :].mean(axis=0), strict=True)))
        blocks.append(sim.run_block(hz // 100 if oracle is not None else hz // 4))
        due = oracle is None or len(blocks) % 25 == 0
        if due and program.plan is not None and program.balance is not None and name != "position_hold":
            load = program.balance.load if program.plan.load is None else program.plan.load
            wanted = judge.constraints(replace(program.balance, load=load), 0.0)
            checked += 1
            bad = not program.plan.feasible or breaks(program.plan.forces / wanted.scale, wanted)
            infeasible += int(bad and possible(wanted))
    data, truth = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    return _measure(sim, spec, name, data, truth, program, checked, infeasible)


def _measure(
    sim: Any, spec: Scenario, name: str, data: Array, truth: Array, program: Distribution, checked: int, infeasible: int
) -> Outcome:
    read = {column: truth[:, k] for k, column in enumerate(sim.truth_columns)}
    inside = read["t"] >= MEASURE_S
    if not inside.any():  # lost before the measuring began
        inside[-1] = True
    normal = np.stack([read[f"contact_normal_{leg}"] for leg in LEGS], axis=1)[inside]
    forces = np.stack([[read[f"foot_force_in_world_{leg}_{k}"] for k in "xyz"] for leg in LEGS]).transpose(2, 0, 1)
    across = np.sqrt(np.maximum((forces[inside] ** 2).sum(axis=2) - normal**2, 0.0))
    use = across / (spec.terrain.friction * np.maximum(normal, FLOOR_N))
    body = np.stack([read[f"body_pose_in_world_{k}"] for k in "xyz"], axis=1)[inside]
    seen = {column: data[:, k] for k, column in enumerate(sim.data_columns)}
    tension = np.stack([seen[f"rope_tension_{side}"] for side in ("left", "right")], axis=1)[inside]
    valves = np.stack([seen[f"valve_{leg}_vertical"] for leg in LEGS])[:, inside]
    return Outcome(
        controller=name,
        friction_use=float(np.quantile(use.max(axis=1), 0.95)),
        lowest_normal_n=float(normal.min()),
        losses=sum(count_losses(normal[:, leg]) for leg in range(len(LEGS))) + int(sim.verdict != "stood"),
        hours=float(inside.sum()) / spec.rates.record_hz / 3600.0,
        body_motion_m=float(np.linalg.norm(body - body[0], axis=1).max()),
        rope_range_n=float((tension.max(axis=0) - tension.min(axis=0)).max()),
        valve_effort=float(np.abs(valves).mean()),
        plans_checked=checked,
        infeasible=infeasible,
        solve_p99_s=float(np.quantile(program.solve_s[2:], 0.99)),
        verdict=str(sim.verdict),
    )


def count_losses(normal_n: Array) -> int:
    """How often a foot's normal load (n,) stays below LOST_N for LOST_ROWS rows."""
    low = np.concatenate([[False], normal_n < LOST_N, [False]])
    edges = np.flatnonzero(np.diff(low.astype(int)))
    return int(np.sum(edges[1::2] - edges[::2] >= LOST_ROWS))


def breaks(z: Array, c: Constraints, tolerance: float = 1e-4) -> bool:
    """Whether a plan (14,), in units of the load, breaks a constraint by more than the tolerance."""
    over = max(float((c.rows @ z - c.high).max()), float((c.low - c.rows @ z).max()))
    off = float(np.abs(c.balance @ z - c.value).max())
    outside = max(float((c.below - z).max()), float((z - c.above).max()))
    return max(over, off, outside) > tolerance or bool((z[NORMALS] < -tolerance).any())


def possible(c: Constraints) -> bool:
    """Whether a linear program finds any plan."""
    from scipy.optimize import linprog

    bounded = np.isfinite(c.low)
    found = linprog(
        np.zeros(len(c.below)), A_ub=np.vstack([c.rows, -c.rows[bounded]]),
        b_ub=np.concatenate([c.high, -c.low[bounded]]), A_eq=c.balance, b_eq=c.value,
        bounds=list(zip(c.below, c.above, strict=True)),
    )  # fmt: skip
    return bool(found.status == 0)


def all_outcomes(case: Case, names: Sequence[str]) -> list[Outcome]:
    """One case under every controller and the oracle."""
    return [run_case(case, name) for name in (*names, ORACLE)]


def benchmark(
    count: int, jobs: int = 1, names: Sequence[str] = tuple(CONTROLLERS), progress: Callable[[int], None] | None = None
) -> dict[str, Any]:
    """`count` cases under all controllers; the object of distribution.json. Raises InputError for a wrong count."""
    if count < 1 or jobs < 1:
        raise InputError("must be at least 1", field="cases" if count < 1 else "jobs", value=min(count, jobs))
    from concurrent.futures import ProcessPoolExecutor
    from functools import partial

    cases, outcomes = draw_cases(count), []
    work = partial(all_outcomes, names=tuple(names))
    if jobs == 1:
        for k, case in enumerate(cases):
            outcomes.append(work(case))
            if progress is not None:
                progress(k + 1)
    else:
        with ProcessPoolExecutor(jobs) as pool:
            for k, done in enumerate(pool.map(work, cases)):
                outcomes.append(done)
                if progress is not None:
                    progress(k + 1)
    return summarise(cases, outcomes)


def summarise(cases: Sequence[Case], outcomes: Sequence[Sequence[Outcome]]) -> dict[str, Any]:
    """The object of distribution.json, and every single outcome under `runs`."""
    affected = np.array(["undeclared=[]" not in case.overrides for case in cases])
    best = np.array([row[-1].friction_use for row in outcomes])
    table = []
    for k, first in enumerate(outcomes[0]):
        rows = [row[k] for row in outcomes]
        table.append({"name": first.controller, **_scores(rows, best, affected)})
    return {
        "cases": len(cases),
        "friction_use": "95th percentile over time of the highest tangential / (true friction * normal); 1 slides",
        "friction_use_regret": "friction use over the oracle's, less 1; _absolute: less the oracle's",
        "controllers": table,
        "runs": [[asdict(outcome) for outcome in row] for row in outcomes],
    }


def _scores(rows: Sequence[Outcome], best: Array, affected: NDArray[np.bool_]) -> dict[str, Any]:
    use = np.array([r.friction_use for r in rows])
    regret, absolute = use / np.maximum(best, 1e-6) - 1.0, use - best
    lowest, hours = np.array([r.lowest_normal_n for r in rows]), sum(r.hours for r in rows)
    split = {
        f"friction_use_regret_median_{word}": float(np.median(regret[chosen])) if chosen.any() else None
        for word, chosen in (("undeclared", affected), ("declared", ~affected))
    }
    return {
        "friction_use_median": float(np.median(use)),
        "friction_use_regret_median": float(np.median(regret)),
        "friction_use_regret_p95": float(np.quantile(regret, 0.95)),
        "friction_use_regret_absolute_median": float(np.median(absolute)),
        "friction_use_regret_absolute_p95": float(np.quantile(absolute, 0.95)),
        **split,
        "lowest_normal_force_n": float(np.quantile(lowest, 0.05)),
        "lowest_normal_force_median_n": float(np.median(lowest)),
        "losses_per_hour": sum(r.losses for r in rows) / hours,
        "lost_cases": int(sum(r.losses > 0 for r in rows)),
        "infeasible": int(sum(r.infeasible for r in rows)),
        "plans_checked": int(sum(r.plans_checked for r in rows)),
        "solve_p99_s": float(np.quantile([r.solve_p99_s for r in rows], 0.5)),
        "solve_p99_worst_s": float(max(r.solve_p99_s for r in rows)),
        "body_motion_median_m": float(np.median([r.body_motion_m for r in rows])),
        "rope_range_median_n": float(np.median([r.rope_range_n for r in rows])),
        "valve_effort_mean": float(np.mean([r.valve_effort for r in rows])),
    }


def check(folder: Path, names: Sequence[str] | None) -> tuple[str, ...]:
    """The controllers asked for (None: all). Raises InputError for an unknown one or a folder that cannot be made."""
    chosen = tuple(names) if names else tuple(CONTROLLERS)
    for name in chosen:
        controller(name)
    _make(folder)
    return chosen


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError("cannot be made", file=folder, field="--out", allowed="a folder you may write to") from error


def table(result: dict[str, Any]) -> tuple[list[str], list[list[str]]]:
    """Head and rows of the table that a person wants to see."""
    head = [
        "controller", "friction use", "over the oracle's", "95 %", "lowest load [N]", "losses an hour", "infeasible",
        "solve p99 [ms]",
    ]  # fmt: skip
    rows = [
        [
            entry["name"], f"{entry['friction_use_median']:.3f}", f"{entry['friction_use_regret_median']:+.1%}",
            f"{entry['friction_use_regret_p95']:+.1%}", f"{entry['lowest_normal_force_n']:.0f}",
            f"{entry['losses_per_hour']:.0f}", f"{entry['infeasible']} of {entry['plans_checked']}",
            f"{1e3 * entry['solve_p99_s']:.2f}",
        ]
        for entry in result["controllers"]
    ]  # fmt: skip
    return head, rows


def write(result: dict[str, Any], folder: Path) -> Path:
    """Write DIR/distribution.json; returns its path. Raises InputError where it cannot be written."""
    _make(folder)
    path = folder / "distribution.json"
    try:
        path.write_text(json.dumps(result, indent=1))
    except OSError as error:
        raise InputError("cannot be written", file=path, field="--out", allowed="a folder you may write to") from error
    return path
