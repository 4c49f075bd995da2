"""Long climbs: ten metres up each slope, on planes and on rough rock, with ropes aside and rods on
board, several seeds each.

A run ends when the body has gone its way, the machine is lost, or its time is over. A machine whose
ropes draw the load too far aside for the stride is given a shorter one, as its crew would; where
none of STRIDE_SHARES is accepted, the climb is refused. A seed draws the machine, the sensors'
errors, the true friction and, on rock, the surface; control believes the machine on the drawing
board, one friction, and knows nothing of the rock but its roughness. On request each seed has an
effect as well that nobody declared. A gait of one's own climbs the same slopes beside the shipped
one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from testbed.benchmarks.harness import Answers, Benchmark, code, digest
from testbed.control.gait import Gait
from testbed.control.gaits.table import OwnParts
from testbed.errors import InputError, SimulationFault
from testbed.formats.sockets import load_class, split_user_class
from testbed.report.page import Table
from testbed.scenario.scenario import Scenario, load_scenario
from testbed.scenario.tasks import Crawl

if TYPE_CHECKING:
    from testbed.world.simulation import Simulation


SCENARIO = "crawl_slope_45"
LONG = "task.gait=flowing", "task.steps=120", "duration_s=1500", "rates.record_hz=10"
ACROSS = (
    "robot.rotation_deg=[12,-12,-12,12]",
    "robot.radial_m=0.19",
    "task.step_length_m=0.48",
)
"""Legs further across the way than in the scenario: a step is more turn and less reach, takes less
time, and can be longer.
"""
ASIDE = ("ropes.azimuth_deg=30", "ropes.anchor_spread_m=40", "ropes.pull=straight")
"""Anchors whose middle lies 30 degrees to the left, far enough apart that straight up lies between
them.
"""
RODS = ("robot.payload_kg=1333", "ropes.attachment_height_m=0.45")
"""Rods of a third of the robot's weight on board, and ropes as much higher as that moves the centre
of mass.
"""
WAY_M = 10.0
SLIP_LIMIT_M, TILT_LIMIT_DEG = 0.05, 3.0
STRIDE_SHARES = 1.0, 0.95, 0.9, 0.85, 0.8
"""Of the case's stride; the first that the gait accepts before anything moves is taken."""
FRICTION = 0.6, 0.8
"""True friction is drawn evenly between these (dry rock, D)."""
UNDECLARED = "keep_undeclared"
"""The set of randomisations that says which effects, how large and where (envs/randomisation)."""
ROUGH = "rough"
SHIPPED = "crawl"
"""The gait of the scenario; every other name is a `FILE.py:Class`."""


@dataclass(frozen=True)
class Climb:
    """One run. `overrides` are what `--set` takes."""

    case: str
    seed: int
    overrides: tuple[str, ...]
    gait: str = SHIPPED

    def scenario(self, stride_share: float = 1.0) -> Scenario:
        """The climb as a scenario, with this share of the case's stride."""
        scenario = load_scenario(SCENARIO, list(self.overrides), seed=self.seed)
        if stride_share == 1.0 or not isinstance(scenario.task, Crawl):
            return scenario
        stride_m = stride_share * scenario.task.step_length_m
        shorter = [*self.overrides, f"task.step_length_m={stride_m:.4f}"]
        return load_scenario(SCENARIO, shorter, seed=self.seed)


REFUSED = "refused"
"""How the verdict of a climb begins that control would not begin."""


@dataclass(frozen=True)
class Outcome:
    """What came of it. Slip: furthest way of a standing foot within one stance; tilt: largest turn
    of the body from where it started.

    None: a gait of one's own does not say.
    """

    case: str
    seed: int
    verdict: str
    way_m: float
    time_s: float
    steps: int | None
    slip_m: float
    tilt_deg: float
    least_planned_margin_n: float | None
    highest_tension_n: float
    friction: float
    goal_m: float = WAY_M
    gait: str = SHIPPED
    stride_share: float = 1.0
    undeclared: str | None = None
    """Effect and place of what nobody declared; None: nothing."""

    @property
    def good(self) -> bool:
        """Got there, stood, slipped and tilted less than the limits."""
        there = self.verdict == "stood" and self.way_m >= self.goal_m
        return there and self.slip_m < SLIP_LIMIT_M and self.tilt_deg < TILT_LIMIT_DEG


