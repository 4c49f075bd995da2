"""The figures of a run: one function each, from recorded columns to a drawn figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from testbed.estimation.contact_losses import intervals
from testbed.formats.arrays import Array, Columns, Flags
from testbed.formats.records import SET
from testbed.machine.names import LEGS, SIDES
from testbed.report.page import LEG_NAME, method_name
from testbed.report.series import course, envelope, limits, spread, thousands
from testbed.report.style import (
    BAND,
    BLACK,
    BLUE,
    GREEN,
    GREY,
    LEG_COLOUR,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    WIDTH_IN,
    add_legend,
    finish_time_axis,
    method_style,
    new_figure,
)
from testbed.simulation.metrics import LOSS_FORCE_N, methods, rms, rope_tension_n
from testbed.simulation.residuals import Suspect, leg_alone, load_residuals

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Events = Sequence[Mapping[str, Any]]
Layers = Sequence[tuple[str, float]]
LAYER_TINTS = ("#eef0f3", "#dfe2e7")
EVENT_ROWS, LETTER_IN = 4, 0.062
"""Rows of words above the contact bars, and the width of a letter in them."""


def foot_loads(
    data: Columns, truth: Columns, events: Events, window: tuple[float, float] | None = None
) -> Figure:
    """Per leg: the true load, every estimate and the expected load, along the vertical joint's
    axis.
    """
    figure, axes = new_figure(4, 6.9, legend_rows=3)
    start, end = window or (float(truth["t"][0]), float(truth["t"][-1]))
    seen, true_rows = _slice(data["t"], start, end), _slice(truth["t"], start, end)
    names = methods(data)
    unit, word = thousands("N", *(truth[f"foot_load_{leg}"][true_rows] for leg in LEGS))
    for ax, leg in zip(axes, LEGS, strict=True):
        true = truth[f"foot_load_{leg}"][true_rows] / unit
        ax.fill_between(
            *spread(truth["t"][true_rows], true), color=BAND, lw=0, label="truth's range"
        )
        for method in names:
            colour, dash = method_style(method)
            line = course(data["t"][seen], data[f"estimate_{method}_{leg}"][seen] / unit)
            ax.plot(*line, color=colour, ls=dash, label=method_name(method))
        if f"expected_{leg}" in data:
            line = course(data["t"][seen], data[f"expected_{leg}"][seen] / unit)
            ax.plot(*line, color=GREY, lw=1.4, label="expected")
        ax.plot(*course(truth["t"][true_rows], true), color=BLACK, lw=1.2, label="truth")
        near = [
            data[f"estimate_{name}_{leg}"][seen] / unit for name in names if name != "one_chamber"
        ]
        ax.set_ylim(*limits(true, *near))
        ax.set(title=f"{leg}, {LEG_NAME[leg]}", ylabel=f"load [{word}]")
    handles, labels = axes[0].get_legend_handles_labels()
    add_legend(figure, handles[::-1], labels[::-1], 3)
    return over_time(figure, axes, (start, end), events)


def intervals_held(data: Columns, truth: Columns, events: Events) -> Figure:
    """Per leg: the estimate with its 90 % interval, less the true load; red below it where the
    interval was wrong.
    """
    figure, axes = new_figure(4, 6.3, legend_rows=1)
    time_s = data["t"]
    start, end = float(time_s[0]), float(time_s[-1])
    for ax, leg in zip(axes, LEGS, strict=True):
        true = np.interp(time_s, truth["t"], truth[f"foot_load_{leg}"])
        ends = [data[f"own_{end}_{leg}"] - true for end in ("low", "high")]
        wrong = (ends[0] > 0.0) | (ends[1] < 0.0)
        middle, bottom = course(time_s, ends[0])
        ax.fill_between(
            middle, bottom, course(time_s, ends[1])[1], color=BAND, lw=0, label="90 % interval"
        )
        ax.plot(*course(time_s, data[f"estimate_own_{leg}"] - true), color=BLUE, label="estimate")
        ax.axhline(0.0, color=BLACK, lw=1.0, label="truth")
        low, high = limits(*ends, np.zeros(1))
        ax.set_ylim(low - 0.15 * (high - low), high)
        _bars(ax, wrong, time_s, low - 0.08 * (high - low), VERMILION, 0.06 * (high - low))
        held = 100.0 * (1.0 - float(wrong.mean()))
        ax.set(
            title=f"{leg}, {LEG_NAME[leg]}: truth inside for {held:.0f} % of the time",
            ylabel="minus truth [N]",
        )
    return over_time(figure, axes, (start, end), events, 3)


def estimate_errors(data: Columns, truth: Columns, events: Events) -> Figure:
    """Per method: estimate minus truth; means in one colour a leg, the band holds all legs'
    values.
    """
    names = methods(data)
    figure, axes = new_figure(len(names), 6.9, legend_rows=1)
    start, end = float(truth["t"][0]), float(truth["t"][-1])
    for ax, method in zip(axes, names, strict=True):
        errors = {leg: data[f"estimate_{method}_{leg}"] - truth[f"foot_load_{leg}"] for leg in LEGS}
        every = np.stack(list(errors.values()))
        middle, low, _ = spread(data["t"], every.min(axis=0))
        ax.fill_between(middle, low, spread(data["t"], every.max(axis=0))[2], color=BAND, lw=0)
        for leg, error in errors.items():
            ax.plot(*course(data["t"], error), color=LEG_COLOUR[leg], label=leg)
        ax.axhline(0.0, color=BLACK, lw=0.6)
        ax.set_title(f"{method_name(method)}: {rms(every.ravel()):.0f} N RMS")
        ax.set_ylim(*limits(*errors.values(), np.zeros(1)))
        ax.set_ylabel("error [N]")
    return over_time(figure, axes, (start, end), events, 4)


def residuals(data: Columns, method: str, suspect: Suspect | None, events: Events) -> Figure:
    """Per leg: expected minus estimated load, over the band of what friction could make of it."""
    time_s, by_leg = data["t"], load_residuals(data, method)
    figure, axes = new_figure(4, 6.3)
    ends = {
        leg: [
            data[f"expected_{leg}"] - end
            for end in leg_alone(data, method, leg)[1:]
            if end is not None
        ]
        for leg in LEGS
    }
    sets = [end for both in ends.values() for end in both]
    low, high = limits(*by_leg.values(), *sets, np.zeros(1))
    for ax, leg in zip(axes, LEGS, strict=True):
        ax.axhline(0.0, color=BLACK, lw=0.6)
        median = float(np.median(by_leg[leg]))
        named = suspect is not None and suspect.leg == leg
        colour = VERMILION if named else BLUE
        if ends[leg]:
            middle, bottom = course(time_s, ends[leg][0])
            ax.fill_between(middle, bottom, course(time_s, ends[leg][1])[1], color=BAND, lw=0)
        else:
            ax.plot(*envelope(time_s, by_leg[leg], 300), color=colour, lw=0.6, alpha=0.35)
        ax.plot(*course(time_s, by_leg[leg]), color=colour, lw=1.2)
        ax.set_title(
            f"{leg}, {LEG_NAME[leg]}: median {median:+.0f} N" + ("  ← stands out" if named else "")
        )
        ax.set_ylim(low, high)
        ax.set_ylabel("residual [N]")
    return over_time(figure, axes, time_s[[0, -1]], events)


def pressures(data: Columns, truth: Columns, events: Events) -> Figure:
    """Per leg: both chambers of the vertical joint as read; then the supply, and what the pump puts
    in.
    """
    pumped = "pump_power" in truth
    figure, axes = new_figure(6 if pumped else 5, 8.1 if pumped else 6.9, legend_rows=1)
    time_s = data["t"]
    for ax, leg in zip(axes, LEGS, strict=False):
        for side, colour, label in (("a", BLUE, "A, piston side"), ("b", ORANGE, "B, rod side")):
            ax.plot(
                *envelope(time_s, data[f"pressure_{side}_{leg}_vertical"] / 1e5),
                color=colour,
                lw=0.8,
                label=label,
            )
        ax.set(title=f"{leg} vertical", ylabel="[bar]")
    axes[4].plot(*envelope(time_s, data["supply_pressure"] / 1e5), color=GREEN, lw=0.8)
    axes[4].set(title="supply", ylabel="[bar]")
    if pumped:
        unit, word = thousands("W", truth["pump_power"])
        power = truth["pump_power"] / unit
        axes[5].plot(*envelope(truth["t"], power), color=PURPLE, lw=0.8)
        axes[5].set(title=f"pump: {power.mean():.2g} {word} on average", ylabel=f"[{word}]")
    return over_time(figure, axes, time_s[[0, -1]], events, 2)


def ropes_and_drill(
    data: Columns, truth: Columns, slope_deg: float, layers: Layers, events: Events
) -> Figure:
    """Rope tensions, read and true; with a drill at work its force along the slope's normal, its
    moment and the hole.

    `layers`: (kind of rock, depth of its bottom, m) from the surface down, where they are known.
    """
    slope = np.deg2rad(slope_deg)
    force = truth["drill_wrench_in_world_fz"] * np.cos(slope) - truth[
        "drill_wrench_in_world_fx"
    ] * np.sin(slope)
    torque = np.linalg.norm([truth[f"drill_wrench_in_world_t{axis}"] for axis in "xyz"], axis=0)
    drills = bool(np.any(force)) or bool(np.any(torque))
    deep = "hole_depth" in truth and bool(np.any(truth["hole_depth"]))
    pulls = {side: rope_tension_n(truth, side) for side in SIDES}
    held = any(map(np.any, pulls.values()))
    rows = held + 2 * drills + deep
    figure, axes = new_figure(rows, 1.0 + 2.0 * rows)
    time_s, left = truth["t"], iter(axes)
    if held:
        _pulls(next(left), data, time_s, pulls)
    if drills:
        unit, word = thousands("N", force)
        for values, label, title, colour in (
            (force / unit, f"[{word}]", "drill's reaction, + lifts the body", ORANGE),
            (torque, "[N m]", "drill's moment on the body", SKY),
        ):
            ax = next(left)
            ax.plot(*envelope(time_s, values), color=colour, lw=0.7)
            ax.set(title=title, ylabel=label)
    if deep:
        _hole(axes[-1], time_s, truth["hole_depth"], layers)
    return over_time(figure, axes, time_s[[0, -1]], events)


def _pulls(ax: Axes, data: Columns, time_s: Array, pulls: Mapping[str, Array]) -> None:
    """Both ropes' tension, true over read."""
    unit, word = thousands("N", *pulls.values())
    for (side, pull), colour in zip(pulls.items(), (BLUE, VERMILION), strict=True):
        read = data.get(f"rope_tension_{side}")
        if read is not None:
            ax.plot(*envelope(data["t"], read / unit), color=colour, lw=0.6, alpha=0.4)
        ax.plot(*course(time_s, pull / unit), color=colour, lw=1.2, label=side)
    ax.set(title="rope tension: truth over load pins", ylabel=f"[{word}]")
    ax.legend(loc="best", ncols=2)


