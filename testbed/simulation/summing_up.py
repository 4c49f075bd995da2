"""What a run comes to: `summary.json` from its recorded columns and from what only the world
knows.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from testbed.estimation.losses import LossRule, nominal_load_n
from testbed.formats.files import plain
from testbed.scenario.expectation import Expect
from testbed.simulation.expectations import unmet
from testbed.simulation.metrics import run_metrics
from testbed.simulation.runs import Columns, same_rows
from testbed.simulation.stability import stability_summary
from testbed.world.summary import world_summary

UNLOADED_S, UNLOADED_SHARE, UNLOADED_ANYHOW_S = 5.0, 0.5, 10.0
"""A machine has not stood where a foot that was meant to carry bore nothing for so long in a row
and for this share of its time, or for the longer time in a row anyhow (E)."""
SUMMARY_FORMAT = "roboclimber-summary/1"


@dataclass
class Ending:
    """How a run came to its end."""

    wall_s: float
    interrupted: bool = False
    """Stopped from outside."""
    fault: BaseException | None = None
    """What broke down, if anything did."""

    def verdict(self, of_world: str, figures: Mapping[str, Any]) -> str:
        """The verdict in words (docs/verdicts.md): the world's, but for feet that hung in the air,
        or what broke down.
        """
        if self.fault is not None:
            return f"fault: {self.fault or type(self.fault).__name__}"
        if of_world == "stood" and _hung(figures):
            return "lost footing"
        return of_world


def _hung(figures: Mapping[str, Any]) -> bool:
    """Whether a foot that was meant to carry bore nothing for too long."""
    longest_s = figures.get("longest_unloaded_s") or {}
    return any(
        seconds > UNLOADED_ANYHOW_S
        or (seconds > UNLOADED_S and figures["unloaded_share"][leg] > UNLOADED_SHARE)
        for leg, seconds in longest_s.items()
    )


def loss_rule(simulation: Any) -> LossRule:
    """What the scenario calls a loss of contact, on the machine that is believed."""
    told = simulation.scenario.estimator
    return LossRule(nominal_load_n(simulation.machines.belief), told.loss_share, told.loss_s)


def summed_up(simulation: Any, data: Columns, truth: Columns, ending: Ending) -> dict[str, Any]:
    """The summary of a Simulation as far as it came; `data` and `truth` are its recorded columns,
    (n,) each.
    """
    scenario = simulation.scenario
    data, truth = same_rows(data, truth)
    figures: dict[str, Any] = {}
    if len(truth["t"]) > 1:
        rule = loss_rule(simulation)
        figures = run_metrics(data, truth, scenario.terrain.slope_deg, rule)
        figures |= stability_summary(scenario, simulation.machines.truth, data, truth)
    summary: dict[str, Any] = {
        "format": SUMMARY_FORMAT,
        "scenario": scenario.name,
        "description": scenario.description,
        "seed": scenario.seed,
        "verdict": ending.verdict(str(simulation.verdict), figures),
        "interrupted": ending.interrupted,
        "planned_s": scenario.duration_s,
        "simulated_s": float(truth["t"][-1]) if len(truth["t"]) else 0.0,
        "wall_s": ending.wall_s,
        "slope_deg": scenario.terrain.slope_deg,
        "task": scenario.task.kind,
        "undeclared": [effect.model_dump() for effect in scenario.undeclared],
        "machine": scenario.machine.model_dump(),
    }
    for part in (figures, world_summary(simulation), {"events": list(simulation.events)}):
        twice = summary.keys() & part.keys()
        assert not twice, f"{sorted(twice)} of a summary are worked out in two places"
        summary |= part
    if scenario.expect != Expect() and not ending.interrupted and ending.fault is None:
        broken = unmet(scenario.expect, plain(summary))
        summary["expectations"] = {"met": not broken, "unmet": broken}
    return dict(plain(summary))