CASES: dict[str, tuple[str, ...]] = {
    **{f"plane {deg}": (f"terrain.slope_deg={deg}", *ACROSS) for deg in (30, 45, 60, 75)},
    "plane 85": (
        "terrain.slope_deg=85",
        "ropes.share=1.0",
        "ropes.attachment_height_m=0.28",
        *ACROSS,
    ),
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
    "aside 60": ("terrain.slope_deg=60", *ACROSS, *ASIDE),
    "rods 60": ("terrain.slope_deg=60", *ACROSS, *RODS),
    "aside, rods 45": ("terrain.slope_deg=45", *ACROSS, *ASIDE, *RODS),
}


def climbs(
    cases: Sequence[str],
    seeds: int,
    first: int = 1,
    gaits: Sequence[str] = (SHIPPED,),
    draw: str | None = None,
    further: Sequence[str] = (),
    undeclared: bool = False,
) -> list[Climb]:
    """Every case with seeds first .. seeds, seed by seed, so that a part of them is a fair sample;
    under every gait.

    `draw`: tolerances from which each seed's machine is drawn; None: the world has the one on the
    drawing board; `further`: changes of all climbs; `undeclared`: each seed has an effect that the
    model lacks, the same in all of its cases.
    """
    from testbed.envs.randomisation import draw_overrides, sets

    hidden = {"undeclared": sets()[UNDECLARED]["undeclared"]} if undeclared else {}
    out = []
    for seed in range(first, seeds + 1):
        lacking = draw_overrides(hidden, np.random.default_rng([seed, 78]))
        for case in cases:
            friction = float(np.random.default_rng([seed, 77]).uniform(*FRICTION))
            drawn = [f"terrain.friction={friction:.4f}"]
            if draw is not None:
                drawn += [f"machine.draw={draw}", f"machine.seed={seed}"]
            if case.startswith(ROUGH):
                drawn.append(f"terrain.roughness_seed={seed}")
            overrides = (*LONG, *CASES[case], *drawn, *lacking, *further)
            out += [Climb(case, seed, overrides, gait) for gait in gaits]
    return out


@dataclass(frozen=True)
class Climbs(Benchmark[Climb]):
    """Seeds `first_seed` to `seeds` of each of `chosen`, as far as `way_m`, by the shipped gait and
    by `own` ones.

    Raises InputError for cases, seeds, gaits and changes that there are not.
    """

    name = "climbs"
    noun = "climbs"
    seeds: int = 14
    first_seed: int = 1
    way_m: float = WAY_M
    chosen: tuple[str, ...] = tuple(CASES)
    own: tuple[str, ...] = ()
    """Gaits of one's own, `FILE.py:Class`."""
    draw: str | None = "workshop"
    overrides: tuple[str, ...] = ()
    """Changes `a.b=c` of every climb."""
    undeclared: bool = False
    """Whether each seed has an effect that nobody declared."""

    def __post_init__(self) -> None:
        for name in self.chosen:
            if name not in CASES:
                allowed = ", ".join(CASES)
                raise InputError("no such case", field="--case", value=name, allowed=allowed)
        if not 1 <= self.first_seed <= self.seeds:
            raise InputError(
                "no such seed", field="--first-seed", value=self.first_seed, allowed="1 to --seeds"
            )
        for name in self.own:
            load_class(name, Gait, field="--gait")
        load_scenario(SCENARIO, [*LONG, *self.overrides])

    def cases(self) -> Mapping[str, Climb]:
        """Every climb by slope and seed."""
        gaits = (SHIPPED, *self.own)
        chosen, first, changes = self.chosen, self.first_seed, self.overrides
        made = climbs(chosen, self.seeds, first, gaits, self.draw, changes, self.undeclared)
        return {
            f"{climb.case}, seed {climb.seed}, {self.way_m:g} m, {climb.gait}": climb
            for climb in made
        }

    def work(self, case: Climb) -> Outcome:
        """See climb_up."""
        return climb_up(case, self.way_m)

    def made_from(self, case: Climb) -> str:
        """The climb, its length, and the file of one's own gait."""
        if case.gait == SHIPPED:
            return f"{case!r} {self.way_m!r}"
        file, _ = split_user_class(case.gait, field="--gait")
        return f"{case!r} {self.way_m!r} {digest(code(file))}"

    def without(self) -> tuple[str, ...]:
        """The other benchmarks of this folder."""
        return ("benchmarks/climbs/expected_loads.py", "benchmarks/climbs/stands.py")

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
    from testbed.world.summary import world_summary

    begun = _begin(climb)
    if isinstance(begun, InputError):
        return _refused(climb, begun, way_m)
    world, stride_share = begun
    scenario = world.scenario
    gait: Any = world.machine.gait if climb.gait == SHIPPED else None
    columns = {name: index for index, name in enumerate(world.truth_columns)}
    ropes = [
        [columns[f"rope_force_in_world_{side}_{axis}"] for axis in "xyz"]
        for side in ("left", "right")
    ]
    tension, verdict = 0.0, ""
    try:
        while not (world.finished or (gait and gait.done) or _travelled(world) >= way_m):
            _, truth = world.run_block(scenario.rates.record_hz)
            pulls = [np.linalg.norm(truth[:, rope], axis=1).max(initial=0.0) for rope in ropes]
            tension = max(tension, *map(float, pulls))
    except (SimulationFault, InputError) as fault:
        verdict = f"fault: {fault}"
    summary = world_summary(world)
    outcome = Outcome(
        climb.case,
        climb.seed,
        verdict or world.verdict,
        _travelled(world),
        world._step * world.dt,
        gait.steps_done if gait else None,
        summary["foot_slip_m"],
        summary["turn_max_deg"],
        min(gait.margins_n, default=0.0) if gait else None,
        tension,
        scenario.terrain.friction,
        way_m,
        climb.gait,
        stride_share,
        _undeclared(scenario),
    )
    world.close()
    return outcome