def _hole(ax: Axes, time_s: Array, depth_m: Array, layers: Layers) -> None:
    """Depth over time, downwards, over the layers that it goes through."""
    low, high = float(depth_m.min()), float(depth_m.max())
    room = max(0.08 * (high - low), 0.005)
    top = 0.0
    for number, (kind, bottom) in enumerate(layers):
        ax.axhspan(top, bottom, color=LAYER_TINTS[number % 2], lw=0)
        shown = max(top, low - room), min(bottom, high + room)
        if shown[1] - shown[0] > 0.1 * (high - low + 2 * room):
            ax.annotate(
                kind,
                (1.0, sum(shown) / 2),
                (-3, 0),
                ("axes fraction", "data"),
                "offset points",
                ha="right",
                va="center",
                fontsize=8,
                color=GREY,
            )
        top = bottom
    ax.plot(*envelope(time_s, depth_m), color=BLUE)
    ax.set_ylim(high + room, max(low - room, 0.0))
    ax.set(
        title="depth of the hole, over the rock's layers" if layers else "depth of the hole",
        ylabel="[m]",
    )


def contacts(data: Columns, truth: Columns, events: Events, loss_n: float = LOSS_FORCE_N) -> Figure:
    """Per leg two bars: where the foot truly carries, and where the detector says so; events
    above.
    """
    figure, axes = new_figure(2, 4.2, [1.0, 2.2]) if events else new_figure(1, 2.9)
    time_s, ax = truth["t"], axes[-1]
    for row, leg in enumerate(LEGS):
        _bars(ax, truth[f"contact_normal_{leg}"] >= loss_n, time_s, row - 0.17, BLACK)
        if f"contact_{leg}" in data:
            _bars(ax, data[f"contact_{leg}"] >= SET, data["t"], row + 0.17, ORANGE)
    ax.set_yticks(range(4), LEGS)
    ax.set_ylim(3.6, -0.6)
    ax.grid(visible=False, axis="y")
    ax.set_title("feet that carry: truth over detector")
    if events:
        _name_events(axes[0], events, float(time_s[0]), float(time_s[-1]))
    mark(ax, events, float(time_s[0]), float(time_s[-1]))
    finish_time_axis(axes, float(time_s[0]), float(time_s[-1]))
    return figure


