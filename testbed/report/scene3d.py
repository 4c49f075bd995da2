"""A run in three dimensions, to be turned and wound back: `scene.rrd` for the viewer of rerun-sdk
(extra `view`).

The machine is drawn as the URDF draws it, on its ground, with ropes, the ground's forces on the
feet and the drill's thrust as arrows; beside it, on the same time, loads, pressures and rope
tensions with what the estimators made of them. World frame: x towards the slope, y left, z up; m,
N, Pa, s.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.errors import InputError, extra
from testbed.formats.arrays import Array, Columns
from testbed.formats.files import whole
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.report.page import LEG_NAME, method_name
from testbed.report.style import LEG_COLOUR
from testbed.robot.model import quaternions_of, rotations_of
from testbed.robot.robot import Robot
from testbed.robot.urdf.drawing import COLOURS, Shape
from testbed.robot.urdf.drawn import Hanging, drawn
from testbed.scenario.machines import machines_of
from testbed.scenario.scenario import Scenario, load_scenario
from testbed.scenario.terrain import Patch
from testbed.simulation.metrics import methods
from testbed.simulation.residuals import best_method
from testbed.simulation.runs import RecordedRun, read_run
from testbed.world.ground.terrain import Ground, anchors_in_world, make_ground

FRAME_HZ, MOST_ROWS = 50.0, 60_000
M_A_NEWTON, ASIDE_M = 1e-4, 0.25
"""Length of an arrow for a newton: a foot's ten kilonewtons are a metre; and how far beside the
foot it stands.
"""
CELL_M, ROOM_M = 0.1, 3.0
"""Of the drawn ground: cell, and how far it goes on beyond the machine's way."""
ROPE_M = 5.0
"""As much of a rope is drawn: the anchors are far, and the view would hold them too."""
GROUND, PATCH, ROPE, DRILL, TRUE = (
    (150, 140, 125),
    (190, 120, 80),
    (190, 190, 200),
    (220, 60, 40),
    (225, 175, 40),
)


def write_scene(folder: str | Path) -> Path:
    """Write `scene.rrd` into a run's folder and return its path; works for a killed run too.

    Raises InputError where the folder holds no readable run, the run has no poses, or rerun is not
    installed.
    """
    rr = extra("rerun", "view")
    run = read_run(folder)
    if (
        "body_pose_in_world_x" not in run.truth
        or f"position_{AXES[0]}" not in run.data
        or len(run.truth["t"]) < 2
    ):
        raise InputError(
            "has no poses to draw", file=run.folder, allowed="a run with data, truth and two rows"
        )
    scenario = load_scenario(run.folder / "scenario.yaml")
    machine = machines_of(scenario, run.folder / "scenario.yaml").truth
    robot = Robot.of(machine, rope_height_m=scenario.ropes.attachment_height_m)
    path = run.folder / "scene.rrd"
    recording = rr.RecordingStream(
        "roboclimber", recording_id=f"{scenario.name}, seed {scenario.seed}"
    )
    with whole(path) as hidden:
        recording.save(str(hidden), default_blueprint=_blueprint())
        _still(rr, recording, scenario, robot, run.truth)
        _moving(rr, recording, scenario, robot, run)
        _signals(rr, recording, run)
        recording.flush()
        recording.disconnect()
    return path


def show(path: Path) -> None:
    """Open a scene in rerun's viewer, in a process of its own."""
    import subprocess
    import sys

    subprocess.Popen([sys.executable, "-m", "rerun", str(path)], start_new_session=True)


def _blueprint() -> Any:
    import rerun.blueprint as rrb

    def lines(name: str, *origins: str) -> Any:
        return rrb.TimeSeriesView(
            name=name, origin="/", contents=[f"+ /{origin}/**" for origin in origins]
        )

    loads = [lines(f"load {LEG_NAME[leg]} [N]", f"load/{leg}") for leg in LEGS]
    rest = [
        lines("rope tension [N]", "rope"),
        lines("vertical cylinders [Pa]", "pressure"),
        lines("thrust [N]", "drill"),
    ]
    tabs = [
        rrb.Vertical(*loads, name="foot loads"),
        rrb.Vertical(*rest, name="ropes, pressures, drill"),
    ]
    plots = rrb.Tabs(*tabs)
    scene = rrb.Spatial3DView(name="robot", origin="/world")
    return rrb.Blueprint(rrb.Horizontal(scene, plots, column_shares=[3, 2]), collapse_panels=True)


def link_paths(joints: list[Hanging]) -> dict[str, str]:
    """Link -> where it stands in the tree of what is drawn, below its parent."""
    paths = {"body": "world/body"}
    for joint in joints:
        paths[joint.child] = f"{paths[joint.parent]}/{joint.child}"
    return paths


