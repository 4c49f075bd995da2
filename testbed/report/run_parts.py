"""The pictures of a run's report, in the order in which a reader wants them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from testbed.estimation.contact_losses import loss_force_n
from testbed.formats.arrays import Array, Columns
from testbed.machine.names import AXES, JOINTS, LEGS, SIDES
from testbed.report import figures
from testbed.report.figures import Events, over_time
from testbed.report.motion import (
    Heights,
    Motion,
    footholds,
    frame_rows,
    heights_around,
    motion_at,
    recorded,
    support,
)
from testbed.report.series import busiest, course, envelope
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
from testbed.robot.robot import Robot
from testbed.scenario.terrain import Terrain
from testbed.simulation.metrics import methods, stability_margin, tilt_deg
from testbed.simulation.residuals import Suspect, best_method, load_residuals

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# Where the robot went and how firmly it stood: plan view, strokes, body and grip.

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
    normal, tangential = foot_parts(truth, leg)
    carries = normal >= bears_n
    return np.where(carries, tangential / (friction * np.where(carries, normal, 1.0)), np.nan)


def foot_parts(truth: Columns, leg: str) -> tuple[Array, Array]:
    """Normal and tangential part of the ground's force on a foot, N, (rows) each."""
    force = np.stack([truth[f"foot_force_in_world_{leg}_{axis}"] for axis in "xyz"])
    normal = truth[f"contact_normal_{leg}"]
    return normal, np.sqrt(np.maximum((force**2).sum(axis=0) - normal**2, 0.0))


NO_FEET = [
    *(f"rope_force_in_world_{side}_{axis}" for side in SIDES for axis in "xyz"),
    *(f"drill_wrench_in_world_{axis}" for axis in ("fx", "fz", "tx", "ty", "tz")),
]
"""What holds or pushes the machine besides the ground."""
CLOSE_UP_S = 3.0
"""Shorter runs are close up as they are."""


class Part(NamedTuple):
    """One picture with its title and what it shows."""

    title: str
    text: str
    figure: Callable[[], Figure]
    """Draws it, which takes its time."""


@dataclass(frozen=True, eq=False)
class Shown:
    """A run as its pictures need it."""

    data: Columns
    truth: Columns
    slope_deg: float
    robot: Robot
    """The one that moved."""
    terrain: Terrain | None
    events: Sequence[Mapping[str, Any]]
    layers: figures.Layers
    named: Suspect | None
    motion: Motion | None
    ground: Heights | None

    @property
    def loss_n(self) -> float:
        """A foot with less normal force has lost its contact."""
        return loss_force_n(self.robot.machine.scale.nominal_load_n)


def shown(
    series: tuple[Columns, Columns],
    summary: Mapping[str, Any],
    robot: Robot,
    terrain: Terrain | None,
    named: Suspect | None,
) -> Shown:
    """Gather it from (data, truth) and what the run comes to (see summary.json)."""
    data, truth = series
    slope_deg = float(summary.get("slope_deg") or 0.0)
    motion = ground = None
    if recorded(data, truth):
        motion = motion_at(data, truth, slope_deg, robot, frame_rows(truth))
        ground = heights_around(terrain, motion.feet_m[:, :, :2].reshape(-1, 2))
    layers = [
        (layer["kind"], layer["bottom_m"])
        for layer in (summary.get("drill") or {}).get("layers") or []
    ]
    events = summary.get("events") or []
    return Shown(data, truth, slope_deg, robot, terrain, events, layers, named, motion, ground)


def parts(run: Shown) -> Iterator[Part]:
    """Every picture that the recording has the columns for."""
    yield from _loads(run)
    yield from _whereabouts(run)
    yield from _machinery(run)
    yield from _standing(run)


