"""Two runs on one page: what each comes to, and the same series of both on the same axes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from testbed.estimation.contact_losses import loss_force_n
from testbed.formats.arrays import Array
from testbed.formats.yaml_files import flattened
from testbed.machine.names import LEGS, SIDES
from testbed.machine.scale import ROBOCLIMBER_NOMINAL_N
from testbed.report.console import summary_rows
from testbed.report.page import LEG_NAME, render, words
from testbed.report.run_parts import way_up
from testbed.report.series import course, limits, thousands
from testbed.report.style import (
    BLACK,
    BLUE,
    RC,
    VERMILION,
    add_legend,
    finish_time_axis,
    new_figure,
    svg,
)
from testbed.simulation.metrics import rope_tension_n, stability_margin, tilt_deg
from testbed.simulation.runs import RecordedRun

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = (BLUE, VERMILION)
ABSENT = "–"


class Side(NamedTuple):
    """One of the two runs: what the page calls it, the run, and what it comes to (see
    summary.json).
    """

    name: str
    run: RecordedRun
    summary: Mapping[str, Any]
    settings: Mapping[str, Any]
    """Its scenario, as a tree."""


def page(first: Side, second: Side) -> str:
    """The page's text."""
    sides = (first, second)
    return render(
        "comparison.html.j2",
        {
            "names": [side.name for side in sides],
            "differences": differences(_made(first), _made(second)),
            "rows": rows(first.summary, second.summary),
            "parts": _parts(sides),
            "glossary": words("machine", "estimate", "safety"),
        },
    )


def _made(side: Side) -> dict[str, Any]:
    """The settings that a run is made of; a mutation is for tests alone."""
    return {name: value for name, value in side.settings.items() if name != "mutation"}


def differences(first: Mapping[str, Any], second: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """(dotted path, first value, second value) of every leaf in which two trees differ."""
    one, other = dict(flattened(first, lists=True)), dict(flattened(second, lists=True))
    paths = dict.fromkeys([*one, *other])
    return [
        (path, _word(one, path), _word(other, path))
        for path in paths
        if _word(one, path) != _word(other, path)
    ]


def _word(leaves: Mapping[str, Any], path: str) -> str:
    value = leaves.get(path)
    return ABSENT if value is None else f"{value:g}" if isinstance(value, float) else str(value)


def rows(first: Mapping[str, Any], second: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """(name, first value, second value) of what a person wants to know of a run."""
    one, other = dict(summary_rows(first)), dict(summary_rows(second))
    names = dict.fromkeys([*one, *other])
    return [(name, one.get(name, ABSENT), other.get(name, ABSENT)) for name in names]


def _parts(sides: tuple[Side, Side]) -> list[dict[str, str]]:
    import matplotlib

    with matplotlib.rc_context(RC):  # type: ignore[arg-type]
        drawn = (
            ("Foot loads", _loads(sides)),
            ("Errors of the own estimate", _errors(sides)),
            ("Body, ropes and margin", _body(sides)),
        )
        return [
            {"title": title, "svg": svg(figure, f"c{index}")}
            for index, (title, figure) in enumerate(drawn)
        ]


def _loads(sides: tuple[Side, Side]) -> Figure:
    """Per leg: the true load of both."""
    figure, axes = new_figure(len(LEGS), 6.5, legend_rows=1)
    every = [side.run.truth[f"foot_load_{leg}"] for side in sides for leg in LEGS]
    unit, word = thousands("N", *every)
    for ax, leg in zip(axes, LEGS, strict=True):
        for side, colour in zip(sides, COLOURS, strict=True):
            truth = side.run.truth
            line = course(truth["t"], truth[f"foot_load_{leg}"] / unit)
            ax.plot(*line, color=colour, label=side.name)
        ax.set(title=f"{leg}, {LEG_NAME[leg]}: truth", ylabel=f"load [{word}]")
    return _finished(figure, axes, sides)


def _errors(sides: tuple[Side, Side]) -> Figure:
    """Per leg: own estimate minus truth of both."""
    figure, axes = new_figure(len(LEGS), 6.5, legend_rows=1)
    for ax, leg in zip(axes, LEGS, strict=True):
        found: list[Array] = [np.zeros(1)]
        for side, colour in zip(sides, COLOURS, strict=True):
            estimate = side.run.data.get(f"estimate_own_{leg}")
            if estimate is not None:
                found.append(estimate - side.run.truth[f"foot_load_{leg}"])
                ax.plot(*course(side.run.data["t"], found[-1]), color=colour, label=side.name)
        ax.axhline(0.0, color=BLACK, lw=0.6)
        ax.set_ylim(*limits(*found))
        ax.set(title=f"{leg}, {LEG_NAME[leg]}", ylabel="error [N]")
    return _finished(figure, axes, sides)


def _body(sides: tuple[Side, Side]) -> Figure:
    """Way up the slope, tilt, margin and the sum of the ropes' tensions of both."""
    figure, axes = new_figure(4, 6.5, legend_rows=1)
    for side, colour in zip(sides, COLOURS, strict=True):
        series = zip(axes, _of_the_body(side), strict=True)
        for ax, (title, unit, values) in series:
            ax.plot(*course(side.run.truth["t"], values), color=colour, label=side.name)
            ax.set(title=title, ylabel=unit)
    return _finished(figure, axes, sides)


def _of_the_body(side: Side) -> Iterator[tuple[str, str, Array]]:
    truth, slope_deg = side.run.truth, float(side.summary.get("slope_deg") or 0.0)
    yield "way up the slope", "[mm]", 1e3 * way_up(truth, slope_deg)
    yield "tilt of the drill axis", "[deg]", tilt_deg(truth, slope_deg)
    bears_n = loss_force_n(side.summary.get("nominal_load_n") or ROBOCLIMBER_NOMINAL_N)
    yield "stability margin", "[share]", stability_margin(truth, bears_n)
    ropes = sum((rope_tension_n(truth, rope) for rope in SIDES), np.zeros(len(truth["t"])))
    yield "both ropes", "[kN]", ropes / 1e3


def _finished(figure: Figure, axes: list[Axes], sides: tuple[Side, Side]) -> Figure:
    add_legend(figure, *axes[0].get_legend_handles_labels(), 2)
    finish_time_axis(axes, 0.0, max(float(side.run.truth["t"][-1]) for side in sides))
    return figure
