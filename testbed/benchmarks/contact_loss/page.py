"""The contact-loss benchmark as a self-contained page, and the picture of its curves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from testbed import __version__
from testbed.report.page import Filters, render
from testbed.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, RC, SKY, VERMILION, svg

Tree = dict[str, Any]
RATE = "false_alarms_per_hour"
LOOKS: dict[str, tuple[str, str]] = {
    "combined": (VERMILION, "-"),
    "threshold_own": (BLUE, "-"),
    "threshold_carried": (GREEN, "-"),
    "threshold_two_chamber": (SKY, "-"),
    "threshold_friction": (ORANGE, "-"),
    "threshold_kbf": (GREY, "-"),
    "threshold_modified_kbf": (BLACK, ":"),
    "threshold_one_chamber": (PURPLE, ":"),
    "cusum": (BLUE, "--"),
    "glr": (GREEN, "--"),
    "expected": (ORANGE, "--"),
    "momentum": (PURPLE, "--"),
    "multiple_model": (SKY, "--"),
}


def page(result: Tree) -> str:
    """The page's text."""
    best = next(d for d in result["detectors"] if d["best"])
    contents = {
        "r": result,
        "best": best,
        "curves": svg(curves(result), "curves"),
        "targets": targets(result, best),
        "version": __version__,
    }
    filters: Filters = {"ms": _ms, "share": _share, "span": _span, "rate": _rate}
    return render("benchmarks/contact_loss/page.html.j2", contents, filters)


def _ms(value: float | None) -> str:
    return "–" if value is None else f"{1000 * value:.1f}"


def _share(value: float | None) -> str:
    return "–" if value is None else f"{100 * value:.2f} %"


def _rate(value: float | None) -> str:
    return "–" if value is None else f"{value:.3g}"


def _span(value: list[float] | None, scale: float = 1.0) -> str:
    return "" if value is None else f"{scale * value[0]:.3g} to {scale * value[1]:.3g}"


def targets(result: Tree, best: Tree) -> list[tuple[str, str, str, bool | None]]:
    """(what, target, measured, met) of the best detector; met is None where there was nothing to measure."""
    warning, mean, floor = result["warning"], best["delay_mean_s"], best["delay_floor_s"]
    over = None if mean is None or not floor else mean / floor
    with_effect, without = best["undeclared"]["recall"], best["declared"]["recall"]
    fell = None if with_effect is None or without is None else without - with_effect
    ahead, right = warning["warned_100_ms_ahead"], warning["precision"]
    rows: list[tuple[str, str, float | None, Callable[..., str], float]] = [
        ("recall", "at least 99.5 %", best["recall"], _share, 0.995),
        ("false alarms an hour and foot", "at most 0.125", best[RATE], _rate, 0.125),
        ("delay, median", "at most 20 ms", best["delay_median_s"], _ms, 0.020),
        ("delay, 95th percentile", "at most 40 ms", best["delay_p95_s"], _ms, 0.040),
        ("mean delay over the floor", "at most 2", over, _rate, 2.0),
        ("gradual losses warned of 100 ms ahead", "at least 80 %", ahead, _share, 0.8),
        ("warnings followed by a loss", "at least 90 %", right, _share, 0.9),
        ("recall lost to an undeclared effect", "at most 2 points", fell, _share, 0.02),
    ]
    return [
        (what, target, form(value), _met(value, limit, target.startswith("at least")))
        for what, target, value, form, limit in rows
    ]


def _met(value: float | None, limit: float, least: bool) -> bool | None:
    if value is None:
        return None
    return value >= limit if least else value <= limit


def curves(result: Tree) -> Any:
    """Delay and recall of every detector against its false alarms, as a figure."""
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(RC):  # type: ignore[arg-type]
        figure = Figure(figsize=(9.0, 4.2))
        delay, recall = figure.subplots(1, 2)
        none_1_h = 0.5 / max(
            result["foot_hours"]["loaded"], 1e-6
        )  # where no false alarm at all is drawn
        for entry in result["detectors"]:
            rows = [row for row in entry["curve"] if row[1] is not None]
            colour, dash = LOOKS.get(entry["name"], (GREY, "-"))
            x = [max(row[0], none_1_h) for row in rows]
            thick = 2.0 if entry["best"] else 1.0
            label = entry["name"].replace("_", " ")
            look = {
                "color": colour,
                "linestyle": dash,
                "linewidth": thick,
                "drawstyle": "steps-post",
            }
            delay.plot(x, [1000 * row[1] for row in rows], label=label, **look)
            recall.plot(x, [100 * row[2] for row in rows], **look)
        for axis in (delay, recall):
            axis.set_xscale("log")
            axis.axvline(0.125, color=GREY, linewidth=0.6)
            axis.set_xlabel("false alarms an hour and foot (leftmost: none at all)")
        delay.set_yscale("symlog", linthresh=1.0)
        delay.set_ylim(bottom=0.0)
        recall.set_ylim(0.0, 101.0)
        delay.set_ylabel("median delay of what is detected [ms]")
        recall.set_ylabel("detected losses [%]")
        figure.subplots_adjust(left=0.07, right=0.99, top=0.78, bottom=0.13, wspace=0.2)
        figure.legend(loc="upper left", ncols=5, bbox_to_anchor=(0.03, 1.0), fontsize=8)
        return figure
