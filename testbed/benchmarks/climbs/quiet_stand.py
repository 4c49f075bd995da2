"""What a quiet stand's foot loads owe to the engine and what to the machine.

The robot stands on 45 degrees for a while: valves locked or position loops on, leakage in or out,
bodies stepped at 1 kHz or at 4 kHz. Loads that differ between the two rates are the engine's; loads
that move with the loops on are hunting; loads that drift with locked valves and stop drifting
without leakage are leakage.
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

LOCKED = ("hydraulics.valves_locked=true",)
NO_LEAKAGE = ("hydraulics.without=[internal_leakage, outer_leakage, edge_leakage, hose]",)
CASES: dict[str, tuple[str, ...]] = {
    "valves locked": LOCKED,
    "valves locked, no leakage": LOCKED + NO_LEAKAGE,
    "position loops on": (),
    "position loops on, no leakage": NO_LEAKAGE,
}


def foot_loads(overrides: tuple[str, ...], physics_hz: int, duration_s: float) -> Array:
    """Loads along the vertical joints, N, (rows at 100 Hz, 4), sensors without noise."""
    from testbed.world.simulation import Simulation

    substeps = max(1, round(10 * 1000 / physics_hz))
    common = [
        "sensors.noise=false",
        f"rates.physics_hz={physics_hz}",
        f"rates.hydraulic_substeps={substeps}",
    ]
    scenario = load_scenario(
        "stand_slope_45", [*common, "rates.record_hz=100", *overrides], duration=duration_s
    )
    world = Simulation(scenario)
    try:
        _, truth = world.run_block(round(duration_s * 100))
    finally:
        world.close()
    columns = [world.truth_columns.index(f"foot_load_{leg}") for leg in LEGS]
    return np.asarray(truth[:, columns])


@dataclass(frozen=True)
class QuietStand(Benchmark[str]):
    """Every case for `duration_s`."""

    name = "quiet_stand"
    noun = "stands"
    duration_s: float = 60.0
    chosen: tuple[str, ...] = tuple(CASES)

    def cases(self) -> Mapping[str, str]:
        """The cases by what is on and off in them."""
        return {f"{name}, {self.duration_s:g} s": name for name in self.chosen}

    def work(self, case: str) -> dict[str, Any]:
        """How far loads wander (standard deviation, worst foot), drift (last second less first)
        and, between 1 kHz and 4 kHz, differ at any time (worst foot, N).
        """
        slow, fast = (foot_loads(CASES[case], hz, self.duration_s) for hz in (1000, 4000))
        between_means = np.abs(slow.mean(axis=0) - fast.mean(axis=0))
        return {
            "wander_n": float(slow.std(axis=0).max()),
            "drift_n": float(np.abs(slow[-100:].mean(axis=0) - slow[:100].mean(axis=0)).max()),
            "rate_difference_n": float(np.abs(slow - fast).max()),
            "rate_difference_of_means_n": float(between_means.max()),
            "mean_n": slow.mean(axis=0).tolist(),
        }

    def made_from(self, case: str) -> str:
        """The case and its length."""
        return f"{case} {self.duration_s!r}"

    def summarise(self, answers: Answers) -> dict[str, dict[str, Any]]:
        """Marks by case."""
        return dict(zip(self.chosen, answers.values(), strict=True))

    def tables(self, result: dict[str, dict[str, Any]]) -> Sequence[Table]:
        """One table."""
        marks = ("wander_n", "drift_n", "rate_difference_n", "rate_difference_of_means_n")
        rows = [[case, *(f"{found[mark]:.1f}" for mark in marks)] for case, found in result.items()]
        heads = ["case", "wander [N]", "drift [N]", "1 kHz less 4 kHz [N]", "of the means [N]"]
        return [Table("Quiet stand, the worst foot", heads, rows)]
