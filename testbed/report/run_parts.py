"""The pictures of a run's report, in the order in which a reader wants them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from testbed.estimation.losses import loss_force_n
from testbed.formats.arrays import Array, Columns
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.report import figures, motion_figures
from testbed.report.ground import Heights, heights_around
from testbed.report.motion import Motion, frame_rows, motion_at, recorded
from testbed.report.series import busiest
from testbed.robot.robot import Robot
from testbed.scenario.terrain import Terrain
from testbed.simulation.metrics import methods, stability_margin, tilt_deg
from testbed.simulation.residuals import Suspect, best_method, load_residuals

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
            lambda: motion_figures.plan_view(motion, weakest, float(margins[row]), run.ground),
        )
    if all(f"position_{axis}" in run.data for axis in AXES):
        yield Part(
            "Strokes and set points",
            "By the encoders; dashed: where control wanted them.",
            lambda: motion_figures.strokes(run.data, run.events),
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
        lambda: motion_figures.body(
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
            lambda: motion_figures.grip(truth, terrain.friction, events, run.loss_n),
        )


def way_up(truth: Columns, slope_deg: float) -> Array:
    """Way of the body up the slope since the first row (rows), m."""
    slope = np.deg2rad(slope_deg)
    along: Array = truth["body_pose_in_world_x"] * np.cos(slope) + truth[
        "body_pose_in_world_z"
    ] * np.sin(slope)
    return np.asarray(along - along[0])