def _loads(run: Shown) -> Iterator[Part]:
    data, truth, events = run.data, run.truth, run.events
    yield Part(
        "Foot loads",
        "Along the vertical joint's axis. Lines are means over stretches of 0.2 % of the time.",
        lambda: figures.foot_loads(data, truth, events),
    )
    method = best_method(methods(data))
    if method and len(load_residuals(data, method)) == len(LEGS):
        word = f"Leg {run.named}." if run.named else "No leg stands out by itself."
        yield Part(
            "Expected minus estimated",
            f"Expected load less what the leg's own cylinder says; band: what friction leaves open. {word}",
            lambda: figures.residuals(data, method, run.named, events),
        )
    window = busiest(truth["t"], truth["foot_load_fl"])
    if truth["t"][-1] - truth["t"][0] > CLOSE_UP_S:
        yield Part(
            "Foot loads, close up",
            f"The second in which the load of fl changes most, from {window[0]:.2f} s.",
            lambda: figures.foot_loads(data, truth, events, window),
        )
    if methods(data):
        yield Part(
            "Errors of the estimates",
            "Estimate minus truth, the paper's equations one after the other.",
            lambda: figures.estimate_errors(data, truth, events),
        )
    if all(f"own_low_{leg}" in data for leg in LEGS):
        yield Part(
            "How sure the estimate is",
            "The whole-body estimate and its 90 % interval, less the true load. Red: the interval was wrong.",
            lambda: figures.intervals_held(data, truth, events),
        )


def _whereabouts(run: Shown) -> Iterator[Part]:
    if (motion := run.motion) is not None:
        margins = stability_margin(run.truth, run.loss_n)
        row = int(np.argmin(margins))
        weakest = motion_at(
            run.data, run.truth, run.slope_deg, run.robot, np.array([row], dtype=np.int64)
        )
        rock = " The rock in greys, the higher the lighter." if run.ground is not None else ""
        yield Part(
            "Plan view",
            "Seen from off the slope: the body's path, a ring wherever a foot stood, and in blue the feet that carried at "
            f"the weakest moment.{rock}",
            lambda: plan_view(motion, weakest, float(margins[row]), run.ground),
        )
    if all(f"position_{axis}" in run.data for axis in AXES):
        yield Part(
            "Strokes and set points",
            "By the encoders; dashed: where control wanted them.",
            lambda: strokes(run.data, run.events),
        )


def _machinery(run: Shown) -> Iterator[Part]:
    yield Part(
        "Pressures and power",
        "As the transducers read them, through their calibration; what the pump puts in is the truth.",
        lambda: figures.pressures(run.data, run.truth, run.events),
    )
    if any(np.any(run.truth[name]) for name in NO_FEET):
        yield Part(
            "Ropes and drill",
            "What holds the robot and what pushes it.",
            lambda: figures.ropes_and_drill(
                run.data, run.truth, run.slope_deg, run.layers, run.events
            ),
        )


def _standing(run: Shown) -> Iterator[Part]:
    data, truth, events = run.data, run.truth, run.events
    yield Part(
        "Contact and events",
        f"Black: the foot truly carries ({run.loss_n:g} N and more); orange: the detector says that it does.",
        lambda: figures.contacts(data, truth, events, run.loss_n),
    )
    yield Part(
        "Body",
        "Margin: share of the load off the edge about which the robot would tip first, 0 to 0.5.",
        lambda: body(
            truth,
            way_up(truth, run.slope_deg),
            tilt_deg(truth, run.slope_deg),
            stability_margin(truth, run.loss_n),
            events,
        ),
    )
    if (terrain := run.terrain) is not None:
        yield Part(
            "Grip",
            "Share of its grip that each foot takes while it carries; it slides at 1 (dashed).",
            lambda: grip(truth, terrain.friction, events, run.loss_n),
        )


def way_up(truth: Columns, slope_deg: float) -> Array:
    """Way of the body up the slope since the first row (rows), m."""
    slope = np.deg2rad(slope_deg)
    along: Array = truth["body_pose_in_world_x"] * np.cos(slope) + truth[
        "body_pose_in_world_z"
    ] * np.sin(slope)
    return np.asarray(along - along[0])
