"""A recording is read to SI, and every malformed one is refused with one line that names where."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from testbed.errors import InputError
from testbed.formats.table import write_columns
from testbed.formats.yaml_files import write_yaml
from testbed.recording.axis import read_recording, read_rig
from testbed.recording.known import Known
from testbed.recording.leg_model import EffectEntry, Friction, LegModel, read_model, write_model

N = 200


def header() -> dict[str, Any]:
    return {
        "format": "roboclimber-recording/1",
        "rig": "vertical-leg",
        "data": "data.csv",
        "sample_rate_hz": 100,
        "channels": {
            "time": {"column": "t", "unit": "s"},
            "position": {"column": "x", "unit": "m", "resolution": 1e-4},
            "pressure_a": {
                "column": "VA",
                "unit": "V",
                "range_pa": [0, 1e7],
                "calibration": {"k_pa_per_v": 2e6, "a": 1.1, "b": 0.01},
            },
        },
        "known": {"bore_m": 0.07, "rod_m": 0.04, "stroke_m": 0.5, "inclination_deg": 0.0},
        "reference_force": {"kind": "foot-in-air"},
    }


def table() -> dict[str, np.ndarray]:
    t = np.arange(N) / 100.0
    return {"t": t, "x": 0.2 + 0.01 * np.sin(t), "VA": np.full(N, 2.0)}


def write(folder: Path, head: dict[str, Any], columns: dict[str, np.ndarray]) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    write_yaml(folder / "recording.yaml", head)
    write_columns(folder / head["data"], columns)
    return folder


def test_pressure_is_k_times_a_v_plus_b(tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path / "r", header(), table()))
    assert recording.pressure_a_pa is not None
    assert recording.pressure_a_pa[0] == pytest.approx(2e6 * (1.1 * 2.0 + 0.01))  # 4.42 MPa
    assert (
        recording.is_free
        and recording.reference_force_n is not None
        and not recording.reference_force_n.any()
    )


def test_areas_of_a_70_40_cylinder() -> None:
    known = Known(bore_m=0.07, rod_m=0.04)
    assert known.area_a_m2 == pytest.approx(3.8485e-3, rel=1e-4)
    assert known.area_b_m2 == pytest.approx(3.8485e-3 - 1.2566e-3, rel=1e-4)


def test_saturated_samples_are_marked(tmp_path: Path) -> None:
    columns = table()
    columns["VA"][50:60] = 4.6
    recording = read_recording(write(tmp_path / "r", header(), columns))
    assert recording.saturated_a.sum() == 10


def _set(path: str, value: Any) -> Callable[[dict[str, Any], dict[str, np.ndarray]], None]:
    def change(head: dict[str, Any], _: dict[str, np.ndarray]) -> None:
        *groups, last = path.split(".")
        node = head
        for g in groups:
            node = node[g]
        if value is None:
            node.pop(last)
        else:
            node[last] = value

    return change


def _data(
    column: str, row: int, value: float
) -> Callable[[dict[str, Any], dict[str, np.ndarray]], None]:
    def change(_: dict[str, Any], columns: dict[str, np.ndarray]) -> None:
        columns[column][row] = value

    return change


def _short(_: dict[str, Any], columns: dict[str, np.ndarray]) -> None:
    for name in columns:
        columns[name] = columns[name][:20]


def _scaled(column: str, factor: float) -> Callable[[dict[str, Any], dict[str, np.ndarray]], None]:
    def change(_: dict[str, Any], columns: dict[str, np.ndarray]) -> None:
        columns[column] = factor * columns[column]

    return change


FAULTS = {
    "format": (_set("format", "other/1"), "roboclimber-recording/1"),
    "unknown key": (_set("colour", "red"), "colour: unknown key"),
    "unknown known": (
        _set("known.bore_mm", 70),
        "known.bore_mm: unknown key, did you mean 'bore_m'",
    ),
    "wrong unit": (_set("channels.position.unit", "bar"), "wrong unit"),
    "unknown quantity": (
        _set("channels.presure_b", {"column": "x", "unit": "m"}),
        "unknown quantity 'presure_b', did you mean 'pressure_b'",
    ),
    "unknown unit of what rides along": (
        _set("channels.current", {"column": "x", "unit": "furlong"}),
        "channels.current.unit = 'furlong': wrong unit",
    ),
    "one column in two units": (
        _set("channels.current", {"column": "x", "unit": "mm"}),
        "column 'x' cannot be in m and in mm",
    ),
    "tolerance without value": (
        _set("known.bore_m", {"tolerance": 0.01}),
        "bore_m has the keys tolerance (allowed: value, tolerance)",
    ),
    "tolerance of more than half": (
        _set("known.bore_m", {"value": 0.07, "tolerance": 2.0}),
        "tolerance",
    ),
    "tolerance of nothing declared": (
        _set("known.tolerances", {"boar_m": 0.01}),
        "boar_m is no declared number",
    ),
    "missing position": (_set("channels.position", None), "channels.position is missing"),
    "missing pressure": (_set("channels.pressure_a", None), "channels.pressure_a is missing"),
    "missing column": (_set("channels.position.column", "y"), "no such column"),
    "no calibration": (_set("channels.pressure_a.calibration", None), "needs a calibration"),
    "calibration beside Pa": (
        _set("channels.pressure_a.unit", "Pa"),
        "channels.pressure_a.calibration: is given beside unit Pa",
    ),
    "position in mm": (_scaled("x", 1e3), "channels.position.unit = 'm': the positions span 10 m"),
    "time in ms": (_scaled("t", 1e3), "sample_rate_hz = 100.0: the samples come at 0.1 Hz"),
    "time in kiloseconds": (
        _scaled("t", 1e-3),
        "sample_rate_hz = 100.0: the samples come at 1e+05 Hz",
    ),
    "negative bore": (
        _set("known.bore_m", -0.07),
        "known.bore_m = -0.07: is out of range (allowed: more than 0)",
    ),
    "rod beyond bore": (_set("known.rod_m", 0.09), "smaller than bore_m"),
    "robot": (_set("rig", "robot"), "whole robot"),
    "not a rig": (_set("rig", "table"), "rig = 'table'"),
    "no data": (_set("sample_rate_hz", 0), "sample_rate_hz"),
    "nan": (_data("x", 7, np.nan), "row 7"),
    "backwards": (_data("t", 30, 0.0), "goes backwards at row 30"),
    "stands still": (_data("t", 30, 0.29), "stands still at row 30"),
    "too short": (_short, "too few samples: 20"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_every_fault_is_one_line_that_names_it(name: str, tmp_path: Path) -> None:
    head, columns = header(), table()
    change, words = FAULTS[name]
    change(head, columns)
    with pytest.raises(InputError) as caught:
        read_recording(write(tmp_path / "r", head, columns))
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_missing_files_and_broken_yaml_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such folder"):
        read_recording(tmp_path / "nothing")
    folder = write(tmp_path / "r", header(), table())
    (folder / "recording.yaml").write_text("a: [1")
    with pytest.raises(InputError, match="is not valid YAML"):
        read_recording(folder)
    folder = write(tmp_path / "q", header(), table())
    (folder / "data.csv").unlink()
    with pytest.raises(InputError, match="no such file"):
        read_recording(folder)


def test_a_rig_needs_identify_and_verify(tmp_path: Path) -> None:
    write(tmp_path / "rig" / "identify" / "sine", header(), table())
    with pytest.raises(InputError, match="has no folder 'verify'"):
        read_rig(tmp_path / "rig")
    alone = read_rig(tmp_path / "rig", judged=False)  # as identify reads it, which judges nothing
    assert ([r.name for r in alone.identify], alone.verify) == (["sine"], ())
    write(tmp_path / "rig" / "verify" / "sine", header(), table())
    assert [r.name for r in read_rig(tmp_path / "rig").verify] == ["sine"]


@pytest.mark.parametrize(
    ("number", "value"),
    [
        ("bore_m", 0.08),
        ("rod_m", 0.036),
        ("stroke_m", 0.4),
        ("inclination_deg", 30.0),
        ("moving_mass_kg", 120.0),
        ("supply_pressure_nominal_pa", 1.2e7),
    ],
)
def test_recordings_of_two_machines_are_no_rig(number: str, value: float, tmp_path: Path) -> None:
    """One model is fitted to all of them: what one of them alone declares would have no effect."""
    other = header()
    other["known"][number] = value
    write(tmp_path / "rig" / "identify" / "sine", header(), table())
    write(tmp_path / "rig" / "verify" / "steps", other, table())
    with pytest.raises(InputError, match="is another rig than") as caught:
        read_rig(tmp_path / "rig")
    said = str(caught.value)
    assert all(
        word in said for word in (f"known.{number} = {value}", "identify/sine", "verify/steps")
    ), said


def test_half_a_stroke_beyond_the_stroke_and_a_rate_off_by_half_are_read(tmp_path: Path) -> None:
    columns = table()
    columns["x"] = 0.75 * columns["t"] / columns["t"][-1]
    recording = read_recording(write(tmp_path / "r", header() | {"sample_rate_hz": 50}, columns))
    assert np.ptp(recording.position_m) == pytest.approx(0.75)


def test_a_model_survives_its_file(tmp_path: Path) -> None:
    model = LegModel(
        known=Known(bore_m=0.07),
        friction=Friction(coulomb_plus_n=400.0),
        effects=(EffectEntry(name="friction.position", parameters={"slope": 0.9}),),
    )
    write_model(tmp_path / "m.yaml", model)
    again = read_model(tmp_path / "m.yaml")
    assert again == model
    assert again.effects[0].values == {"slope": 0.9}


def test_negative_coulomb_friction_is_refused(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text(
        "format: roboclimber-model/1\nknown: {}\nfriction: {coulomb_plus_n: -3}\n"
    )
    with pytest.raises(InputError, match=r"friction.coulomb_plus_n"):
        read_model(tmp_path / "m.yaml")
