"""A robot's recording is read to SI, and estimate and diagnose refuse every malformed one with one
line.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from shipped import MACHINE
from synthetic_run import synthetic_columns

from testbed.cli import main
from testbed.errors import InputError
from testbed.formats.table import write_columns
from testbed.formats.yaml_files import write_yaml
from testbed.recording.robot import read_robot
from testbed.scenario.scenario import load_scenario
from testbed.simulation.recorder import RunRecorder
from testbed.simulation.run_folder import recording_meta
from testbed.workflows.estimate import estimate_file

SURVEY = {
    "rope_directions_in_world": {"left": [0, 1, 0], "right": [0, -1, 0]},
    "payload_kg": 0.0,
    "urdf": None,
}
PRESSURE = "pressure_a_fl_vertical"
Columns = dict[str, Any]
Fault = Callable[[dict[str, Any], Columns], object]


def header(columns: Columns) -> dict[str, Any]:
    meta = recording_meta(load_scenario("stand_flat"), MACHINE, list(columns), {})
    return {key: value for key, value in meta.items() if key != "surveyed"}


@pytest.fixture
def sound() -> tuple[dict[str, Any], Columns]:
    columns = synthetic_columns(0.3)[0]
    return header(columns), columns


def write(folder: Path, head: dict[str, Any], columns: Columns) -> Path:
    folder.mkdir()
    write_yaml(folder / "recording.yaml", head)
    write_columns(folder / head["data"], columns)
    return folder


def put(path: str, value: Any) -> Fault:
    """Set an entry of the header, groups parted by `/`."""

    def change(head: dict[str, Any], _: Columns) -> None:
        *groups, last = path.split("/")
        for group in groups:
            head = head[group]
        head[last] = value

    return change


def cell(column: str, row: int, value: float) -> Fault:
    return lambda _, columns: columns[column].__setitem__(row, value)


def replaced(column: str, of: Callable[[Any], Any]) -> Fault:
    return lambda _, columns: columns.update({column: of(columns[column])})


def cut(rows: int) -> Fault:
    return lambda _, columns: columns.update(
        {name: values[:rows] for name, values in columns.items()}
    )


def surveyed_without(quantity: str) -> Fault:
    def change(head: dict[str, Any], _: Columns) -> None:
        head["surveyed"] = SURVEY
        del head["channels"][quantity]

    return change


BORE = "known/vertical_cylinder.bore_m"
FAULTS: dict[str, tuple[Fault, str]] = {
    "format": (put("format", "roboclimber-recording/9"), "format = 'roboclimber-recording/9'"),
    "unknown key": (put("colour", "red"), "colour: unknown key"),
    "unit": (
        put(f"channels/{PRESSURE}/unit", "furlong"),
        f"channels.{PRESSURE}.unit = 'furlong': wrong unit",
    ),
    "a unit of its own of what rides along": (
        put("channels/mystery", {"column": "t", "unit": "furlong"}),
        "channels.mystery.unit = 'furlong': wrong unit",
    ),
    "supply in volts": (put("channels/supply_pressure/unit", "V"), "wrong unit"),
    "volts without calibration": (put(f"channels/{PRESSURE}/unit", "V"), "needs a calibration"),
    "calibration beside Pa": (
        put(f"channels/{PRESSURE}/calibration", {"k_pa_per_v": 2e6, "a": 1.0, "b": 0.0}),
        f"channels.{PRESSURE}.calibration: is given beside unit Pa",
    ),
    "column": (put(f"channels/{PRESSURE}/column", "p77"), f"channels.{PRESSURE}.column = 'p77'"),
    "misspelt": (
        put("channels/valve_fl_vertcal", {"column": "t", "unit": "1"}),
        "did you mean 'valve_fl_vertical'",
    ),
    "no channel": (
        lambda head, _: head["channels"].pop("position_rl_vertical"),
        "channels.position_rl_vertical",
    ),
    "no valve of one leg": (
        lambda head, _: head["channels"].pop("valve_fl_vertical"),
        "valve_fl_vertical",
    ),
    "no column": (
        lambda _, columns: columns.pop("position_rl_vertical"),
        "channels.position_rl_vertical.column",
    ),
    "body without a knee": (
        surveyed_without("position_rl_radial"),
        "channels.position_rl_radial is missing",
    ),
    "body without a rope": (
        surveyed_without("rope_tension_left"),
        "channels.rope_tension_left is missing",
    ),
    "no table": (lambda head, _: head.pop("data"), "data: is missing"),
    "time backwards": (cell("t", 120, 0.0), "goes backwards at row 120"),
    "time in ms": (replaced("t", lambda t: 1e3 * t), "the samples come at 1 Hz"),
    "position in mm": (
        replaced("position_fr_vertical", lambda x: np.linspace(0, 400, len(x))),
        "span 400 m",
    ),
    "not a number": (cell(PRESSURE, 7, np.nan), f"'{PRESSURE}' is not finite at row 7"),
    "text": (replaced(PRESSURE, lambda p: ["high"] * len(p)), "is not numbers"),
    "no rows": (cut(0), "too few samples: 0"),
    "two rows": (cut(2), "too few samples: 2"),
    "no bore": (put(f"{BORE}/value", 0.0), "known.vertical_cylinder.bore_m = 0.0: is out of range"),
    "bore in mm": (
        put(f"{BORE}/unit", "mm"),
        "known.vertical_cylinder.bore_m.unit = 'mm': wrong unit",
    ),
    "bore of text": (put(f"{BORE}/value", "wide"), "known.vertical_cylinder.bore_m.value = 'wide'"),
    "two bores": (put(f"{BORE}/value", [0.07, 0.07]), "known.vertical_cylinder.bore_m"),
    "rod wider than the bore": (
        put("known/vertical_cylinder.rod_m/value", 0.3),
        "vertical_cylinder.rod_m = 0.3: is impossible (allowed: 0 < rod < bore = 0.07 m)",
    ),
    "unknown number": (
        put("known/tail.length_m", {"value": 1.0, "unit": "m"}),
        "known.tail.length_m",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("command", ["estimate", "diagnose"])
@pytest.mark.parametrize("name", FAULTS)
def test_every_fault_is_one_line_and_nothing_is_written(
    name: str,
    command: str,
    sound: tuple[dict[str, Any], Columns],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    fault, words = FAULTS[name]
    head, columns = sound
    fault(head, columns)
    (tmp_path / "run").mkdir()
    write_yaml(tmp_path / "run" / "recording.yaml", head)
    pq.write_table(pa.table(columns), tmp_path / "run" / "data.parquet")
    out = tmp_path / ("force.csv" if command == "estimate" else "found")
    monkeypatch.setattr("sys.argv", ["testbed", command, str(tmp_path / "run"), "--out", str(out)])
    with pytest.raises(SystemExit) as left:
        main()
    said = capsys.readouterr().err
    assert left.value.code == 2 and said.count("\n") == 1 and words in said, said
    assert not out.exists()


def test_a_urdf_that_is_not_there_is_told_by_the_field_that_names_it(
    sound: tuple[dict[str, Any], Columns], tmp_path: Path
) -> None:
    head, columns = sound
    folder = write(tmp_path / "run", head | {"surveyed": SURVEY | {"urdf": "other.urdf"}}, columns)
    with pytest.raises(InputError, match=r"surveyed\.urdf = 'other\.urdf': no such file") as told:
        read_robot(folder)
    assert told.value.file == folder / "recording.yaml"


def test_a_urdf_beside_the_recording_is_found_from_anywhere(
    sound: tuple[dict[str, Any], Columns], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    head, columns = sound
    folder = write(tmp_path / "run", head | {"surveyed": SURVEY | {"urdf": "mine.urdf"}}, columns)
    (folder / "mine.urdf").write_bytes(MACHINE.urdf.read_bytes())
    monkeypatch.chdir(tmp_path)
    assert read_robot(folder).machine.urdf == folder / "mine.urdf"
    (tmp_path / "mine.urdf").write_bytes(MACHINE.urdf.read_bytes())
    (folder / "mine.urdf").unlink()
    assert read_robot(folder).machine.urdf == Path("mine.urdf")  # as recordings once had it


@pytest.mark.parametrize("name", ["valve_rr_vertical", "supply_pressure"])
def test_a_diagnosis_needs_more_channels_than_an_estimate(
    name: str, sound: tuple[dict[str, Any], Columns], tmp_path: Path
) -> None:
    from testbed.workflows.diagnose import Wanted, diagnose_folder

    head, columns = sound
    for stem in (
        ("valve_fl", "valve_fr", "valve_rl", "valve_rr") if name.startswith("valve") else (name,)
    ):
        head["channels"].pop(f"{stem}_vertical" if stem.startswith("valve") else stem)
    folder = write(tmp_path / "run", head, columns)
    assert estimate_file(folder, None, tmp_path / "force.csv")["rows"] == 300
    with pytest.raises(InputError, match="is missing"):
        diagnose_folder(folder, tmp_path / "found", Wanted())
    assert not (tmp_path / "found").exists()


def test_a_run_too_short_to_diagnose_leaves_no_folder(
    sound: tuple[dict[str, Any], Columns], tmp_path: Path
) -> None:
    from testbed.workflows.diagnose import Wanted, diagnose_folder

    folder = write(tmp_path / "run", *sound)
    with pytest.raises(
        InputError, match=r"data\.parquet: is too short to learn from: 0\.299 s .*at least 4\.6 s"
    ):
        diagnose_folder(folder, tmp_path / "found", Wanted())
    assert not (tmp_path / "found").exists()


def test_the_columns_are_found_where_the_header_says(
    sound: tuple[dict[str, Any], Columns], tmp_path: Path
) -> None:
    head, columns = sound
    plain = read_robot(write(tmp_path / "plain", head, columns))
    head["data"] = "bench.csv"
    head["channels"][PRESSURE] |= {"column": "volts", "unit": "V"}
    head["channels"][PRESSURE]["calibration"] = {"k_pa_per_v": 2e6, "a": 1.1, "b": 0.01}
    moved = {name: values for name, values in columns.items() if name != PRESSURE}
    moved["volts"] = (columns[PRESSURE] / 2e6 - 0.01) / 1.1
    found = read_robot(write(tmp_path / "moved", head, moved))
    assert set(found.data) == set(plain.data)
    for name, values in plain.data.items():
        np.testing.assert_allclose(found.data[name], values, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("killed_in", ["the run", "the last instant"])
def test_a_killed_run_gives_the_same_forces_as_the_finished_one(
    killed_in: str, sound: tuple[dict[str, Any], Columns], tmp_path: Path
) -> None:
    head, columns = sound
    rows = np.column_stack(list(columns.values()))
    for name in ("finished", "killed"):
        recorder = RunRecorder(tmp_path / name, list(columns), ["t"], head)
        for start in range(0, 300, 100):
            recorder.write(rows[start : start + 100], rows[start : start + 100, :1])
        recorder.finish() if name == "finished" else recorder.close()
    if killed_in == "the last instant":
        (tmp_path / "killed" / "data.parquet").rename(tmp_path / "killed" / "data.parquet.parts")
    for name in ("finished", "killed"):
        estimate_file(tmp_path / name, None, tmp_path / f"{name}.csv")
    assert (tmp_path / "killed.csv").read_text() == (tmp_path / "finished.csv").read_text()


def test_a_run_killed_before_its_first_record_is_refused(
    sound: tuple[dict[str, Any], Columns], tmp_path: Path
) -> None:
    RunRecorder(tmp_path / "run", ["t"], ["t"], sound[0]).close()
    with pytest.raises(InputError, match="holds no record yet"):
        read_robot(tmp_path / "run")
