"""How much of their friction the feet of a quiet stand use, on machines that nobody declared.

Valve edges that leak let the four legs push each other along the slope: a stand may use far more
friction than its weight asks for, and none is left for the drill.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from testbed.benchmarks.harness import Answers, Benchmark
from testbed.formats.arrays import Array
from testbed.machine.names import LEGS
from testbed.report.page import Table
from testbed.scenario.scenario import load_scenario

AIM = 0.3
"""Share of its friction that no foot of a quiet stand on 45 degrees should pass."""
BLOCK_ROWS = 1000


@dataclass(frozen=True)
class StandFriction(Benchmark[int]):
    """Stands of `stand_slope_45` for `duration_s`, machines drawn from the workshop's tolerances
    with the seeds 1 to `machines`.
    """

    name = "stand_friction"
    noun = "stands"
    machines: int = 20
    duration_s: float = 30.0
    changes: tuple[str, ...] = ()
    """Further settings of the scenario, such as `machine.set=original`."""

    def cases(self) -> Mapping[str, int]:
        """The machines by their seed."""
        return {f"machine {seed}": seed for seed in range(1, self.machines + 1)}

    def work(self, case: int) -> dict[str, Any]:
        """Shares of the friction in use, at the stand's worst instant and at its end: of the foot
        that uses most, and of all four together.
        """
        drawn = ["machine.draw=workshop", f"machine.seed={case}"]
        worst, together = _use([*drawn, *self.changes], self.duration_s)
        return {
            "worst_foot_peak": float(worst.max()),
            "worst_foot_end": float(worst[-1]),
            "together_peak": float(together.max()),
            "together_end": float(together[-1]),
        }

    def made_from(self, case: int) -> str:
        """The machine's seed, the length and what is changed."""
        return f"{case} {self.duration_s!r} {self.changes!r}"

    def summarise(self, answers: Answers) -> dict[str, Any]:
        """Lowest, median and highest of each share over the machines, and how many keep below
        AIM.
        """
        found = list(answers.values())
        shares = {
            name: np.quantile([one[name] for one in found], [0.0, 0.5, 1.0]).tolist()
            for name in found[0]
        }
        below = sum(one["worst_foot_peak"] <= AIM for one in found)
        return {"machines": len(found), "aim": AIM, "below_aim": below, "shares": shares}

    def tables(self, result: dict[str, Any]) -> Sequence[Table]:
        """A share a row."""
        rows = [
            [name.replace("_", " "), *(f"{value:.3f}" for value in values)]
            for name, values in result["shares"].items()
        ]
        title = (
            f"Friction in use on {result['machines']} machines; "
            f"worst foot never above {result['aim']:g} on {result['below_aim']}"
        )
        return [Table(title, ["share", "lowest", "median", "highest"], rows)]


def _use(overrides: Sequence[str], duration_s: float) -> tuple[Array, Array]:
    """Tangential over the most tangential force, (rows): of the foot that uses most, and of the
    feet's sums.
    """
    from testbed.report.run_parts import foot_parts
    from testbed.world.simulation import Simulation

    world = Simulation(load_scenario("stand_slope_45", list(overrides), duration=duration_s))
    truth = []
    try:
        friction = world.machine.engine.friction_under_feet
        while not world.finished:
            truth.append(world.run_block(BLOCK_ROWS)[1])
        columns = dict(zip(world.truth_columns, np.concatenate(truth).T, strict=True))
    finally:
        world.close()
    normal, tangential = np.array([foot_parts(columns, leg) for leg in LEGS]).swapaxes(0, 1)
    most = friction[:, None] * normal
    return (tangential / most).max(axis=0), tangential.sum(axis=0) / most.sum(axis=0)
