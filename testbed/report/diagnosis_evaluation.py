"""The blind test of the diagnosis as numbers (`evaluation.json`) and as a page."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from testbed.errors import InputError
from testbed.evaluation.diagnosis_scores import scores
from testbed.report.style import BLUE, GREY, RC, svg

TARGETS = {
    "single_named": "single effects named right (target 0.85)",
    "single_among_first_two": "right one among the first two (0.95)",
    "double_both_named": "two effects, both named (0.60)",
    "clean_none": "clean rigs left alone (0.95)",
    "outside_unnamed": "outside the list: unnamed (0.80)",
    "outside_confidently_misnamed": "outside the list: confidently misnamed (at most 0.10)",
    "intervals": "90 % intervals that hold the truth (0.90)",
}


def write_evaluation(trials: Sequence[dict[str, Any]], out: Path) -> tuple[dict[str, Any], Path]:
    """Write evaluation.json and evaluation.html. Raises InputError where `out` cannot be written."""
    result = scores(trials)
    page = out / "evaluation.html"
    try:
        (out / "evaluation.json").write_text(json.dumps(result, indent=1) + "\n")
        page.write_text(_page(result))
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror}", file=out) from error
    return result, page


def table(result: dict[str, Any]) -> tuple[list[str], list[list[str]]]:
    """(header, rows) of the main marks."""
    rows = []
    for key, text in TARGETS.items():
        r = result[key]
        interval = f"{r['low95']:.2f} to {r['high95']:.2f}" if r["of"] else ""
        rows.append([text, f"{r['share']:.3f}", interval, str(r["of"])])
    share, calibration = result["closed_share"], result["calibration"]
    if share:
        rows.append(["closable squared force error closed, median (0.90)", f"{share['p50']:.3f}", "", ""])
        rows.append(["the same, 10th percentile (0.60)", f"{share['p10']:.3f}", "", ""])
    error = calibration["expected_calibration_error"]
    rows.append(["expected calibration error (at most 0.05)", f"{error:.3f}", "", str(result["rigs"])])
    brier = f"{calibration['brier']:.3f} against {calibration['brier_of_base_rates']:.3f}"
    rows.append(["Brier score, against base rates", brier, "", ""])
    rows.append(["clean rigs made worse by, largest (at most 0.01)", f"{result['clean_made_worse']:.3f}", "", ""])
    raw = result["baselines"]["raw_bic"]
    rows.append(["baseline, raw BIC stepwise: single named", f"{raw['single_named']['share']:.3f}", "", ""])
    rows.append(["baseline, raw BIC stepwise: clean left alone", f"{raw['clean_none']['share']:.3f}", "", ""])
    black = result["baselines"]["black_box"]["closed_share"]
    if black:
        rows.append(["baseline, black-box regression: closed share, median", f"{black['p50']:.3f}", "", ""])
    return ["", "measured", "95 % interval", "rigs"], rows


def _page(result: dict[str, Any]) -> str:
    from jinja2 import Environment, PackageLoader

    environment = Environment(loader=PackageLoader("testbed.report", "."), autoescape=True, trim_blocks=True)
    heads, rows = table(result)
    confusion = [(h, sorted(said.items(), key=lambda i: -i[1])) for h, said in sorted(result["confusion"].items())]
    return environment.get_template("diagnosis_evaluation.html.j2").render(
        rigs=result["rigs"], heads=heads, rows=rows, confusion=confusion, figure=_figure(result)
    )


def _figure(result: dict[str, Any]) -> str:
    """Calibration plot and accuracy against strength."""
    import matplotlib.pyplot as plt

    with plt.rc_context(RC):  # type: ignore[arg-type]
        figure, (left, right) = plt.subplots(1, 2, figsize=(8.5, 3.0))
        left.plot([0, 1], [0, 1], color=GREY, lw=0.8)
        for stated, hit, count in result["calibration"]["bins"]:
            left.plot(stated, hit, "o", color=BLUE, ms=3.0 + count**0.5, alpha=0.7)
        left.set_xlabel("stated probability of the first hypothesis")
        left.set_ylabel("rate of being right")
        classes = result["accuracy_by_strength"]
        middle = [(c["from"] * c["to"]) ** 0.5 for c in classes]
        right.plot(middle, [c["named"]["share"] for c in classes], "o-", color=BLUE, label="named right")
        right.plot(middle, [c["visible"]["share"] for c in classes], "o--", color=GREY, label="visible")
        right.set_xscale("log")
        right.set_ylim(-0.02, 1.05)
        right.set_xlabel("strength of a single effect (1: well visible)")
        right.legend()
        figure.tight_layout()
        text = svg(figure, "evaluation")
        plt.close(figure)
    return text
