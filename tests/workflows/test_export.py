"""A run for other viewers: the numbers come back out of the CSV and of the MCAP as they were."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from synthetic_run import write_synthetic_run

from testbed.errors import InputError
from testbed.simulation.runs import RecordedRun, read_run
from testbed.workflows.export import export_run


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> RecordedRun:
    return read_run(write_synthetic_run(tmp_path_factory.mktemp("run"), 2.0))


def test_a_csv_has_a_time_and_every_column_under_its_series(
    run: RecordedRun, tmp_path: Path
) -> None:
    done = export_run(run.folder, tmp_path / "run.csv", rate_hz=50.0)
    with (tmp_path / "run.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == done["rows"] == 100
    assert next(iter(rows[0])) == "t"
    assert len(rows[0]) == len(run.data) + len(run.truth) - 1
    assert float(rows[3]["t"]) == pytest.approx(0.06)
    told = [float(row["truth/foot_load_fl"]) for row in rows]
    assert told == pytest.approx(run.truth["foot_load_fl"][::20], rel=1e-6)


def _messages(path: Path) -> dict[str, list[tuple[int, Any, dict[str, Any]]]]:
    reader = pytest.importorskip("mcap.reader")
    found: dict[str, list[tuple[int, Any, dict[str, Any]]]] = {}
    with path.open("rb") as stream:
        for schema, channel, message in reader.make_reader(stream).iter_messages():
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            told = json.loads(message.data)
            found.setdefault(channel.topic, []).append((message.log_time, schema, told))
    return found


def test_an_mcap_has_series_and_frames_that_foxglove_knows(
    run: RecordedRun, tmp_path: Path
) -> None:
    export_run(run.folder, tmp_path / "run.mcap")
    found = _messages(tmp_path / "run.mcap")
    assert {topic: len(messages) for topic, messages in found.items()} == dict.fromkeys(
        ("/data", "/truth", "/tf"), 200
    )
    time_ns, _, data = found["/data"][7]
    assert time_ns == 70_000_000
    assert data["position_fl_radial"] == pytest.approx(run.data["position_fl_radial"][70])
    _, schema, frames = found["/tf"][7]
    assert schema.name == "foxglove.FrameTransforms"
    fields = json.loads(schema.data)["properties"]["transforms"]["items"]["properties"]
    by_child = {frame["child_frame_id"]: frame for frame in frames["transforms"]}
    assert all(set(frame) == set(fields) for frame in by_child.values())
    assert by_child["body"]["parent_frame_id"] == "world"
    assert by_child["body"]["translation"]["z"] == pytest.approx(0.8)
    assert by_child["body"]["rotation"]["y"] == pytest.approx(-np.sin(np.radians(22.5)))
    slid = by_child["fl_radial"]["translation"]["x"]
    assert slid == pytest.approx(0.5 + run.data["position_fl_radial"][70])
    assert {"fl_foot", "drill_mast"} <= set(by_child)


TYPES = {"object": dict, "array": list, "string": str, "integer": int, "number": (int, float)}


def _keeps(told: Any, schema: dict[str, Any]) -> None:
    """Refuse what is not of the schema's type, or has a field that it does not know."""
    assert isinstance(told, TYPES[schema["type"]]), schema
    if schema["type"] == "object":
        assert set(told) <= set(schema["properties"])
        for name, value in told.items():
            _keeps(value, schema["properties"][name])
    if schema["type"] == "array":
        for one in told:
            _keeps(one, schema["items"])


def test_every_message_keeps_to_its_schema_and_frames_hang_together(
    run: RecordedRun, tmp_path: Path
) -> None:
    run.data["estimate_kbf_fl"][30] = np.nan
    export_run(run.folder, tmp_path / "run.mcap", rate_hz=50.0)
    found = _messages(tmp_path / "run.mcap")
    for messages in found.values():
        for _, schema, told in messages:
            _keeps(told, json.loads(schema.data))
    for _, _, told in found["/tf"]:
        frames = {frame["child_frame_id"]: frame for frame in told["transforms"]}
        assert len(frames) == len(told["transforms"]), "each link hangs on one other"
        assert {f["parent_frame_id"] for f in frames.values()} - set(frames) == {"world"}
        for frame in frames.values():
            assert sum(v * v for v in frame["rotation"].values()) == pytest.approx(1.0)


def test_the_frames_schema_has_the_names_and_types_that_foxglove_publishes(
    run: RecordedRun, tmp_path: Path
) -> None:
    export_run(run.folder, tmp_path / "run.mcap", rate_hz=1.0)
    schema = json.loads(_messages(tmp_path / "run.mcap")["/tf"][0][1].data)
    assert (schema["title"], schema["type"]) == ("foxglove.FrameTransforms", "object")
    transform = schema["properties"]["transforms"]["items"]
    assert transform["title"] == "foxglove.FrameTransform"
    titles = {name: part.get("title") for name, part in transform["properties"].items()}
    assert titles == {
        "timestamp": "time",
        "parent_frame_id": None,
        "child_frame_id": None,
        "translation": "foxglove.Vector3",
        "rotation": "foxglove.Quaternion",
    }
    parts = transform["properties"]
    assert set(parts["timestamp"]["properties"]) == {"sec", "nsec"}
    assert "".join(parts["translation"]["properties"]) == "xyz"
    assert "".join(parts["rotation"]["properties"]) == "xyzw"
    for whole in (schema, transform, parts["translation"], parts["rotation"]):
        assert whole["required"] == list(whole["properties"])
    assert parts["timestamp"]["properties"]["nsec"]["maximum"] == 999_999_999


@pytest.mark.parametrize(("name", "said"), [("run.bag", "unknown ending"), ("run.csv", "positive")])
def test_what_cannot_be_written_is_refused(
    run: RecordedRun, tmp_path: Path, name: str, said: str
) -> None:
    with pytest.raises(InputError, match=said):
        export_run(run.folder, tmp_path / name, rate_hz=0.0 if said == "positive" else 1.0)
    assert not list(tmp_path.iterdir())
