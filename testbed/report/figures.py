"""The figures of a run: one function each, from recorded columns to a drawn figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from testbed.estimation.losses import intervals
from testbed.machine.names import LEGS, SIDES
from testbed.report.series import course, envelope, limits, spread
from testbed.report.style import (
    BAND,
    BLACK,
    BLUE,
    GREEN,
    GREY,
    LEG_COLOUR,
    LEG_NAME,
    ORANGE,
    SKY,
    VERMILION,
    add_legend,
    finish_time_axis,
    method_name,
    method_style,
    new_figure,
)
from testbed.simulation.metrics import methods, rms, rope_tension_n
from testbed.simulation.residuals import Suspect, leg_alone, load_residuals

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = npt.NDArray[np.float64]
Columns = Mapping[str, Array]
Events = Sequence[Mapping[str, Any]]


def foot_loads(
    data: Columns, truth: Columns, events: Events, window: tuple[float, float] | None = None
) -> Figure:
    """Per leg: the true load, every estimate and the expected load, along the vertical joint's axis."""
    figure, axes = new_figure(4, 6.9, legend_rows=3)
    start, end = window or (float(truth["t"][0]), float(truth["t"][-1]))
    d, w = _slice(data["t"], start, end), _slice(truth["t"], start, end)
    names = methods(data)
    for ax, leg in zip(axes, LEGS, strict=True):
        true = truth[f"foot_load_{leg}"][w] / 1e3
        ax.fill_between(*spread(truth["t"][w], true), color=BAND, lw=0, label="truth's range")
        for method in names:
            colour, dash = method_style(method)
            line = course(data["t"][d], data[f"estimate_{method}_{leg}"][d] / 1e3)
            ax.plot(*line, color=colour, ls=dash, label=method_name(method))
        if f"expected_{leg}" in data:
            line = course(data["t"][d], data[f"expected_{leg}"][d] / 1e3)
            ax.plot(*line, color=GREY, lw=1.4, label="expected")
        ax.plot(*course(truth["t"][w], true), color=BLACK, lw=1.2, label="truth")
        near = [data[f"estimate_{m}_{leg}"][d] / 1e3 for m in names if m != "one_chamber"]
        ax.set_ylim(*limits(true, *near))
        ax.set_title(f"{leg}, {LEG_NAME[leg]}")
        ax.set_ylabel("load [kN]")
        _mark(ax, events, start, end)
    handles, labels = axes[0].get_legend_handles_labels()
    add_legend(figure, handles[::-1], labels[::-1], 3)
    finish_time_axis(axes, start, end)
    return figure


def estimate_errors(data: Columns, truth: Columns, events: Events) -> Figure:
    """Per method: estimate minus truth; means in one colour a leg, the band holds all legs' values."""
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
        ax.set_title(f"{method_name(method)}: {rms(every.ravel()):.0f} N rms")
        ax.set_ylim(*limits(*errors.values(), np.zeros(1)))
        ax.set_ylabel("error [N]")
        _mark(ax, events, start, end)
    handles, labels = axes[0].get_legend_handles_labels()
    add_legend(figure, handles, labels, 4)
    finish_time_axis(axes, start, end)
    return figure


def residuals(data: Columns, method: str, suspect: Suspect | None, events: Events) -> Figure:
    """Per leg: expected minus estimated load, over the band of what friction could make of it."""
    t, by_leg = data["t"], load_residuals(data, method)
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
            middle, bottom = course(t, ends[leg][0])
            ax.fill_between(middle, bottom, course(t, ends[leg][1])[1], color=BAND, lw=0)
        else:
            ax.plot(*envelope(t, by_leg[leg], 300), color=colour, lw=0.6, alpha=0.35)
        ax.plot(*course(t, by_leg[leg]), color=colour, lw=1.2)
        ax.set_title(
            f"{leg}, {LEG_NAME[leg]}: median {median:+.0f} N" + ("  ← stands out" if named else "")
        )
        ax.set_ylim(low, high)
        ax.set_ylabel("residual [N]")
        _mark(ax, events, float(t[0]), float(t[-1]))
    finish_time_axis(axes, float(t[0]), float(t[-1]))
    return figure


def pressures(data: Columns, events: Events) -> Figure:
    """Per leg: both chambers of the vertical joint as read; then the supply."""
    figure, axes = new_figure(5, 6.9, legend_rows=1)
    t = data["t"]
    for ax, leg in zip(axes, LEGS, strict=False):
        for side, colour, label in (("a", BLUE, "A, piston side"), ("b", ORANGE, "B, rod side")):
            ax.plot(
                *envelope(t, data[f"pressure_{side}_{leg}_vertical"] / 1e5),
                color=colour,
                lw=0.8,
                label=label,
            )
        ax.set_title(f"{leg} vertical")
        ax.set_ylabel("[bar]")
        _mark(ax, events, float(t[0]), float(t[-1]))
    axes[4].plot(*envelope(t, data["supply_pressure"] / 1e5), color=GREEN, lw=0.8)
    axes[4].set_title("supply")
    axes[4].set_ylabel("[bar]")
    handles, labels = axes[0].get_legend_handles_labels()
    add_legend(figure, handles, labels, 2)
    finish_time_axis(axes, float(t[0]), float(t[-1]))
    return figure