def _name_events(ax: Axes, events: Events, start: float, end: float) -> None:
    words = [_event_word(event) for event in events]
    times = [float(event["t"]) for event in events]
    places = word_places(times, words, (start, end), WIDTH_IN - 0.94)
    for when, word, place in zip(times, words, places, strict=True):
        ax.axvline(when, color=GREY, lw=0.8)
        if place is None:
            continue
        row, side = place
        ax.annotate(
            word,
            (when, 1.0 - (row + 0.5) / EVENT_ROWS),
            (-2 if side == "right" else 2, 0),
            ("data", "axes fraction"),
            "offset points",
            ha=side,
            va="center",
            fontsize=8,
            backgroundcolor="white",
        )
    left_out = places.count(None)
    ax.set_yticks([])
    ax.set_title(
        "events" + (f" ({left_out} of {len(events)} without room for a label)" if left_out else "")
    )
    ax.grid(visible=False)


def word_places(
    times: Sequence[float], words: Sequence[str], span_s: tuple[float, float], width_in: float
) -> list[tuple[int, str] | None]:
    """For each word a row, and the side of its line that it is aligned to, such that none lies on
    another.

    None where no row has room. A word near the right end stands left of its line, or it would leave
    the page.
    """
    inches_a_second = width_in / max(span_s[1] - span_s[0], 1e-9)
    taken: list[list[tuple[float, float]]] = [[] for _ in range(EVENT_ROWS)]
    places: list[tuple[int, str] | None] = []
    for when, word in zip(times, words, strict=True):
        at, long = (when - span_s[0]) * inches_a_second, LETTER_IN * (len(word) + 1)
        side = "right" if at + long > width_in else "left"
        reach = (at - long, at) if side == "right" else (at, at + long)
        row = next(
            (
                index
                for index, others in enumerate(taken)
                if all(reach[1] <= start or stop <= reach[0] for start, stop in others)
            ),
            None,
        )
        if row is not None:
            taken[row].append(reach)
        places.append(None if row is None else (row, side))
    return places


