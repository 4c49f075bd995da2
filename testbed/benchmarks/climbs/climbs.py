"""Long climbs: ten metres up each slope, on planes and on rough rock, several seeds each.

    python -m testbed.benchmarks.climbs.climbs --seeds 20 --out DIR --jobs 2

A run ends when the body has gone its way, the machine is lost, or its time is over. One JSON line a run goes to
DIR/climbs.jsonl, so that a second call carries on; DIR/climbs.md is the table of what is there at any time. A seed
draws the sensors' errors, the true friction and, on rock, the surface; control believes one friction and knows nothing
of the rock but its roughness.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from testbed.errors import InputError, SimulationFault
from testbed.formats.files import make_folder, write_text
from testbed.scenario.scenario import Scenario, load_scenario
from testbed.simulation.workers import work_through

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


def run(climb: Climb, way_m: float = WAY_M) -> Outcome:
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
        max(tilt, summary["tilt_deg"]),
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


def evaluate(
    out: Path,
    cases: Sequence[str],
    seeds: int,
    jobs: int,
    way_m: float = WAY_M,
    progress: Callable[[int], None] | None = None,
    first_seed: int = 1,
) -> list[Outcome]:
    """Run what is not in `out` yet; returns everything that is there of these cases, in order."""
    make_folder(out)
    lines = out / "climbs.jsonl"
    done = {(o.case, o.seed): o for o in read(lines) if o.goal_m == way_m}
    wanted = climbs(cases, seeds, first_seed)
    todo = [c for c in wanted if (c.case, c.seed) not in done]
    with lines.open("a") as file:
        if todo and file.tell() and not lines.read_text().endswith("\n"):
            file.write("\n")  # a line that was cut off stays alone
        for outcome in work_through(partial(run, way_m=way_m), todo, jobs, lambda _: False):
            done[outcome.case, outcome.seed] = outcome
            file.write(json.dumps(asdict(outcome)) + "\n")
            file.flush()
            write_text(
                out / "climbs.md",
                table([done[c.case, c.seed] for c in wanted if (c.case, c.seed) in done]),
            )
            if progress is not None:
                progress(len(wanted) - len(todo) + sum((c.case, c.seed) in done for c in todo))
    found = [done[c.case, c.seed] for c in wanted]
    write_text(out / "climbs.md", table(found))
    return found


def read(lines: Path) -> list[Outcome]:
    """Outcomes of a file of lines; a last line that was cut off is left out."""
    found = []
    for line in lines.read_text().splitlines() if lines.is_file() else []:
        try:
            found.append(Outcome(**json.loads(line)))
        except (json.JSONDecodeError, TypeError):
            continue
    return found


def table(outcomes: Sequence[Outcome]) -> str:
    """One row a case: how many got there within the limits, and the worst of each number."""
    rows = [
        "| case | good | falls | way [m] | slip a step [mm] | tilt [deg] | planned margin [N] | speed [mm/s] | steps |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for case in dict.fromkeys(o.case for o in outcomes):
        of = [o for o in outcomes if o.case == case]
        good, falls = sum(o.good for o in of), sum(o.verdict != "stood" for o in of)
        speed = np.median([1000 * o.way_m / o.time_s for o in of])
        rows.append(
            f"| {case} | {good} of {len(of)} | {falls} | {min(o.way_m for o in of):.2f} | "
            f"{1000 * max(o.slip_m for o in of):.1f} | {max(o.tilt_deg for o in of):.2f} | "
            f"{min(o.least_planned_margin_n for o in of):.0f} | {speed:.1f} | {max(o.steps for o in of)} |"
        )
    return "\n".join(rows) + "\n\nWorst of all seeds; speed: median.\n"


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; exit status 2 on bad input."""
    parser = argparse.ArgumentParser(
        prog="python -m testbed.benchmarks.climbs.climbs", description=__doc__.split("\n")[0]
    )
    parser.add_argument("--seeds", type=int, default=20, help="last seed of each case")
    parser.add_argument("--first-seed", type=int, default=1, help="first seed of each case")
    parser.add_argument(
        "--out", type=Path, required=True, help="folder of climbs.jsonl and climbs.md"
    )
    parser.add_argument("--jobs", type=int, default=1, help="processes at work")
    parser.add_argument("--way", type=float, default=WAY_M, help="how far up the slope, m")
    parser.add_argument("--cases", nargs="+", default=list(CASES), help=f"of {', '.join(CASES)}")
    given = parser.parse_args(arguments)
    try:
        for name in given.cases:
            if name not in CASES:
                raise InputError(
                    "no such case", field="--cases", value=name, allowed=", ".join(CASES)
                )
        total = (given.seeds - given.first_seed + 1) * len(given.cases)
        if not 1 <= given.first_seed <= given.seeds:
            raise InputError(
                "no such seed", field="--first-seed", value=given.first_seed, allowed="1 to --seeds"
            )
        outcomes = evaluate(
            given.out,
            given.cases,
            given.seeds,
            given.jobs,
            given.way,
            progress=lambda done: print(
                f"\r{done} of {total} climbs", end="", file=sys.stderr, flush=True
            ),
            first_seed=given.first_seed,
        )
    except InputError as error:
        parser.exit(2, f"{error}\n")
    print(table(outcomes), end="")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