def ropes_and_drill(data: Columns, truth: Columns, slope_deg: float, events: Events) -> Figure:
    """Rope tensions, read and true; with a drill at work also its force along the slope's normal and its moment."""
    slope = np.deg2rad(slope_deg)
    force = truth["drill_wrench_in_world_fz"] * np.cos(slope) - truth[
        "drill_wrench_in_world_fx"
    ] * np.sin(slope)
    torque = np.linalg.norm([truth[f"drill_wrench_in_world_t{i}"] for i in "xyz"], axis=0)
    drills = bool(np.any(force)) or bool(np.any(torque))
    figure, axes = new_figure(3 if drills else 1, 6.6 if drills else 3.0)
    t = truth["t"]
    for side, colour in zip(SIDES, (BLUE, VERMILION), strict=True):
        read = data.get(f"rope_tension_{side}")
        if read is not None:
            axes[0].plot(*envelope(data["t"], read / 1e3), color=colour, lw=0.6, alpha=0.4)
        axes[0].plot(
            *course(t, rope_tension_n(truth, side) / 1e3), color=colour, lw=1.2, label=side
        )
    axes[0].set_title("rope tension, true over read")
    axes[0].set_ylabel("[kN]")
    axes[0].legend(loc="best", ncols=2)
    if drills:
        axes[1].plot(*envelope(t, force / 1e3), color=ORANGE, lw=0.7)
        axes[1].set_title("drill's reaction, + lifts the body")
        axes[1].set_ylabel("[kN]")
        axes[2].plot(*envelope(t, torque), color=SKY, lw=0.8)
        axes[2].set_title("drill's moment on the body")
        axes[2].set_ylabel("[N m]")
    for ax in axes:
        _mark(ax, events, float(t[0]), float(t[-1]))
    finish_time_axis(axes, float(t[0]), float(t[-1]))
    return figure


def contacts(data: Columns, truth: Columns, events: Events, loss_force_n: float) -> Figure:
    """Per leg two bars: where the foot truly carries, and where the detector says so; events above."""
    figure, axes = new_figure(2, 4.2, [1.0, 2.2]) if events else new_figure(1, 2.9)
    t, ax = truth["t"], axes[-1]
    for row, leg in enumerate(LEGS):
        _bars(ax, truth[f"contact_normal_{leg}"] >= loss_force_n, t, row - 0.17, BLACK)
        if f"contact_{leg}" in data:
            _bars(ax, data[f"contact_{leg}"] >= 0.5, data["t"], row + 0.17, ORANGE)
    ax.set_yticks(range(4), LEGS)
    ax.set_ylim(3.6, -0.6)
    ax.grid(visible=False, axis="y")
    ax.set_title("feet that carry: truth over the word")
    if events:
        _name_events(axes[0], events, float(t[0]), float(t[-1]))
    _mark(ax, events, float(t[0]), float(t[-1]))
    finish_time_axis(axes, float(t[0]), float(t[-1]))
    return figure


def _name_events(ax: Axes, events: Events, start: float, end: float) -> None:
    for number, event in enumerate(events):
        when = float(event["t"])
        late = when > start + 0.7 * (
            end - start
        )  # its word goes to the left, or it would leave the page
        ax.axvline(when, color=GREY, lw=0.8)
        ax.annotate(
            _event_word(event),
            (when, 0.88 - 0.25 * (number % 4)),
            (-2 if late else 2, 0),
            ("data", "axes fraction"),
            "offset points",
            ha="right" if late else "left",
            va="center",
            fontsize=8,
        )
    ax.set_yticks([])
    ax.set_title("events")
    ax.grid(visible=False)


def body(t: Array, tilt_deg: Array, up_m: Array, margin: Array, events: Events) -> Figure:
    """The body's way up the slope, its tilt against the slope's normal and its stability margin."""
    figure, axes = new_figure(3, 4.2)
    rows = (
        (up_m * 1e3, "way up the slope", "[mm]", BLUE),
        (tilt_deg, "tilt of the drill axis", "[deg]", VERMILION),
        (margin, "stability margin", "[share]", GREEN),
    )
    for ax, (values, title, unit, colour) in zip(axes, rows, strict=True):
        ax.plot(*envelope(t, values), color=colour)
        ax.set_title(title)
        ax.set_ylabel(unit)
        _mark(ax, events, float(t[0]), float(t[-1]))
    axes[2].set_ylim(bottom=0.0)
    finish_time_axis(axes, float(t[0]), float(t[-1]))
    return figure


def _slice(t: Array, start: float, end: float) -> slice:
    return slice(int(np.searchsorted(t, start)), int(np.searchsorted(t, end, side="right")))


def _bars(ax: Axes, flags: npt.NDArray[np.bool_], t: Array, row: float, colour: str) -> None:
    step = float(np.median(np.diff(t)))
    spans = [(float(t[a]), float(t[b - 1] - t[a]) + step) for a, b in intervals(flags, t)]
    ax.broken_barh(spans, (row - 0.13, 0.26), facecolors=colour, edgecolors="none")


def _mark(ax: Axes, events: Events, start: float, end: float) -> None:
    for event in events:
        if start <= float(event["t"]) <= end:
            ax.axvline(float(event["t"]), color=GREY, lw=0.6, ls=(0, (2, 2)), zorder=0)


def _event_word(event: Mapping[str, Any]) -> str:
    place = next((str(event[k]) for k in ("leg", "rope", "side") if k in event), "")
    return f"{event['kind']} {place}".replace("_", " ").strip()
