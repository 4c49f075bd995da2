"""The held-out cases of the force-distribution benchmark, and what is measured of one.

A case: slope, friction, payload, ropes, drill and (in a third) one undeclared effect, drawn from
the set `distribution`
of randomisation.yaml, and a footing: each foot's height error, which the machine cannot know.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from testbed.machine.names import LEGS
from testbed.scenario.scenario import Scenario, load_scenario

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
