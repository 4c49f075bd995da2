"""`loop.html`: effects that a machine does not know of, seen, found, added, and judged on another
scenario.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from testbed.machine.names import LEGS
from testbed.report.page import LEG_NAME, render
from testbed.report.style import BLUE, GREY, styled_figure, svg

PLACES: Mapping[str, tuple[float, float]] = {
    "body": (0.0, 0.0),
    "drill": (16.0, 0.0),
    "supply": (-44.0, 0.0),
    "rope": (118.0, 0.0),
    "rope_left": (118.0, -34.0),
    "rope_right": (118.0, 34.0),
}
"""Where places lie on the plan of the machine, forward and to the right of its middle."""
HIPS: Mapping[str, tuple[float, float]] = {
    "fl": (62.0, -30.0),
    "fr": (62.0, 30.0),
    "rl": (-62.0, -30.0),
    "rr": (-62.0, 30.0),
}
OUT: Mapping[str, tuple[float, float]] = {
    "fl": (26.0, -52.0),
    "fr": (26.0, 52.0),
    "rl": (-26.0, -52.0),
    "rr": (-26.0, 52.0),
}
"""From hip to foot."""
ALONG: Mapping[str, float] = {"rotation": 0.0, "radial": 0.5, "vertical": 1.0}


def page(rows: Sequence[Mapping[str, Any]]) -> str:
    """The page's text."""
    shown = [dict(row) | {"figures": figures(row), "plan": plan(row)} for row in rows]
    return render("loop.html.j2", {"rows": shown, "legs": LEG_NAME})


def plan(row: Mapping[str, Any]) -> dict[str, Any]:
    """What the plan of the machine shows: legs from hip to foot, and where effects were found and
    are hidden.
    """
    legs = []
    for leg in LEGS:
        (x, y), (dx, dy) = HIPS[leg], OUT[leg]
        legs.append({"name": leg, "hip": (x, y), "foot": (x + dx, y + dy)})
    found = [
        {"name": effect["name"], "at": place_on_plan(effect["place"])} for effect in row["effects"]
    ]
    return {"legs": legs, "found": found}


def place_on_plan(place: str) -> tuple[float, float]:
    """Where a place lies on the plan, forward and to the right of the machine's middle."""
    if place in PLACES:
        return PLACES[place]
    leg = place.removeprefix("foot_").partition("_")[0]
    if leg not in HIPS:
        return PLACES["body"]
    share = ALONG.get(place.rpartition("_")[2], 1.0)
    (x, y), (dx, dy) = HIPS[leg], OUT[leg]
    return x + share * dx, y + share * dy


def figures(row: Mapping[str, Any]) -> dict[str, str]:
    """`seen`: error of each foot in the first run; `judged`: in the other scenario, before and
    after; `bars`: both.
    """
    return {
        "seen": _courses([(row["seen"], GREY, "as believed")], "seen"),
        "judged": _courses(
            [
                (row["courses"]["before"], GREY, "as believed"),
                (row["courses"]["after"], BLUE, "with what was found"),
            ],
            "judged",
        ),
        "bars": _bars(row["by_leg_n"]),
    }


def _courses(stages: Sequence[tuple[Mapping[str, Any], str, str]], salt: str) -> str:
    with styled_figure(2, 2, (6.4, 3.4), sharex=True, sharey=True) as (drawing, panels):
        for panel, leg in zip(panels.flat, LEGS, strict=True):
            for course, colour, label in stages:
                panel.plot(course["t"], course[leg], color=colour, lw=1.1, label=label)
            panel.axhline(0.0, color="#1a1a1a", lw=0.6)
            panel.set_title(LEG_NAME[leg])
        for panel in panels[1]:
            panel.set_xlabel("time [s]")
        for panel in panels[:, 0]:
            panel.set_ylabel("error [N]")
        drawing.tight_layout(rect=(0.0, 0.0, 1.0, 0.93))
        if len(stages) > 1:
            drawing.legend(*panels[0][0].get_legend_handles_labels(), loc="upper right", ncols=2)
        return svg(drawing, f"loop-{salt}")


def _bars(by_leg: Mapping[str, Mapping[str, float]]) -> str:
    with styled_figure(1, 1, (4.2, 2.3)) as (drawing, panel):
        for index, (stage, colour, label) in enumerate(
            (("before", GREY, "as believed"), ("after", BLUE, "with what was found"))
        ):
            heights = [by_leg[stage][leg] for leg in LEGS]
            at = [place + 0.38 * index - 0.19 for place in range(len(LEGS))]
            bars = panel.bar(at, heights, 0.36, color=colour, label=label)
            panel.bar_label(bars, fmt="%.0f", padding=1, fontsize=7.5)
        panel.set_xticks(range(len(LEGS)), [LEG_NAME[leg] for leg in LEGS])
        panel.set_ylabel("RMS error [N]")
        panel.grid(axis="x", visible=False)
        drawing.tight_layout(rect=(0.0, 0.0, 1.0, 0.9))
        drawing.legend(*panel.get_legend_handles_labels(), loc="upper right", ncols=2)
        return svg(drawing, "loop-bars")