def _undeclared(scenario: Scenario) -> str | None:
    return ", ".join(f"{one.effect}@{one.at}" for one in scenario.undeclared) or None


def _begin(climb: Climb) -> tuple[Any, float] | InputError:
    """The world of a climb and the share of its stride that it was begun with, or why it was not
    begun.
    """
    from testbed.world.simulation import Simulation

    own = OwnParts(None if climb.gait == SHIPPED else climb.gait)
    refused: InputError | None = None
    for share in STRIDE_SHARES:
        try:
            return Simulation(climb.scenario(share), own=own), share
        except InputError as reason:
            refused = refused or reason
    assert refused is not None
    return refused


def _refused(climb: Climb, reason: InputError, way_m: float) -> Outcome:
    """A climb that control would not begin on this machine: no fall, and not good."""
    verdict = f"{REFUSED}: {reason}"
    friction = climb.scenario().terrain.friction
    nothing = (0.0, 0.0, 0, 0.0, 0.0, None, 0.0)
    return Outcome(climb.case, climb.seed, verdict, *nothing, friction, way_m, climb.gait)


def _travelled(world: Simulation) -> float:
    """Way of the body up the slope, m."""
    machine = world.machine
    up = machine.ground.rotation_slope_to_world[:, 0]
    return float((machine.origin_in_world() - machine.start_base) @ up)


def table(outcomes: Sequence[Outcome]) -> Table:
    """One row a case and gait: how many got there within the limits, and the worst of each
    number.
    """
    heads = ["case", "gait", "good", "falls", "way [m]", "slip a step [mm]", "tilt [deg]"]
    heads += ["planned margin [N]", "speed, median [mm/s]", "steps"]
    rows = []
    for case, gait in dict.fromkeys((outcome.case, outcome.gait) for outcome in outcomes):
        of = [outcome for outcome in outcomes if (outcome.case, outcome.gait) == (case, gait)]
        margins = [
            outcome.least_planned_margin_n
            for outcome in of
            if outcome.least_planned_margin_n is not None
        ]
        steps = [outcome.steps for outcome in of if outcome.steps is not None]
        begun = [outcome for outcome in of if not outcome.verdict.startswith(REFUSED)]
        speeds = [1000 * outcome.way_m / outcome.time_s for outcome in begun]
        speed = np.median(speeds) if speeds else 0.0
        rows.append(
            [
                case,
                gait,
                f"{sum(outcome.good for outcome in of)} of {len(of)}",
                str(sum(outcome.verdict != "stood" for outcome in begun)),
                f"{min(outcome.way_m for outcome in of):.2f}",
                f"{1000 * max(outcome.slip_m for outcome in of):.1f}",
                f"{max(outcome.tilt_deg for outcome in of):.2f}",
                f"{min(margins):.0f}" if margins else "-",
                f"{speed:.1f}",
                str(max(steps, default="-")),
            ]
        )
    return Table("Long climbs, the worst of all seeds", heads, rows)
