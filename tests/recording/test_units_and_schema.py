"""Declared units convert on reading, other channels ride along, and the schema lists what the
readers check.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from testbed.cli import main
from testbed.errors import InputError
from testbed.formats.table import write_columns
from testbed.formats.units import UNITS, si_unit, span_to_si, to_si
from testbed.formats.yaml_files import write_yaml
from testbed.recording.axis import read_recording
from testbed.recording.foot import read_foot
from testbed.recording.known import Known
from testbed.recording.leg_model import LegModel, read_model, write_model
from testbed.recording.schema import RIGS, quantities

N = 200
TIME = np.arange(N) / 100.0


def write(folder: Path, head: dict[str, Any], columns: dict[str, np.ndarray]) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    write_yaml(folder / "recording.yaml", head)
    write_columns(folder / head["data"], columns)
    return folder


def cylinder(**channels: dict[str, Any]) -> dict[str, Any]:
    return {
        "format": "roboclimber-recording/1",
        "rig": "cylinder",
        "data": "data.csv",
        "sample_rate_hz": 100,
        "channels": channels,
        "known": {"bore_m": 0.07},
        "reference_force": {
            "kind": "load-cell",
            "column": "F",
            "unit": "kN",
            "standard_deviation": 0.002,
        },
    }


@pytest.mark.parametrize(
    ("value", "unit", "si"),
    [
        (1.0, "bar", 1e5),
        (1.0, "psi", 6894.757293168),
        (250.0, "mm", 0.25),
        (3.0, "kN", 3000.0),
        (180.0, "deg", np.pi),
        (20.0, "ms", 0.02),
        (293.15, "K", 20.0),
        (212.0, "degF", 100.0),
        (60.0, "l/min", 1e-3),
    ],
)
def test_a_unit_becomes_si(value: float, unit: str, si: float) -> None:
    assert to_si(value, unit) == pytest.approx(si)


def test_a_difference_of_temperatures_has_no_zero() -> None:
    assert span_to_si(9.0, "degF") == pytest.approx(5.0)


def test_every_unit_becomes_one_that_stays_itself() -> None:
    assert all(to_si(7.5, UNITS[name].si) == 7.5 for name in UNITS)
    with pytest.raises(InputError, match="unknown unit"):
        si_unit("furlong")


def test_declared_units_give_the_same_recording_as_si(tmp_path: Path) -> None:
    x, p, force = 0.2 + 0.01 * np.sin(TIME), 2e6 + 1e4 * TIME, 3000.0 + TIME
    si = {
        "time": {"column": "t", "unit": "s"},
        "position": {"column": "x", "unit": "m", "resolution": 1e-4},
        "pressure_a": {"column": "p", "unit": "Pa", "range_pa": [0, 1e7]},
    }
    others = {
        "time": {"column": "t", "unit": "ms"},
        "position": {"column": "x", "unit": "mm", "resolution": 0.1},
        "pressure_a": {"column": "p", "unit": "bar", "range_pa": [0, 1e7]},
    }
    one = read_recording(
        write(
            tmp_path / "others",
            cylinder(**others),
            {"t": 1e3 * TIME, "x": 1e3 * x, "p": p / 1e5, "F": force / 1e3},
        )
    )
    head = cylinder(**si)
    head["reference_force"].update(unit="N", standard_deviation=2.0)
    other = read_recording(write(tmp_path / "si", head, {"t": TIME, "x": x, "p": p, "F": force}))
    for name in ("time_s", "position_m", "pressure_a_pa", "reference_force_n"):
        assert getattr(one, name) == pytest.approx(getattr(other, name), rel=1e-12)
    assert one.position_resolution_m == pytest.approx(1e-4)
    assert one.header.reference_force == other.header.reference_force


def test_another_channel_rides_along_in_si(tmp_path: Path) -> None:
    head = cylinder(
        time={"column": "t", "unit": "s"},
        position={"column": "x", "unit": "m"},
        pressure_a={"column": "p", "unit": "Pa"},
        motor_current={"column": "I", "unit": "mA", "meaning": "of the pump"},
        pressure_c={"column": "pc", "unit": "bar"},
    )
    columns = {"t": TIME, "x": TIME, "p": 1e6 + TIME, "F": TIME, "I": 500.0 + TIME, "pc": TIME}
    extra = read_recording(write(tmp_path, head, columns)).extra
    assert set(extra) == {"motor_current", "pressure_c"}
    assert extra["motor_current"][0] == pytest.approx(0.5)
    assert extra["pressure_c"][100] == pytest.approx(1e5)


def foot(**known: float) -> dict[str, Any]:
    return {
        "format": "roboclimber-recording/1",
        "rig": "foot",
        "data": "data.parquet",
        "sample_rate_hz": 100,
        "channels": {
            "time": {"column": "t", "unit": "s"},
            "force": {"column": "F", "unit": "kN"},
            "contact": {"column": "c", "unit": "1"},
        },
        "known": known,
    }


def test_a_foot_is_time_force_and_contact_with_its_own_scale(tmp_path: Path) -> None:
    lifted = (TIME > 0.5) & (TIME < 0.8)
    columns = {"t": TIME, "F": np.where(lifted, 0.0, 9.5), "c": np.where(lifted, 2.0, 3.0)}
    found = read_foot(write(tmp_path, foot(nominal_load_n=9500.0), columns))
    assert found.force_n[0] == pytest.approx(9500.0)
    assert found.contact is not None and (found.contact == ~lifted).all()
    assert found.header.known.nominal_load_n == 9500.0


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"c": TIME}, "has 200 distinct values"),
        ({"F": np.where(TIME == 0.5, np.nan, 1.0)}, "'force' is not finite at row 50"),
        ({"t": TIME[::-1].copy()}, "goes backwards at row 1"),
    ],
)
def test_a_foot_that_cannot_serve_is_one_line(
    tmp_path: Path, change: dict[str, np.ndarray], said: str
) -> None:
    columns = {"t": TIME, "F": TIME, "c": np.ones(N)} | change
    with pytest.raises(InputError, match=said):
        read_foot(write(tmp_path, foot(), columns))


def test_the_range_of_a_pressure_sensor_is_refused_beside_a_force(tmp_path: Path) -> None:
    head = foot()
    head["channels"]["force"]["range_pa"] = [0, 1e7]
    with pytest.raises(InputError, match=r"channels\.force\.range_pa = .* beside unit kN"):
        read_foot(write(tmp_path, head, {"t": TIME, "F": TIME, "c": np.ones(N)}))


def test_a_tolerance_stands_beside_its_number_and_survives_a_model_file(tmp_path: Path) -> None:
    known = Known.model_validate({"bore_m": {"value": 0.07, "tolerance": 0.005}, "rod_m": 0.04})
    assert known.bore_m == 0.07 and known.tolerance("bore_m") == 0.005
    assert known.tolerance("rod_m") == 0.02
    write_model(tmp_path / "m.yaml", LegModel(known=known))
    assert read_model(tmp_path / "m.yaml").known == known
    write_model(tmp_path / "n.yaml", LegModel(known=Known(bore_m=0.07)))
    assert "tolerances" not in (tmp_path / "n.yaml").read_text()


def test_the_schema_lists_every_field_and_every_quantity_with_a_meaning(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.argv", ["testbed", "recording-schema", "--json"])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 0
    schema = json.loads(capsys.readouterr().out)
    assert set(schema) == {"foot", "vertical-leg", "cylinder", "drive", "robot"}
    for rig, entry in schema.items():
        paths = {row["path"] for row in entry["fields"]}
        assert set(RIGS[rig].model_fields) <= {path.split(".")[0] for path in paths}
        assert all(row["meaning"] for row in entry["fields"])
        assert all(q["meaning"] and q["units"] for q in entry["quantities"])
    needed = {q["quantity"] for q in quantities("drive") if q["needed"]}
    assert needed == {"time", "position", "actuator_force"}


def test_every_unit_that_the_schema_lists_is_one_and_becomes_the_quantitys() -> None:
    for rig in RIGS:
        for quantity in quantities(rig):
            known = set(quantity["unit"].split(" or "))
            volts = {"V"} if quantity["quantity"].startswith("pressure_") else set()
            assert {UNITS[unit].si for unit in quantity["units"]} == known | volts
    angle_or_way = next(q for q in quantities("robot") if q["quantity"].startswith("position_"))
    assert {"m", "mm", "rad", "deg"} <= set(angle_or_way["units"])