def _still(rr: Any, recording: Any, scenario: Scenario, robot: Robot, truth: Columns) -> None:
    recording.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    shapes, joints = drawn(robot.machine.urdf)
    paths = link_paths(joints)
    for link, solids in shapes.items():
        _shapes(rr, recording, paths[link], solids)
    for joint in joints:
        if joint.name not in AXES:
            place, turned = joint.pose(np.zeros(1))
            recording.log(
                paths[joint.child],
                rr.Transform3D(translation=place[0], quaternion=quaternions_of(turned)[0]),
                static=True,
            )
    ground = make_ground(scenario.terrain)
    points, normals, triangles, colours = ground_mesh(
        ground, scenario.terrain.patches, _way(ground, truth)
    )
    mesh = rr.Mesh3D(
        vertex_positions=points,
        vertex_normals=normals,
        triangle_indices=triangles,
        vertex_colors=colours,
    )
    recording.log("world/ground", mesh, static=True)


def _shapes(rr: Any, recording: Any, path: str, drawn: list[Shape]) -> None:
    from scipy.spatial.transform import Rotation

    for kind in ("box", "cylinder", "sphere"):
        here = [shape for shape in drawn if shape.kind == kind]
        if not here:
            continue
        common: dict[str, Any] = {
            "centers": [shape.centre for shape in here],
            "quaternions": Rotation.from_euler("xyz", [shape.rpy for shape in here]).as_quat(),
            "colors": [[round(255 * colour) for colour in COLOURS[shape.colour]] for shape in here],
            "fill_mode": "solid",
        }
        if kind == "box":
            solid = rr.Boxes3D(sizes=[shape.size for shape in here], **common)
        elif kind == "cylinder":
            solid = rr.Cylinders3D(
                radii=[shape.size[0] for shape in here],
                lengths=[shape.size[1] for shape in here],
                **common,
            )
        else:
            solid = rr.Ellipsoids3D(half_sizes=[[shape.size[0]] * 3 for shape in here], **common)
        recording.log(f"{path}/{kind}", solid, static=True)


def _way(ground: Ground, truth: Columns) -> tuple[float, float, float, float]:
    """(least x, greatest x, least y, greatest y) of the body in the slope's frame, with room."""
    body = (
        np.column_stack([truth[f"body_pose_in_world_{axis}"] for axis in "xyz"])
        @ ground.rotation_slope_to_world
    )
    low, high = np.nanmin(body, axis=0) - ROOM_M, np.nanmax(body, axis=0) + ROOM_M
    return float(low[0]), float(high[0]), float(low[1]), float(high[1])


