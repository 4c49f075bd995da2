"""The robot weighs and calibrates itself: the programme, and what is found on a machine that nobody declared."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from testbed.control.gaits.commission import duration_s, program
from testbed.errors import InputError
from testbed.formats.yaml_files import read_mapping
from testbed.scenario.scenario import load_scenario
from testbed.scenario.tasks import Commission
from testbed.simulation.run import run_scenario
from testbed.workflows.commission import commission_any


def test_the_programme_lifts_every_foot_by_itself_and_ends_within_ten_minutes() -> None:
    keys = program(Commission(kind="commission"))
    lifted = [np.flatnonzero(~np.array(key.stance)).tolist() for key in keys]
    assert all(len(feet) <= 1 for feet in lifted)
    assert {foot for feet in lifted for foot in feet} == {0, 1, 2, 3}
    for key in keys:
        if all(key.stance):
            assert abs(sum(key.lift_m)) < 1e-12  # feet that carry are askew at most in pairs
    assert np.all(np.diff([key.t for key in keys]) >= 0.0)
    scenario = load_scenario("commissioning_flat")
    assert duration_s(scenario.task) < scenario.duration_s < 600.0


def test_a_recording_without_a_foot_in_the_air_is_refused(tmp_path: Path) -> None:
    run_scenario(load_scenario("stand_flat", duration=1.0), tmp_path / "run")
    with pytest.raises(InputError, match="shows no foot in the air"):
        commission_any(str(tmp_path / "run"), tmp_path / "model.yaml")
    assert not (tmp_path / "model.yaml").exists()
    with pytest.raises(InputError, match="would have no effect on a recording"):
        commission_any(str(tmp_path / "run"), tmp_path / "model.yaml", ["seed=3"])


@pytest.mark.slow
def test_a_drawn_machine_finds_its_weight_and_how_its_inertial_unit_is_mounted(
    tmp_path: Path,
) -> None:
    changes = ["machine.draw=workshop", "machine.seed=21"]
    run_scenario(load_scenario("commissioning_flat", changes), tmp_path / "run")
    found = commission_any(str(tmp_path / "run"), tmp_path / "model.yaml")
    truth = read_mapping(tmp_path / "run" / "truth_machine.yaml")["numbers"]
    assert set(found["numbers"]) <= set(truth)
    off_kg = found["numbers"]["total_mass_kg"]["value"] - truth["total_mass_kg"]["value"]
    assert abs(off_kg) < 0.01 * truth["total_mass_kg"]["value"]
    for name in ("robot.attitude@body.roll", "robot.attitude@body.pitch"):
        assert abs(found["numbers"][name]["value"] - truth[name]["value"]) < 2e-3
    assert "gains of pressure sensors" in found["not_shown"]
    load_scenario("stand_slope_45")
    assert read_mapping(tmp_path / "model.yaml")["rig"] == "robot"
