"""The force-distribution benchmark in one picture: friction used over the oracle's, and the lowest
normal load.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from testbed.report.style import BLUE, GREY, RC, VERMILION, WIDTH_IN

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
