"""The estimators' benchmark as tables and as a page."""

from __future__ import annotations

from typing import Any

from testbed.benchmarks.estimators.scores import (
    BIN_N,
    BINS,
    FLOOR,
    FULL_SCALE_N,
    NAMES,
    WHOLE,
)
from testbed.report.page import Table, render

TITLES = {
    "all temperatures": "All runs, 10 to 50 °C",
    "stand": "Standing, with small steps",
    "walk": "Walking",
    "move": "Swaying and raising the body",
    "drill": "Drilling",
    "still": "Standing after a raise, without dither",
    "liar": "Swaying, and one pressure sensor reads 15 % low",
    "dither": "The same, valves dithering by 0.3 mm twice a second",
    "at the calibration's temperature": "At the temperature of the sensors' calibration, 40 °C",
}

TARGETS: tuple[tuple[str, str, str, str, float], ...] = (
    (
        "load while moving, one temperature: RMSE",
        "at the calibration's temperature",
        "moving",
        "rmse_n",
        0.01,
    ),
    ("load while moving, 10 to 50 °C: RMSE", "all temperatures", "moving", "rmse_n", 0.02),
    ("the same: 99th percentile", "all temperatures", "moving", "p99_n", 0.03),
    ("the same: bias", "all temperatures", "moving", "bias_n", 0.003),
    ("across the joint, all times: RMSE", "all temperatures", "tangential_all", "rmse_n", 0.03),
)
"""What is wanted: label, group, category, mark, share of 15 kN."""


def targets(answer: dict[str, Any]) -> list[dict[str, Any]]:
    """What was wanted of the own estimate, what is measured, and whether it holds."""
    out: list[dict[str, Any]] = []
    for label, group, category, mark, share in TARGETS:
        value = answer["groups"].get(group, {}).get(WHOLE, {}).get(category, {}).get(mark)
        if value is not None:
            limit = share * FULL_SCALE_N
            out.append(
                {
                    "wanted": label,
                    "limit_n": limit,
                    "measured_n": value,
                    "holds": abs(value) <= limit,
                }
            )
    own = answer["groups"].get("all temperatures", {}).get(WHOLE, {})
    slow, fast = (own.get(case, {}).get("rmse_n") for case in ("slow", "fast"))
    if slow is not None and fast is not None:
        out.append(
            {
                "wanted": "load from 3 to 5 mm/s against faster: RMSE",
                "limit_n": 1.5 * fast,
                "measured_n": slow,
                "holds": slow <= 1.5 * fast,
            }
        )
    return out


def table(answer: dict[str, Any], group: str) -> Table:
    """One group of runs: every estimator, N."""
    heads = [
        "load along the vertical joint, N",
        "moving, RMS",
        "bias",
        "99 % below",
        "at rest, RMS",
        "90 % interval holds",
        "its width",
        "across, RMS",
    ]
    rows = []
    for name, found in answer["groups"][group].items():
        moving, rest, across = found["moving"], found["rest"], found.get("tangential_all", {})
        rows.append(
            [
                NAMES.get(name, name),
                _n(moving.get("rmse_n")),
                _n(moving.get("bias_n")),
                _size(moving.get("p99_n")),
                _n(rest.get("rmse_n")),
                _share(rest.get("covered")),
                _n(rest.get("width_n")),
                _n(across.get("rmse_n")),
            ]
        )
    return Table(TITLES.get(group, group), heads, rows)


def _n(value: float | None) -> str:
    return "" if value is None else str(round(value))


def _size(value: float | None) -> str:
    """A quantile: beyond the histogram's last bin it is only known to be larger."""
    return _n(value) if value is None or value < BIN_N * BINS else f"over {value - BIN_N:.0f}"


def _share(value: float | None) -> str:
    return "" if value is None else f"{100.0 * value:.0f} %"


def page(answer: dict[str, Any]) -> str:
    """The page's text."""
    contents = {
        "runs": len(answer["runs"]),
        "targets": answer["targets"],
        "groups": [table(answer, group) for group in answer["groups"]],
        "own": NAMES.get(WHOLE, WHOLE),
        "floor": NAMES[FLOOR],
    }
    return render("benchmarks/estimators/page.html.j2", contents)
