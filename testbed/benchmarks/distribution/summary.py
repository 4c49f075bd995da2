"""The cases of the force-distribution benchmark summed up by controller, and as a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from testbed.benchmarks.distribution.cases import Case, Outcome
from testbed.benchmarks.distribution.compare import BASE, against_base
from testbed.formats.arrays import Array, Flags
from testbed.report.page import Table


def summarise(cases: Sequence[Case], outcomes: Sequence[Sequence[Outcome]]) -> dict[str, Any]:
    """The object of distribution.json; beside it what was drawn of each case, and every outcome
    under `runs`.
    """
    affected = np.array([case.affected for case in cases])
    best = np.array([row[-1].friction_use for row in outcomes])
    table = []
    for index, first in enumerate(outcomes[0]):
        rows = [row[index] for row in outcomes]
        table.append({"name": first.controller, **_scores(rows, best, affected)})
    return {
        "cases": len(cases),
        "friction_use": "95th percentile over time of the highest tangential / (true friction * normal); 1 slides",
        "friction_use_regret": "friction use over the oracle's, less 1; _absolute: less the oracle's",
        "controllers": table,
        f"against_{BASE}": against_base(cases, outcomes),
        "drawn": [_drawn(case) for case in cases],
        "runs": [[asdict(outcome) for outcome in row] for row in outcomes],
    }


def _scores(rows: Sequence[Outcome], best: Array, affected: Flags) -> dict[str, Any]:
    use = np.array([row.friction_use for row in rows])
    regret, absolute = use / np.maximum(best, 1e-6) - 1.0, use - best
    lowest, hours = np.array([row.lowest_normal_n for row in rows]), sum(row.hours for row in rows)
    split = {
        f"friction_use_regret_median_{word}": float(np.median(regret[chosen]))
        if chosen.any()
        else None
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
        "losses_per_hour": sum(row.losses for row in rows) / hours,
        "lost_cases": int(sum(row.losses > 0 for row in rows)),
        "infeasible": int(sum(row.infeasible for row in rows)),
        "plans_checked": int(sum(row.plans_checked for row in rows)),
        "solve_p99_s": float(np.quantile([row.solve_p99_s for row in rows], 0.5)),
        "solve_p99_worst_s": float(max(row.solve_p99_s for row in rows)),
        "body_motion_median_m": float(np.median([row.body_motion_m for row in rows])),
        "rope_range_median_n": float(np.median([row.rope_range_n for row in rows])),
        "valve_effort_mean": float(np.mean([row.valve_effort for row in rows])),
    }


def table(result: dict[str, Any]) -> Table:
    """The table that a person wants to see."""
    head = [
        "controller",
        "friction use",
        "over the oracle's",
        "95 %",
        "lowest load [N]",
        "losses an hour",
        "infeasible",
        "solve p99 [ms]",
    ]
    rows = [
        [
            entry["name"],
            f"{entry['friction_use_median']:.3f}",
            f"{entry['friction_use_regret_median']:+.1%}",
            f"{entry['friction_use_regret_p95']:+.1%}",
            f"{entry['lowest_normal_force_n']:.0f}",
            f"{entry['losses_per_hour']:.0f}",
            f"{entry['infeasible']} of {entry['plans_checked']}",
            f"{1e3 * entry['solve_p99_s']:.2f}",
        ]
        for entry in result["controllers"]
    ]
    return Table("Force distribution", head, rows)


def _drawn(case: Case) -> dict[str, Any]:
    """What a case's lines of the table begin with."""
    spec = case.scenario()
    return {
        "set": case.block,
        "case": case.number,
        "slope_deg": short(spec.terrain.slope_deg),
        "friction": short(spec.terrain.friction),
        "payload_kg": short(spec.robot.payload_kg),
        "undeclared": " ".join(f"{hidden.effect}@{hidden.at}" for hidden in spec.undeclared),
    }


def short(value: Any) -> Any:
    """A number as a table shows it; all else as it is."""
    return f"{value:.6g}" if isinstance(value, float) else value
