"""A drawn machine in its world: every tolerance changes what happens, and nothing that the robot
knows.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from perturbed import changes_recording

from testbed.formats.yaml_files import read_mapping
from testbed.machine.names import SIDES
from testbed.scenario import machines as drawn
from testbed.scenario.machines import Tolerance, tolerances
from testbed.scenario.scenario import load_scenario
from testbed.simulation.run import run_scenario

CHANGES = (
    "duration_s=1.0",
    "task={kind: sway, start_s: 0.0, amplitude_m: [0.05, 0.05, 0.05], period_s: [2, 2, 2]}",
    "ropes.sag=false",
)
DRAWN = ["machine.draw=workshop", "machine.seed=3"]


@pytest.mark.parametrize(
    "tolerance",
    [
        pytest.param(one, id=one.number, marks=[pytest.mark.slow] * (index % 6 > 0))
        for index, one in enumerate(tolerances("workshop"))
    ],
)
def test_every_tolerance_by_itself_changes_what_is_measured(
    tolerance: Tolerance, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = tolerance.number.rpartition(".")[0]
    group = tolerances("workshop") if "@" in place else (tolerance,)
    alone = [t.model_copy(update={"chance": 1.0}) for t in group if t.number.startswith(place)]
    monkeypatch.setattr(drawn, "tolerances", lambda _: alone)
    assert changes_recording(("stand_slope_45", CHANGES), *DRAWN, truth=False)


@pytest.mark.slow
def test_the_recording_says_the_same_of_a_drawn_machine_and_the_drawing(tmp_path: Path) -> None:
    short = ["duration_s=0.2"]
    for name, changes in (("drawn", DRAWN), ("plain", [])):
        run_scenario(load_scenario("stand_slope_45", [*short, *changes]), tmp_path / name)
    told = [read_mapping(tmp_path / name / "recording.yaml") for name in ("drawn", "plain")]
    surveyed = [header.pop("surveyed") for header in told]
    assert told[0] == told[1]
    assert [survey["tolerances"] for survey in surveyed] == ["workshop", None]
    for side in SIDES:  # surveyed from where the machine stands, which its hinges shift
        ropes = [survey["rope_directions_in_world"][side] for survey in surveyed]
        np.testing.assert_allclose(*ropes, atol=1e-3)
    assert not (tmp_path / "plain" / "truth_machine.yaml").exists()
    truth = read_mapping(tmp_path / "drawn" / "truth_machine.yaml")
    assert truth["seed"] == 3
    assert abs(truth["numbers"]["total_mass_kg"]["value"] - 4000.0) < 130.0
    shift_m = truth["numbers"]["robot.centre_of_mass@body.x"]["value"]
    assert 0.0 < abs(shift_m) < 0.055
