"""Long climbs: ten metres up each slope, on planes and on rough rock, several seeds each.

A run ends when the body has gone its way, the machine is lost, or its time is over. A seed draws the sensors' errors,
the true friction and, on rock, the surface; control believes one friction and knows nothing of the rock but its
roughness.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from testbed.benchmarks.harness import Answers, Benchmark
from testbed.errors import InputError, SimulationFault
from testbed.report.tables import Table
from testbed.scenario.scenario import Scenario, load_scenario

SCENARIO = "crawl_slope_45"
LONG = "task.steps=120", "duration_s=1500", "rates.record_hz=10"
ACROSS = ("robot.rotation_deg=[12,-12,-12,12]",)
"""Legs further across the way than in the scenario: a step is more turn and less reach, and takes less time."""
WAY_M = 10.0
SLIP_LIMIT_M, TILT_LIMIT_DEG = 0.05, 3.0
FRICTION = 0.6, 0.8
"""True friction is drawn evenly between these (dry rock, D)."""
ROUGH = "rough"


@dataclass(frozen=True)
class Climb:
    """One run. `overrides` are what `--set` takes."""

    case: str
    seed: int
    overrides: tuple[str, ...]

    def scenario(self) -> Scenario:
        """The climb as a scenario."""
        return load_scenario(SCENARIO, list(self.overrides), seed=self.seed)


@dataclass(frozen=True)
class Outcome:
    """What came of it. Slip: furthest way of a standing foot within one stance; tilt: against the slope's normal."""

    case: str
    seed: int
    verdict: str
    way_m: float
    time_s: float
    steps: int
    slip_m: float
    tilt_deg: float
    least_planned_margin_n: float
    highest_tension_n: float
    friction: float
    goal_m: float = WAY_M

    @property
    def good(self) -> bool:
        """Got there, stood, slipped and tilted less than the limits."""
        there = self.verdict == "stood" and self.way_m >= self.goal_m
        return there and self.slip_m < SLIP_LIMIT_M and self.tilt_deg < TILT_LIMIT_DEG


CASES: dict[str, tuple[str, ...]] = {
    **{f"plane {deg}": (f"terrain.slope_deg={deg}", *ACROSS) for deg in (30, 45, 60, 75)},
    "plane 85": ("terrain.slope_deg=85", "ropes.share=1.0", "ropes.attachment_height_m=0.28"),
    **{
        f"{ROUGH} {deg}": (
            f"terrain.slope_deg={deg}",
            "terrain.kind=heightfield",
            "terrain.roughness_m=0.035",
            "task.ground_steps_m=0.1",
            *ACROSS,
        )
        for deg in (45, 60)
    },
}


def climbs(cases: Sequence[str], seeds: int, first: int = 1) -> list[Climb]:
    """Every case with seeds first .. seeds, seed by seed, so that a part of them is a fair sample."""
    out = []
    for seed in range(first, seeds + 1):
        for case in cases:
            friction = float(np.random.default_rng([seed, 77]).uniform(*FRICTION))
            drawn = [f"terrain.friction={friction:.4f}"]
            if case.startswith(ROUGH):
                drawn.append(f"terrain.roughness_seed={seed}")
            out.append(Climb(case, seed, (*LONG, *CASES[case], *drawn)))
    return out