def _slice(time_s: Array, start: float, end: float) -> slice:
    return slice(
        int(np.searchsorted(time_s, start)), int(np.searchsorted(time_s, end, side="right"))
    )


def _bars(
    ax: Axes, flags: Flags, time_s: Array, row: float, colour: str, height: float = 0.26
) -> None:
    step = float(np.median(np.diff(time_s)))
    spans = [
        (float(time_s[start]), float(time_s[stop - 1] - time_s[start]) + step)
        for start, stop in intervals(flags, time_s)
    ]
    ax.broken_barh(spans, (row - 0.5 * height, height), facecolors=colour, edgecolors="none")


def over_time(
    figure: Figure,
    axes: list[Axes],
    span_s: Sequence[float] | Array,
    events: Events,
    legend_columns: int = 0,
) -> Figure:
    """The figure with its events marked, its time axis and, in so many columns, the legend of its
    first axes.
    """
    start, end = (float(edge) for edge in span_s)
    for ax in axes:
        mark(ax, events, start, end)
    if legend_columns:
        add_legend(figure, *axes[0].get_legend_handles_labels(), legend_columns)
    finish_time_axis(axes, start, end)
    return figure


def mark(ax: Axes, events: Events, start: float, end: float) -> None:
    """A thin dashed line at every event of a stretch of time [s]."""
    for event in events:
        if start <= float(event["t"]) <= end:
            ax.axvline(float(event["t"]), color=GREY, lw=0.6, ls=(0, (2, 2)), zorder=0)


def _event_word(event: Mapping[str, Any]) -> str:
    place = next((str(event[key]) for key in ("leg", "rope", "side") if key in event), "")
    return f"{event['kind']} {place}".replace("_", " ").strip()
