"""The cases of the force-distribution benchmark summed up by controller, and as a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.benchmarks.distribution.run import Case, Outcome
from testbed.formats.arrays import Array, Flags
from testbed.report.page import Table
from testbed.report.style import BLUE, GREY, RC, VERMILION, WIDTH_IN

# Controllers against the quadratic program, case by case: how much less friction they use, with
# intervals.

BASE = "qp"
RESAMPLES, SPAN = 4000, (0.025, 0.975)


def against_base(cases: Sequence[Case], outcomes: Sequence[Sequence[Outcome]]) -> dict[str, Any]:
    """Per controller and kind of case: median saving 1 - use / use of the base, its 95 % interval,
    medians by seed.

    The interval is that of the median over resampled cases. Empty without the base.
    """
    names = [outcome.controller for outcome in outcomes[0]]
    if BASE not in names:
        return {}
    use = np.array([[outcome.friction_use for outcome in row] for row in outcomes])
    saving = 1.0 - use / use[:, [names.index(BASE)]]
    affected = np.array([case.affected for case in cases])
    seeds = np.array([case.block for case in cases])
    kinds = {"undeclared": affected, "none": ~affected}
    return {
        name: {
            kind: _saving(saving[chosen, index], seeds[chosen])
            for kind, chosen in kinds.items()
            if chosen.any()
        }
        for index, name in enumerate(names)
        if name != BASE
    }


def _saving(saving: Array, seeds: NDArray[np.int_]) -> dict[str, Any]:
    rng = np.random.default_rng(0)
    medians = np.median(saving[rng.integers(len(saving), size=(RESAMPLES, len(saving)))], axis=1)
    return {
        "cases": len(saving),
        "saving_median": float(np.median(saving)),
        "interval95": [float(end) for end in np.quantile(medians, SPAN)],
        "by_seed": {
            int(seed): float(np.median(saving[seeds == seed])) for seed in np.unique(seeds)
        },
    }


def against_table(compared: dict[str, Any]) -> Table:
    """The table that a person wants to see."""
    head = [
        "controller",
        "undeclared effect",
        "cases",
        f"friction saved against {BASE}",
        "95 % interval",
        "by seed",
    ]
    body = [
        [
            name,
            "one" if kind == "undeclared" else "none",
            str(found["cases"]),
            f"{found['saving_median']:+.1%}",
            "{:+.1%} to {:+.1%}".format(*found["interval95"]),
            " ".join(f"{value:+.1%}" for value in found["by_seed"].values()),
        ]
        for name, kinds in compared.items()
        for kind, found in kinds.items()
    ]
    return Table(f"Against {BASE}", head, body)


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


# The force-distribution benchmark in one picture: friction used over the oracle's, and the lowest
# normal load.

SHOWN = (-0.5, 2.0)
"""Regret beyond this lies at the edge."""


def write_figure(result: dict[str, Any], folder: Path) -> Path:
    """Write DIR/distribution.png of the object of distribution.json; returns its path."""
    import matplotlib.pyplot as plt

    runs = result["runs"]
    names = [outcome["controller"] for outcome in runs[0]]
    use = np.array([[outcome["friction_use"] for outcome in row] for row in runs])
    lowest = np.array([[outcome["lowest_normal_n"] for outcome in row] for row in runs])
    regret = np.clip(use / np.maximum(use[:, -1:], 1e-6) - 1.0, *SHOWN)
    with plt.rc_context(RC):  # type: ignore[arg-type]
        figure, (left, right) = plt.subplots(
            1, 2, figsize=(2 * WIDTH_IN, 0.9 + 0.42 * len(names)), sharey=True, layout="constrained"
        )
        for index in range(len(names)):
            _row(left, index, 100.0 * regret[:, index])
            _row(right, index, lowest[:, index] / 1e3)
        left.set_yticks(
            range(len(names)),
            [Path(name.rpartition(":")[0] or name).stem.replace("_", " ") for name in names],
        )
        left.invert_yaxis()
        left.set_xlabel(f"friction use over the oracle's [%], cut off at {100 * SHOWN[1]:.0f}")
        right.set_xlabel("lowest normal load of any foot [kN]")
        figure.suptitle(
            f"{len(runs)} cases: each a dot; median and 5 to 95 %", x=0.01, ha="left", fontsize=9
        )
        path = folder / "distribution.png"
        figure.savefig(path, dpi=110)
        plt.close(figure)
    return path


def _row(axes: Any, row: int, values: Any) -> None:
    spread = row + 0.28 * (np.random.default_rng(row).random(len(values)) - 0.5)
    axes.plot(values, spread, ".", ms=4.5, color=GREY, alpha=0.55, mew=0)
    low, middle, high = np.quantile(values, [0.05, 0.5, 0.95])
    axes.plot([low, high], [row, row], "-", color=BLUE, lw=1.4)
    axes.plot([middle], [row], "o", ms=5, color=VERMILION)
