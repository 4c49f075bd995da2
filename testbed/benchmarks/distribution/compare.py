"""Controllers against the quadratic program, case by case: how much less friction they use, with
intervals.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.benchmarks.distribution.cases import Case, Outcome
from testbed.formats.arrays import Array
from testbed.report.page import Table

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
