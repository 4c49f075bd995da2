"""The comparison of estimators as numbers (`estimators.json`), as a table and as a page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from testbed.benchmarks.estimators.benchmark import (
    BIN_N,
    BINS,
    FLOOR,
    FULL_SCALE_N,
    NAMES,
    WHOLE,
    result,
)
from testbed.formats.files import write_json, write_text
from testbed.report.page import render

TARGETS: tuple[tuple[str, str, str, str, float], ...] = (
    (
        "load while moving, one temperature: RMSE",
        "at the calibration's temperature",
        "moving",
        "rmse_n",
        0.01,
    ),
    ("load while moving, 10 to 50 degC: RMSE", "all temperatures", "moving", "rmse_n", 0.02),
    ("the same: 99th percentile", "all temperatures", "moving", "p99_n", 0.03),
    ("the same: bias", "all temperatures", "moving", "bias_n", 0.003),
    ("across the joint, all times: RMSE", "all temperatures", "tangential_all", "rmse_n", 0.03),
)
"""What is wanted: label, group, category, mark, share of 15 kN."""


def write_estimators(found: list[dict[str, Any]], out: Path) -> tuple[dict[str, Any], Path]:
    """Write estimators.json and estimators.html. Raises InputError where `out` cannot be written."""
    answer = result(found)
    answer["targets"] = targets(answer)
    page = out / "estimators.html"
    write_json(out / "estimators.json", answer)
    write_text(page, _page(answer))
    return answer, page


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
    slow, fast = (own.get(c, {}).get("rmse_n") for c in ("slow", "fast"))
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


def table(
    answer: dict[str, Any], group: str = "all temperatures"
) -> tuple[list[str], list[list[str]]]:
    """Heads and rows of one group of runs: every estimator, N."""
    heads = [
        "load along the vertical joint, N",
        "moving",
        "bias",
        "p99",
        "at rest",
        "90 % holds",
        "width",
        "across",
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
    return heads, rows


def _n(value: float | None) -> str:
    return "" if value is None else f"{value:.0f}"


def _size(value: float | None) -> str:
    """A quantile: beyond the histogram's last bin it is only known to be larger."""
    return _n(value) if value is None or value < BIN_N * BINS else f"over {value - BIN_N:.0f}"


def _share(value: float | None) -> str:
    return "" if value is None else f"{100.0 * value:.0f} %"


def _page(answer: dict[str, Any]) -> str:
    wanted = [
        [
            t["wanted"],
            f"{t['limit_n']:.0f}",
            f"{t['measured_n']:.0f}",
            "yes" if t["holds"] else "no",
        ]
        for t in answer["targets"]
    ]
    contents = {
        "runs": len(answer["runs"]),
        "wanted": (["", "at most, N", "measured, N", "holds"], wanted),
        "groups": [(_title(group), table(answer, group)) for group in answer["groups"]],
        "own": WHOLE,
        "floor": NAMES[FLOOR],
    }
    return render("benchmarks/estimators/page.html.j2", contents)


def _title(group: str) -> str:
    titles = {
        "all temperatures": "All runs, 10 to 50 degC",
        "stand": "Standing, with small steps",
        "walk": "Walking",
        "move": "Swaying and raising the body",
        "drill": "Drilling",
        "still": "Standing after a raise, without dither",
        "liar": "Swaying, and one pressure sensor reads 15 % low",
        "dither": "The same, valves dithering by 0.3 mm twice a second",
        "at the calibration's temperature": "At the temperature of the sensors' calibration, 40 degC",
    }
    return titles.get(group, group)