def ground_mesh(
    ground: Ground, patches: Sequence[Patch], way: tuple[float, float, float, float]
) -> tuple[Array, Array, npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """(points (n, 3), normals (n, 3), triangles (m, 3), colours (n, 3)) of the ground within `way`,
    in the world.

    `way`: least and greatest x, least and greatest y in the slope's frame, m. Patches that are
    given by a place, not by a foot, have a colour of their own.
    """
    x, y = (np.arange(low, high + CELL_M, CELL_M) for low, high in (way[:2], way[2:]))
    flat = np.column_stack([np.repeat(x, len(y)), np.tile(y, len(x))])
    heights, normals = ground.surface(flat)
    points = np.column_stack([flat, heights])
    colours = np.tile(GROUND, (len(flat), 1))
    for patch in patches:
        if patch.foot is None:
            inside = np.hypot(flat[:, 0] - patch.x_m, flat[:, 1] - patch.y_m) <= patch.radius_m
            colours[inside] = PATCH
    first = (np.arange(len(x) - 1)[:, None] * len(y) + np.arange(len(y) - 1)[None, :]).ravel()
    lower = np.column_stack([first, first + len(y), first + 1])
    upper = np.column_stack([first + 1, first + len(y), first + len(y) + 1])
    return (
        points @ ground.rotation_slope_to_world.T,
        normals,
        np.concatenate([lower, upper]),
        colours,
    )


def _moving(rr: Any, recording: Any, scenario: Scenario, robot: Robot, run: RecordedRun) -> None:
    data, truth = run.data, run.truth
    rows = min(len(data["t"]), len(truth["t"]))
    step = max(
        round(1.0 / (FRAME_HZ * float(np.median(np.diff(truth["t"]))))), -(-rows // MOST_ROWS), 1
    )
    at = np.arange(0, rows, step)
    when = [rr.TimeColumn("time", duration=truth["t"][at])]
    joints = drawn(robot.machine.urdf)[1]
    paths = link_paths(joints)
    body, turned = (
        _vectors(truth, "body_pose_in_world", at),
        _columns(truth, "body_pose_in_world_q", "xyzw", at),
    )
    recording.send_columns(
        "world/body", when, rr.Transform3D.columns(translation=body, quaternion=turned)
    )
    for joint in joints:
        if joint.name in AXES:
            place, turned_by = joint.pose(data[f"position_{joint.name}"][at])
            columns = rr.Transform3D.columns(
                translation=place, quaternion=quaternions_of(turned_by)
            )
            recording.send_columns(paths[joint.child], when, columns)
    turns = rotations_of(turned)
    positions = np.column_stack([data[f"position_{axis}"][at] for axis in AXES])
    feet = body[:, None] + np.array(
        [
            robot.legs.feet(position) @ turn.T
            for position, turn in zip(positions, turns, strict=True)
        ]
    )
    for index, leg in enumerate(LEGS):
        force = _vectors(truth, f"foot_force_in_world_{leg}", at)
        beside = feet[:, index] + turns[:, :, 1] * (ASIDE_M if leg.endswith("l") else -ASIDE_M)
        _arrow(rr, recording, when, f"world/force/{leg}", beside, force, _rgb(LEG_COLOUR[leg]))
    bit = body + turns @ robot.model.drill_mount_m
    _arrow(
        rr,
        recording,
        when,
        "world/force/drill",
        bit,
        _vectors(truth, "drill_wrench_in_world_f", at, ""),
        DRILL,
    )
    if scenario.ropes.enabled:
        ground = make_ground(scenario.terrain)
        anchors = anchors_in_world(scenario.ropes, ground.rotation_slope_to_world)
        for index, side in enumerate(SIDES):
            lower = body + turns @ robot.model.rope_attachments_m[index]
            along = anchors[index] - lower
            far = np.linalg.norm(along, axis=1)[:, None]
            ends = np.stack([lower, lower + along * np.minimum(ROPE_M / far, 1.0)], axis=1)
            path = f"world/rope/{side}"
            recording.log(
                path, rr.LineStrips3D.from_fields(colors=[ROPE], radii=[0.012]), static=True
            )
            recording.send_columns(path, when, rr.LineStrips3D.columns(strips=list(ends)))


def _vectors(columns: Columns, name: str, at: Any, joint: str = "_") -> Array:
    return _columns(columns, name + joint, "xyz", at)


def _columns(columns: Columns, name: str, ends: str, at: Any) -> Array:
    return np.asarray(np.nan_to_num(np.column_stack([columns[f"{name}{end}"][at] for end in ends])))


def _arrow(
    rr: Any,
    recording: Any,
    when: Any,
    path: str,
    origin: Array,
    force_n: Array,
    colour: tuple[int, int, int],
) -> None:
    recording.log(path, rr.Arrows3D.from_fields(colors=[colour], radii=[0.025]), static=True)
    recording.send_columns(
        path, when, rr.Arrows3D.columns(vectors=force_n * M_A_NEWTON, origins=origin)
    )


def _rgb(colour: str) -> tuple[int, int, int]:
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def _signals(rr: Any, recording: Any, run: RecordedRun) -> None:
    """What is plotted beside the scene: at the recorded rate, thinned evenly where a run is very
    long.
    """
    data, truth = run.data, run.truth
    method = best_method(methods(data))
    wanted: list[tuple[str, str, tuple[int, int, int], Columns, str]] = []
    for leg in LEGS:
        wanted.append((f"load/{leg}/true", "true", TRUE, truth, f"foot_load_{leg}"))
        wanted.append(
            (f"load/{leg}/expected", "expected", (150, 150, 150), data, f"expected_{leg}")
        )
        if method:
            name = f"estimate: {method_name(method)}"
            wanted.append(
                (
                    f"load/{leg}/estimate",
                    name,
                    _rgb(LEG_COLOUR[leg]),
                    data,
                    f"estimate_{method}_{leg}",
                )
            )
        for chamber in "ab":
            column = f"pressure_{chamber}_{leg}_vertical"
            name = f"{leg} {chamber.upper()}"
            wanted.append((f"pressure/{leg}_{chamber}", name, _rgb(LEG_COLOUR[leg]), data, column))
    wanted.append(("pressure/supply", "supply", TRUE, data, "supply_pressure"))
    for side, colour in zip(SIDES, (_rgb(LEG_COLOUR["fl"]), _rgb(LEG_COLOUR["fr"])), strict=True):
        wanted.append((f"rope/{side}", side, colour, data, f"rope_tension_{side}"))
    wanted.append(("drill/thrust", "ordered thrust", DRILL, data, "ordered_thrust"))
    for path, name, colour, columns, column in wanted:
        if column not in columns:
            continue
        step = -(-len(columns["t"]) // MOST_ROWS)
        recording.log(path, rr.SeriesLines(colors=[colour], names=[name]), static=True)
        when = [rr.TimeColumn("time", duration=columns["t"][::step])]
        recording.send_columns(path, when, rr.Scalars.columns(scalars=columns[column][::step]))