@dataclass(frozen=True)
class Climbs(Benchmark[Climb]):
    """Seeds `first_seed` to `seeds` of each of `chosen`, as far as `way_m`. Raises InputError for none of these."""

    name = "climbs"
    noun = "climbs"
    seeds: int = 20
    first_seed: int = 1
    way_m: float = WAY_M
    chosen: tuple[str, ...] = tuple(CASES)

    def __post_init__(self) -> None:
        for name in self.chosen:
            if name not in CASES:
                allowed = ", ".join(CASES)
                raise InputError("no such case", field="--case", value=name, allowed=allowed)
        if not 1 <= self.first_seed <= self.seeds:
            raise InputError(
                "no such seed", field="--first-seed", value=self.first_seed, allowed="1 to --seeds"
            )

    def cases(self) -> Mapping[str, Climb]:
        """Every climb by slope and seed."""
        made = climbs(self.chosen, self.seeds, self.first_seed)
        return {f"{climb.case}, seed {climb.seed}, {self.way_m:g} m": climb for climb in made}

    def work(self, case: Climb) -> Outcome:
        """See climb_up."""
        return climb_up(case, self.way_m)

    def made_from(self, case: Climb) -> str:
        """The climb and its length."""
        return f"{case!r} {self.way_m!r}"

    def without(self) -> tuple[str, ...]:
        """The other benchmarks of this folder."""
        return ("benchmarks/climbs/expected_loads.py", "benchmarks/climbs/quiet_stand.py")

    def summarise(self, answers: Answers) -> list[Outcome]:
        """Every climb's outcome."""
        return [Outcome(**answer) for answer in answers.values()]

    def published(self, result: Sequence[Outcome]) -> list[dict[str, Any]]:
        """Every climb's outcome, and whether it was good."""
        return [asdict(outcome) | {"good": outcome.good} for outcome in result]

    def tables(self, result: Sequence[Outcome]) -> Sequence[Table]:
        """One table."""
        return [table(result)]


def climb_up(climb: Climb, way_m: float = WAY_M) -> Outcome:
    """Simulate one climb."""
    from testbed.world.simulation import Simulation

    scenario = climb.scenario()
    world = Simulation(scenario)
    gait: Any = world.machine.gait
    normal = world.machine.ground.normal_in_world
    columns = {name: k for k, name in enumerate(world.truth_columns)}
    ropes = [
        [columns[f"rope_force_in_world_{side}_{k}"] for k in "xyz"] for side in ("left", "right")
    ]
    tilt, tension, verdict = 0.0, 0.0, ""
    try:
        while not (world.finished or gait.done or _travelled(world) >= way_m):
            _, truth = world.run_block(scenario.rates.record_hz)
            upright = float(world.machine.board.rotation[:, 2] @ normal)
            tilt = max(tilt, math.degrees(math.acos(min(upright, 1.0))))
            pulls = [np.linalg.norm(truth[:, rope], axis=1).max(initial=0.0) for rope in ropes]
            tension = max(tension, *map(float, pulls))
    except (SimulationFault, InputError) as fault:
        verdict = f"fault: {fault}"
    summary = world.summary()
    outcome = Outcome(
        climb.case,
        climb.seed,
        verdict or world.verdict,
        _travelled(world),
        world._step * world.dt,
        gait.steps_done,
        summary["foot_slip_m"],
        max(tilt, summary["turn_max_deg"]),
        min(gait.margins_n, default=0.0),
        tension,
        scenario.terrain.friction,
        way_m,
    )
    world.close()
    return outcome


def _travelled(world: Any) -> float:
    """Way of the body up the slope, m."""
    machine = world.machine
    up = machine.ground.rotation_slope_to_world[:, 0]
    return float((machine.origin_in_world() - machine.start_base) @ up)


def table(outcomes: Sequence[Outcome]) -> Table:
    """One row a case: how many got there within the limits, and the worst of each number."""
    heads = ["case", "good", "falls", "way [m]", "slip a step [mm]", "tilt [deg]"]
    heads += ["planned margin [N]", "speed, median [mm/s]", "steps"]
    rows = []
    for case in dict.fromkeys(o.case for o in outcomes):
        of = [o for o in outcomes if o.case == case]
        speed = np.median([1000 * o.way_m / o.time_s for o in of])
        rows.append(
            [
                case,
                f"{sum(o.good for o in of)} of {len(of)}",
                str(sum(o.verdict != "stood" for o in of)),
                f"{min(o.way_m for o in of):.2f}",
                f"{1000 * max(o.slip_m for o in of):.1f}",
                f"{max(o.tilt_deg for o in of):.2f}",
                f"{min(o.least_planned_margin_n for o in of):.0f}",
                f"{speed:.1f}",
                str(max(o.steps for o in of)),
            ]
        )
    return Table("Long climbs, the worst of all seeds", heads, rows)
