"""A run for others' viewers: CSV for PlotJuggler, MCAP with Foxglove's schemas, or a film."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from testbed.errors import InputError, extra
from testbed.formats.arrays import Array
from testbed.formats.files import whole
from testbed.machine.names import AXES, SIDES
from testbed.robot.model import quaternions_of
from testbed.simulation.metrics import rope_tension_n
from testbed.simulation.runs import RecordedRun, read_run, run_machines, run_scenario_of
from testbed.simulation.video import SIZE, Video
from testbed.workflows.own_files import check_answer

ENDINGS = (".csv", ".mcap")
NUMBER = {"type": "number"}


def _whole(title: str, **fields: dict[str, Any]) -> dict[str, Any]:
    """A JSON schema of an object that has all of these fields."""
    return {"title": title, "type": "object", "properties": fields, "required": list(fields)}


FRAME_TRANSFORMS = _whole(
    "foxglove.FrameTransforms",
    transforms={
        "type": "array",
        "items": _whole(
            "foxglove.FrameTransform",
            timestamp={
                "title": "time",
                "type": "object",
                "properties": {
                    "sec": {"type": "integer", "minimum": 0},
                    "nsec": {"type": "integer", "minimum": 0, "maximum": 999_999_999},
                },
            },
            parent_frame_id={"type": "string"},
            child_frame_id={"type": "string"},
            translation=_whole("foxglove.Vector3", **dict.fromkeys("xyz", NUMBER)),
            rotation=_whole("foxglove.Quaternion", **dict.fromkeys("xyzw", NUMBER)),
        ),
    },
)
"""As Foxglove publishes them: a panel in three dimensions draws the machine's URDF at these
frames.
"""


def export_run(folder: str | Path, out: str | Path, rate_hz: float = 100.0) -> dict[str, Any]:
    """Write a run as `out`, at most `rate_hz` rows a second; returns what was written.

    CSV: `t`, then `data/<column>` and `truth/<column>`, which PlotJuggler shows as trees. MCAP:
    topics `/data`, `/truth` (JSON objects of all columns) and `/tf` (foxglove.FrameTransforms: the
    world, the body and every link of the URDF). Raises InputError where there is no run, or where
    `out` cannot be written.
    """
    path = check_answer(out, ENDINGS)
    if not rate_hz > 0.0:
        raise InputError("must be positive", field="--rate", value=rate_hz)
    run = read_run(folder)
    step_s = float(np.median(np.diff(run.time_s))) if len(run.time_s) > 1 else 1.0
    rows = np.arange(0, len(run.time_s), max(round(1.0 / (rate_hz * step_s)), 1))
    if path.suffix == ".csv":
        _write_csv(run, rows, path)
    else:
        _write_mcap(run, rows, path)
    return {"out": str(path), "rows": len(rows)}


def _write_csv(run: RecordedRun, rows: npt.NDArray[np.int64], path: Path) -> None:
    columns = {"t": run.time_s}
    for series, found in (("data", run.data), ("truth", run.truth)):
        columns |= {f"{series}/{name}": values for name, values in found.items() if name != "t"}
    table = np.column_stack([values[rows] for values in columns.values()])
    with whole(path) as hidden:
        np.savetxt(hidden, table, "%.9g", ",", header=",".join(columns), comments="")


def _write_mcap(run: RecordedRun, rows: npt.NDArray[np.int64], path: Path) -> None:
    mcap = extra("mcap.writer", "mcap", file=path)
    series = {"/data": run.data, "/truth": run.truth}
    with whole(path) as hidden, hidden.open("wb") as stream:
        writer = mcap.Writer(stream)
        writer.start(profile="", library="roboclimber-testbed")
        channels = {
            topic: _channel(writer, topic, f"roboclimber{topic.replace('/', '.')}", _object(found))
            for topic, found in series.items()
        }
        channels["/tf"] = _channel(writer, "/tf", "foxglove.FrameTransforms", FRAME_TRANSFORMS)
        frames = _frames(run, rows)
        for row, transforms in zip(rows.tolist(), frames, strict=True):
            time_ns = round(float(run.time_s[row]) * 1e9)
            messages: dict[str, Any] = {name: _row(found, row) for name, found in series.items()}
            messages["/tf"] = {"transforms": transforms}
            for topic, message in messages.items():
                data = json.dumps(message).encode()
                writer.add_message(channels[topic], time_ns, data, time_ns)
        writer.finish()


def _channel(writer: Any, topic: str, name: str, schema: Mapping[str, Any]) -> int:
    number = writer.register_schema(
        name=name, encoding="jsonschema", data=json.dumps(schema).encode()
    )
    return int(writer.register_channel(topic=topic, message_encoding="json", schema_id=number))


def _object(columns: Mapping[str, Array]) -> dict[str, Any]:
    return {"type": "object", "properties": {name: NUMBER for name in columns}}


def _row(columns: Mapping[str, Array], row: int) -> dict[str, float]:
    """One row by column; a missing sample, which JSON has no number for, is left out."""
    values = {name: float(values[row]) for name, values in columns.items()}
    return {name: value for name, value in values.items() if np.isfinite(value)}


def _frames(run: RecordedRun, rows: npt.NDArray[np.int64]) -> Iterator[list[dict[str, Any]]]:
    """Row by row: where the body stands in the world, and every link on its parent."""
    from testbed.robot.urdf.drawn import drawn

    _, joints = drawn(run_machines(run.folder).truth.urdf)
    hanging = []
    for joint in joints:
        positions = run.data.get(f"position_{joint.name}", np.zeros(len(run.time_s)))[rows]
        places, turns = joint.pose(positions)
        places = np.broadcast_to(places, (len(rows), 3))
        hanging.append((joint.parent, joint.child, places, quaternions_of(turns)))
    pose = [run.truth[f"body_pose_in_world_{k}"][rows] for k in ("x", "y", "z")]
    turn = [run.truth[f"body_pose_in_world_q{axis}"][rows] for axis in "xyzw"]
    hanging.insert(0, ("world", "body", np.column_stack(pose), np.column_stack(turn)))
    for index, row in enumerate(rows.tolist()):
        seconds, nanoseconds = divmod(round(float(run.time_s[row]) * 1e9), 1_000_000_000)
        yield [
            {
                "timestamp": {"sec": seconds, "nsec": nanoseconds},
                "parent_frame_id": parent,
                "child_frame_id": child,
                "translation": dict(zip("xyz", map(float, places[index]), strict=True)),
                "rotation": dict(zip("xyzw", map(float, turns[index]), strict=True)),
            }
            for parent, child, places, turns in hanging
        ]


# A film of a recorded run: the robot put where its recording has it, seen by the engine's camera.

Tell = Callable[[str], None]


def film(folder: Path, path: Path, tell: Tell | None = None) -> Path:
    """Film a run into a .mp4, .gif or .webp, in simulated time; returns the file.

    `tell("3 of 120 pictures")`. Raises InputError where there is no readable run, or no film can be
    made.
    """
    from testbed.world.scene import pose, set_shown
    from testbed.world.simulation import Simulation

    video = Video(path)
    run, scenario = read_run(folder), run_scenario_of(folder)
    if scenario is None:
        raise InputError("holds no scenario.yaml: where would it be filmed?", file=folder)
    rows = picture_rows(run, video.rate_hz)
    last_pulled = [_last_row(rope_tension_n(run.truth, side) > 0.0) for side in SIDES]
    simulation = Simulation(scenario)
    try:
        machine = simulation.machine
        for number, row in enumerate(rows):
            origin, quaternion, joints = _pose(run, int(row))
            pose(machine, origin, quaternion, joints)
            depth_m = float(run.truth["hole_depth"][row]) if "hole_depth" in run.truth else 0.0
            set_shown(machine, [bool(row <= last) for last in last_pulled], depth_m)
            video.add(machine.picture(*SIZE))
            if tell is not None:
                tell(f"{number + 1} of {len(rows)} pictures")
    finally:
        simulation.close()
    video.write()
    return video.path


def picture_rows(run: RecordedRun, rate_hz: float) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Rows of a recording that are nearest to `rate_hz` pictures a simulated second."""
    times = run.truth["t"]
    wanted = np.arange(times[0], times[-1] + 0.5 / rate_hz, 1.0 / rate_hz)
    return np.unique(np.searchsorted(times, wanted).clip(max=len(times) - 1))


def _pose(run: RecordedRun, row: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The body's origin (3) m and quaternion xyzw in the world, and the joints (12), rad and m."""
    origin, quaternion = (
        np.array([run.truth[f"body_pose_in_world_{name}"][row] for name in names])
        for names in ("xyz", ("qx", "qy", "qz", "qw"))
    )
    return origin, quaternion, np.array([run.data[f"position_{axis}"][row] for axis in AXES])


def _last_row(flags: np.ndarray) -> int:
    """Last row that is true, -1 where none is: a rope that never pulls again is gone."""
    found = np.flatnonzero(flags)
    return int(found[-1]) if found.size else -1
