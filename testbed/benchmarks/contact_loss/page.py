"""The contact-loss benchmark as a self-contained page, and the picture of its curves."""

from __future__ import annotations

from typing import Any

from testbed import __version__
from testbed.benchmarks.contact_loss import bounds
from testbed.benchmarks.contact_loss.score import CLASSES
from testbed.benchmarks.contact_loss.summary import COMMISSIONED
from testbed.estimation.detectors.learned import Patient
from testbed.estimation.detectors.table import BEST, LIVE
from testbed.report.page import Filters, render
from testbed.report.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    number_powers,
    styled_figure,
    svg,
)

Tree = dict[str, Any]
LOOKS: dict[str, tuple[str, str]] = {
    "floor": (BLACK, "-"),
    bounds.ONE: (GREY, ":"),
    bounds.FOUR: (BLACK, "--"),
    "learned": (PURPLE, "-"),
    "patient": (PURPLE, ":"),
    "held": (VERMILION, "-"),
    "steady": (ORANGE, "--"),
    "combined": (BLUE, "-"),
    "smoothed": (GREEN, "-"),
    "threshold_own": (SKY, "-"),
    "threshold_carried": (ORANGE, "-"),
    "threshold_kbf": (GREY, "-"),
    "threshold_modified_kbf": (BLACK, ":"),
    "cusum": (BLUE, "--"),
    "glr": (GREEN, "--"),
    "expected": (GREY, "--"),
    "momentum": (PURPLE, "--"),
    "multiple_model": (SKY, "--"),
}

TRADED = (bounds.FLOOR, *bounds.TEXTS, LIVE, BEST, Patient.name)
"""Whose recall is shown at several rates of false alarms."""


def page(result: Tree) -> str:
    """The page's text."""
    stages = {"not commissioned": result}
    if result[COMMISSIONED] is not None:
        stages["commissioned"] = result[COMMISSIONED]
    last, final = list(stages.items())[-1]
    best = next(d for d in final["detectors"] if d["best"])
    drawn = result["machine"] != "drawing board"
    tolerances = f"{result['machines']} machines drawn from the tolerances {result['machine']}"
    contents = {
        "r": result,
        "best": best,
        "classes": CLASSES,
        "machine": tolerances if drawn else "the drawing-board machine, which the model knows",
        "stages": stages,
        "last": last,
        "final": final,
        "shown": [final["detectors"][0], best],
        "traded": [d for d in final["detectors"] if d["name"] in TRADED],
        "curves": svg(curves(result | {"detectors": final["detectors"]}), "curves"),
        "version": __version__,
    }
    filters: Filters = {"ms": _ms, "share": _share, "span": _span, "rate": _rate, "number": _number}
    return render("benchmarks/contact_loss/page.html.j2", contents, filters)


def _ms(value: float | None) -> str:
    return "–" if value is None else f"{1000 * value:.0f}"


def _share(value: float | None) -> str:
    return "–" if value is None else f"{100 * value:.1f} %"


def _rate(value: float | None) -> str:
    return "–" if value is None else f"{value:.3g}"


def _number(value: float | None, unit: str) -> str:
    if unit == "s":
        return f"{_ms(value)} ms"
    return _share(value) if unit == "1" else f"{_rate(value)} {unit}"


def _span(value: list[float] | None, scale: float = 1.0) -> str:
    return "" if value is None else f"{scale * value[0]:.3g} to {scale * value[1]:.3g}"


def curves(result: Tree) -> Any:
    """Recall and delay of the detectors that were looked at with many thresholds against their
    false alarms, as a figure.
    """
    with styled_figure(1, 2, (9.0, 4.2)) as (figure, (recall, delay)):
        none_1_h = 0.5 / max(result["hours"], 1e-6)  # where no false alarm at all is drawn
        for entry in result["detectors"]:
            rows = [row for row in entry["curve"] if row[1] is not None]
            if len(rows) < 2:
                continue
            colour, dash = LOOKS.get(entry["name"], (GREY, "-"))
            look: Tree = {"color": colour, "linestyle": dash}
            look["linewidth"] = 2.0 if entry["best"] or entry["name"] == "floor" else 1.0
            x = [max(row[0], none_1_h) for row in rows]
            recall.plot(
                x, [100 * row[2] for row in rows], label=entry["name"].replace("_", " "), **look
            )
            delay.plot(x, [1000 * row[1] for row in rows], **look)
        for axis in (recall, delay):
            axis.set_xscale("log")
            axis.set_xlabel("false alarms an hour of one foot (leftmost: none at all)")
        delay.set_yscale("symlog", linthresh=1.0)
        delay.set_ylim(bottom=0.0)
        recall.set_ylim(0.0, 101.0)
        delay.set_ylabel("median delay of what is detected [ms]")
        recall.set_ylabel("detected losses [%]")
        figure.subplots_adjust(left=0.07, right=0.99, top=0.78, bottom=0.13, wspace=0.2)
        if recall.lines:
            figure.legend(loc="upper left", ncols=5, bbox_to_anchor=(0.03, 1.0), fontsize=8)
        number_powers(figure)
        return figure
