"""The blind test of the diagnosis as a table and as a page."""

from __future__ import annotations

from typing import Any

from testbed.report.page import Table, render
from testbed.report.style import BLUE, GREY, RC, svg

TARGETS = {
    "single_named": ("single effects named right", "at least 0.85"),
    "single_among_first_two": ("the right one among the first two", "at least 0.95"),
    "double_both_named": ("two effects, both named", "at least 0.60"),
    "clean_none": ("clean rigs left alone", "at least 0.95"),
    "outside_unnamed": ("effects outside the list called unnamed", "at least 0.80"),
    "outside_confidently_misnamed": (
        "effects outside the list confidently misnamed",
        "at most 0.10",
    ),
    "intervals": ("90 % intervals that hold the truth", "0.90"),
}
RIVALS = {
    "do_nothing": "do nothing",
    "refit_only": "refit only",
    "raw_bic": "raw BIC",
    "black_box": "black box",
}


def table(result: dict[str, Any]) -> Table:
    """The main marks, the baselines' beside them."""
    rows = []
    for key, (text, target) in TARGETS.items():
        row = result[key]
        interval = f"{row['low95']:.2f} to {row['high95']:.2f}" if row["of"] else ""
        rows.append(
            [text, target, f"{row['share']:.3f}", interval, str(row["of"]), *_rivals(result, key)]
        )
    rows += _closed(result)
    calibration, rigs = result["calibration"], str(result["rigs"])
    blank = [""] * len(RIVALS)
    error = calibration["expected_calibration_error"]
    rows.append(["expected calibration error", "at most 0.05", f"{error:.3f}", "", rigs, *blank])
    base = f"less than {calibration['brier_of_base_rates']:.3f} (base rates)"
    rows.append(["Brier score", base, f"{calibration['brier']:.3f}", "", rigs, *blank])
    worse = result["clean_made_worse"]
    rows.append(
        [
            "clean rigs made worse by, the largest",
            "at most 0.01",
            f"{worse:.3f}",
            "",
            "",
            "0",
            "0",
            "",
            "",
        ]
    )
    seconds = result["seconds_a_rig"]
    rows.append(
        ["seconds a rig, median (loaded machine)", "60", f"{seconds['p50']:.0f}", "", rigs, *blank]
    )
    heads = ["", "target", "measured", "95 % interval", "rigs", *RIVALS.values()]
    return Table("Blind test of the diagnosis", heads, rows)


def _rivals(result: dict[str, Any], key: str) -> list[str]:
    out = []
    for name in RIVALS:
        mark = result["baselines"][name].get(key)
        share = mark["share"] if isinstance(mark, dict) else mark
        out.append("" if share is None else f"{share:.2f}")
    return out


def _closed(result: dict[str, Any]) -> list[list[str]]:
    share, oracle = result["closed_share"], result["closed_share_of_the_oracle"]
    black = result["baselines"]["black_box"]["closed_share"]
    if not share:
        return []
    rows = []
    for question, text, target in (
        ("p50", "median", "at least 0.90"),
        ("p10", "10th percentile", "at least 0.60"),
    ):
        same = f"given the names, of the force: {oracle[question]:.2f}"
        box = f"{black[question]:.2f}" if black else ""
        rows.append(
            [
                f"closable squared error closed, {text}",
                target,
                f"{share[question]:.3f}",
                same,
                "",
                "0",
                "0",
                "",
                box,
            ]
        )
        added = result["closed_share_of_what_was_added"]
        if added:
            label = f"the same of what the hidden effects add to a sound twin's error, {text}"
            rows.append([label, "", f"{added[question]:.3f}", "", "", "0", "0", "", ""])
    return rows


def page(result: dict[str, Any]) -> str:
    """The page's text."""
    confusion = [
        (hidden, sorted(said.items(), key=lambda i: -i[1]))
        for hidden, said in sorted(result["confusion"].items())
    ]
    contents = {
        "rigs": result["rigs"],
        "marks": table(result),
        "confusion": confusion,
        "figure": _figure(result),
    }
    return render("benchmarks/diagnosis/page.html.j2", contents)


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
        middle = [(class_["from"] * class_["to"]) ** 0.5 for class_ in classes]
        right.plot(
            middle,
            [class_["named"]["share"] for class_ in classes],
            "o-",
            color=BLUE,
            label="named right",
        )
        right.plot(
            middle,
            [class_["visible"]["share"] for class_ in classes],
            "o--",
            color=GREY,
            label="visible",
        )
        right.set_xscale("log")
        right.set_xticks(middle, [f"{centre:.2g}" for centre in middle])
        right.minorticks_off()
        right.set_ylim(-0.02, 1.05)
        right.set_xlabel("strength of a single effect (1: well visible)")
        right.legend()
        figure.tight_layout()
        text = svg(figure, "evaluation")
        plt.close(figure)
    return text
