"""What the kind of a rig decides: which recordings are refused, and which channels are used."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from testbed.errors import InputError
from testbed.estimation.leg.force import estimate
from testbed.formats.table import write_columns
from testbed.recording.axis import read_recording
from testbed.recording.axis_header import read_header
from testbed.recording.checker.check import check_recording
from testbed.recording.foot import read_foot_header
from testbed.recording.leg_model import Friction, LegModel
from testbed.recording.robot import read_robot_header
from testbed.recording.schema import RIGS


@pytest.mark.parametrize("rig", ["feet", None, ["foot"]])
def test_an_unknown_rig_is_refused_with_every_kind(tmp_path: Path, rig: object) -> None:
    path = tmp_path / "recording.yaml"
    path.write_text(yaml.safe_dump({"format": "roboclimber-recording/1", "rig": rig}))

    with pytest.raises(InputError) as refused:
        read_header(path)

    message = str(refused.value)
    assert "rig" in message
    assert all(kind in message.split("allowed:")[1] for kind in RIGS)


def test_a_rig_of_another_kind_is_refused_as_such_before_its_fields(tmp_path: Path) -> None:
    path = tmp_path / "recording.yaml"
    head = {"format": "roboclimber-recording/1", "rig": "vertical-leg", "reference_force": {}}
    path.write_text(yaml.safe_dump(head))
    for read, wanted in ((read_robot_header, "robot"), (read_foot_header, "foot")):
        with pytest.raises(InputError, match=rf"rig = 'vertical-leg': .*allowed: {wanted}\)"):
            read(path)


def test_pressures_of_a_drive_ride_along_and_its_force_is_its_actuators(tmp_path: Path) -> None:
    """A drive's balance starts from the actuator's force whatever else was recorded."""
    t = np.arange(4000) / 1000.0
    position = 0.2 + 0.02 * t
    noise = np.random.default_rng(0).normal(0.0, 1.0, t.size)
    pressure = 2e6 + 1e3 * noise
    write_columns(
        tmp_path / "data.parquet", {"t": t, "x": position, "F": 700.0 + noise, "p": pressure / 1e5}
    )
    channels = {
        "time": {"column": "t", "unit": "s"},
        "position": {"column": "x", "unit": "m"},
        "actuator_force": {"column": "F", "unit": "N"},
        "pressure_a": {"column": "p", "unit": "bar"},
    }
    known = {"moving_mass_kg": 50.0, "inclination_deg": 90.0}
    head = {"format": "roboclimber-recording/1", "rig": "drive", "data": "data.parquet"}
    head |= {"sample_rate_hz": 1000, "channels": channels, "known": known}
    (tmp_path / "recording.yaml").write_text(yaml.safe_dump(head))
    read = read_recording(tmp_path)
    assert read.pressure_a_pa is None and read.extra["pressure_a"] == pytest.approx(pressure)
    friction = Friction(coulomb_plus_n=200.0)
    found = estimate(read, LegModel(rig="drive", known=read.known, friction=friction)).force_n
    assert found[200:-200] == pytest.approx(500.0, abs=5.0)
    said = [(f.severity, f.channel, f.what) for f in check_recording(tmp_path).findings]
    assert ("note", "pressure_a", "rides along") in said
    assert all(severity == "note" for severity, _, _ in said)
