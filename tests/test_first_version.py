"""Recordings, rigs and model files that the first version wrote stay readable, and say the same."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from testbed.effects import read_believed
from testbed.estimation.friction.identification import identify_rig
from testbed.formats.table import read_columns
from testbed.recording.axis import read_rig
from testbed.recording.robot import read_robot
from testbed.workflows.diagnose import Wanted, diagnose_folder
from testbed.workflows.estimate import estimate_file

SAMPLES = Path(__file__).parent / "data" / "first_version"
ESTIMATES = json.loads((SAMPLES / "estimates.json").read_text())


@pytest.mark.parametrize(
    ("sample", "recording", "within_n"),
    [
        ("leg", "leg/verify/press", 1.0),
        ("drive", "drive/verify/sine", 0.1),
        ("robot", "robot", 1e3),
    ],
)
def test_the_force_is_estimated_as_then(
    sample: str, recording: str, within_n: float, tmp_path: Path
) -> None:
    model = None if sample == "robot" else SAMPLES / sample / "model.yaml"
    out = tmp_path / "forces.csv"
    estimate_file(SAMPLES / recording, model, out)
    then = ESTIMATES[sample]
    force = read_columns(out, {then["column"]: "column"}, out)[then["column"]]
    assert force[then["rows"]] == pytest.approx(then["force_n"], abs=within_n)


@pytest.mark.parametrize("sample", ["leg", "drive"])
def test_a_rig_is_identified_as_then(sample: str) -> None:
    now = identify_rig(read_rig(SAMPLES / sample)).model
    then = read_believed(SAMPLES / sample / "model.yaml")
    assert now.known.model_dump(exclude_none=True) == pytest.approx(
        then.known.model_dump(exclude_none=True), rel=0.01
    )
    friction = then.friction
    if sample == "drive":  # then all friction of its narrow speeds was Coulomb's, 72 N
        true = {"coulomb_plus_n": 20.0, "coulomb_minus_n": 20.0, "viscous_plus_n_s_m": 200.0}
        friction = friction.model_copy(update=true)
    for name in ("coulomb_plus_n", "coulomb_minus_n", "viscous_plus_n_s_m"):
        assert getattr(now.friction, name) == pytest.approx(getattr(friction, name), rel=0.02)


def test_a_robot_says_what_it_believes_about_itself() -> None:
    run = read_robot(SAMPLES / "robot")
    assert run.machine.vertical_cylinder.bore_m > 0.0
    assert len(run.data["t"]) == 60


@pytest.mark.long
def test_a_rig_is_diagnosed(tmp_path: Path) -> None:
    done = diagnose_folder(SAMPLES / "leg", tmp_path / "out", Wanted())
    assert done.tree["verdict"] == "none"
    assert read_believed(tmp_path / "out" / "model.yaml").rig == "vertical-leg"
