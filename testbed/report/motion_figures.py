"""Where the robot went and how firmly it stood: plan view, strokes, body and grip."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from testbed.formats.arrays import Array, Columns
from testbed.machine.names import JOINTS, LEGS
from testbed.report.figures import Events, over_time
from testbed.report.ground import Heights
from testbed.report.motion import Motion, footholds, support
from testbed.report.series import course, envelope
from testbed.report.style import (
    BLACK,
    BLUE,
    GREEN,
    LEG_COLOUR,
    VERMILION,
    WIDTH_IN,
    add_legend,
    new_figure,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PLAN_IN, PLAN_ROOM = 4.6, 1.12
SUPPORT = (0.0, 0.447, 0.698, 0.18)
"""Blue that lets the rock show through."""
JOINT_UNITS = {
    "rotation": (180.0 / np.pi, "[deg]"),
    "radial": (1e3, "[mm]"),
    "vertical": (1e3, "[mm]"),
}


def plan_view(motion: Motion, weakest: Motion, margin: float, ground: Heights | None) -> Figure:
    """Seen along the slope's normal: path of the body, footholds, and the feet that carried at the
    weakest moment.
    """
    figure, (ax,) = new_figure(1, PLAN_IN, legend_rows=2)
    path, feet = motion.origin_m[:, :2], motion.feet_m[:, :, :2].reshape(-1, 2)
    _frame_plan(ax, np.concatenate([path, feet]))
    if ground is not None:
        _shade(ax, ground)
    corners, load = support(weakest, 0)
    ax.fill(
        corners[:, 1], corners[:, 0], fc=SUPPORT, ec=BLUE, zorder=0.5, label="feet that carry then"
    )
    ax.plot(load[1], load[0], "x", color=BLACK, ms=7, mew=1.8, label="where their load acts")
    for index, leg in enumerate(LEGS):
        stood = footholds(motion, index)
        ax.plot(stood[:, 1], stood[:, 0], "o", ms=5, mfc="none", color=LEG_COLOUR[leg], label=leg)
    ax.plot(path[:, 1], path[:, 0], color=BLACK, lw=1.4, label="body")
    ax.plot(path[-1, 1], path[-1, 0], "o", color=BLACK, ms=3)
    ax.set(
        title=f"least stability margin {margin:.3f}, at {weakest.time_s[0]:.1f} s",
        xlabel="across the slope, left is + [m]",
        ylabel="up the slope [m]",
    )
    add_legend(figure, *ax.get_legend_handles_labels(), 4)
    return figure


def _frame_plan(ax: Axes, points: Array) -> None:
    """Limits that hold the points (n, 2) in true proportion, up the slope upwards and left to the
    left.
    """
    width_in, height_in = WIDTH_IN - 0.94, PLAN_IN - 1.14
    middle = (points.max(axis=0) + points.min(axis=0)) / 2
    span = np.maximum(np.ptp(points, axis=0), 0.5) * PLAN_ROOM
    metres_an_inch = max(span[0] / height_in, span[1] / width_in)
    half = metres_an_inch * np.array([height_in, width_in]) / 2
    ax.set_ylim(middle[0] - half[0], middle[0] + half[0])
    ax.set_xlim(middle[1] + half[1], middle[1] - half[1])


def _shade(ax: Axes, ground: Heights) -> None:
    """The rock in greys, the higher the lighter."""
    rows, columns = ground.values_m.shape
    edge = ground.cell_m / 2
    ends = (
        ground.y0_m - edge,
        ground.y0_m + columns * ground.cell_m - edge,
        ground.x0_m - edge,
        ground.x0_m + rows * ground.cell_m - edge,
    )
    limits = ax.get_xlim(), ax.get_ylim()
    ax.imshow(
        ground.values_m,
        cmap="gray",
        alpha=0.35,
        extent=ends,
        origin="lower",
        zorder=0,
        aspect="auto",
    )
    ax.set_xlim(limits[0])
    ax.set_ylim(limits[1])


def strokes(data: Columns, events: Events) -> Figure:
    """Per joint: every leg's position and, dashed, its set point."""
    figure, axes = new_figure(len(JOINTS), 5.4, legend_rows=1)
    time_s = data["t"]
    for ax, joint in zip(axes, JOINTS, strict=True):
        factor, unit = JOINT_UNITS[joint]
        for leg in LEGS:
            colour, wanted = LEG_COLOUR[leg], data.get(f"reference_{leg}_{joint}")
            ax.plot(
                *course(time_s, factor * data[f"position_{leg}_{joint}"]), color=colour, label=leg
            )
            if wanted is not None:
                ax.plot(*course(time_s, factor * wanted), color=colour, lw=0.7, ls="--")
        ax.set(title=joint, ylabel=unit)
    return over_time(figure, axes, time_s[[0, -1]], events, 4)


def body(truth: Columns, up_m: Array, tilt_deg: Array, margin: Array, events: Events) -> Figure:
    """The body's way up the slope, its tilt against the slope's normal and its stability margin."""
    figure, axes = new_figure(3, 4.2)
    time_s = truth["t"]
    rows = (
        (up_m * 1e3, "way up the slope", "[mm]", BLUE),
        (tilt_deg, "tilt of the drill axis", "[deg]", VERMILION),
        (margin, "stability margin", "[share]", GREEN),
    )
    for ax, (values, title, unit, colour) in zip(axes, rows, strict=True):
        ax.plot(*envelope(time_s, values), color=colour)
        ax.set(title=title, ylabel=unit)
    axes[2].set_ylim(bottom=0.0)
    return over_time(figure, axes, time_s[[0, -1]], events)


def grip(truth: Columns, friction: float, events: Events, bears_n: float) -> Figure:
    """Per foot: the share of its grip that it takes, where it carries `bears_n` or more."""
    figure, axes = new_figure(1, 2.9, legend_rows=1)
    time_s, ax = truth["t"], axes[0]
    for leg in LEGS:
        use = friction_use(truth, leg, friction, bears_n)
        ax.plot(*envelope(time_s, use), color=LEG_COLOUR[leg], label=leg)
    ax.axhline(1.0, color=BLACK, lw=0.8, ls="--")
    ax.set(title=f"friction use, of a coefficient of {friction:g}", ylabel="[share]")
    ax.set_ylim(0.0, 1.15)
    return over_time(figure, axes, time_s[[0, -1]], events, 4)


def friction_use(truth: Columns, leg: str, friction: float, bears_n: float) -> Array:
    """Tangential force over coefficient times normal force (rows); nan where the foot does not
    carry.
    """
    force = np.stack([truth[f"foot_force_in_world_{leg}_{axis}"] for axis in "xyz"])
    normal = truth[f"contact_normal_{leg}"]
    tangential = np.sqrt(np.maximum((force**2).sum(axis=0) - normal**2, 0.0))
    carries = normal >= bears_n
    return np.where(carries, tangential / (friction * np.where(carries, normal, 1.0)), np.nan)
