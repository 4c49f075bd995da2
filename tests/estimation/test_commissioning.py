"""The robot weighs and calibrates itself: the programme, and what is found on a machine that nobody
declared.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import completed

from testbed.errors import InputError
from testbed.estimation.commissioning import Number, Weighed
from testbed.estimation.live.uncertainty import constants
from testbed.formats.table import read_columns
from testbed.formats.yaml_files import read_mapping
from testbed.machine.build import build_machine
from testbed.machine.names import AXES, LEGS
from testbed.recording.robot_model import write_robot_model
from testbed.scenario.scenario import load_scenario
from testbed.simulation.run import run_scenario
from testbed.workflows.commission import believed, commission_any
from testbed.world.believed_robot import believed_robot


@pytest.mark.slow
def test_a_recording_without_a_foot_in_the_air_is_refused(tmp_path: Path) -> None:
    run_scenario(load_scenario("stand_flat", duration=5.0), tmp_path / "run")
    with pytest.raises(InputError, match="shows no foot in the air"):
        commission_any([str(tmp_path / "run")], tmp_path / "model.yaml")
    assert not (tmp_path / "model.yaml").exists()
    with pytest.raises(InputError, match="would have no effect on a recording"):
        commission_any([str(tmp_path / "run")], tmp_path / "model.yaml", ["seed=3"])


def test_what_was_found_is_believed_with_its_interval(tmp_path: Path) -> None:
    machine = build_machine()
    zeros = {f"{leg}_vertical": Number(50.0, "N", 20.0) for leg in LEGS}
    whole = {"total_mass_kg": Number(4100.0, "kg", 10.0)}
    whole |= {f"centre_of_mass_{k}_m": Number(0.0, "m", 0.005) for k in "xyz"}
    side = {"axes.fl_vertical.seal.side_load_coefficient": Number(0.2, "1", 0.03)}
    found = Weighed(whole | side, 100.0, np.array([10.0, 0.0, 0.0]), zeros)
    write_robot_model(tmp_path / "model.yaml", believed(found, machine, 280.0))
    own = believed_robot(machine, tmp_path / "model.yaml")
    known = constants(own.sure, own.expected)[0]
    fl, fr = AXES.index("fl_vertical"), AXES.index("fr_vertical")
    axis = machine.axes["fl_vertical"]
    sensors = axis.sensor.pressure_accuracy_pa * np.hypot(*axis.cylinder.areas_m2)
    assert known["zero"][fl] == pytest.approx(np.hypot(20.0, sensors), rel=1e-3)
    assert known["side"][fl] == pytest.approx(0.03, rel=1e-3)
    assert known["side"][fr] == pytest.approx(0.2 / 12.0**0.5)
    assert known["mass"] == pytest.approx(np.hypot(10.0, 2.5 / 6.0**0.5 * 12.0**0.5), rel=1e-3)
    legs = own.legs(1e-3).legs
    area = legs[0].area_a_m2
    assert legs[0].zero_a_pa * area == pytest.approx(50.0)
    assert own.of_body is not None and own.of_body.body_masses[0].mass_kg == 100.0


def test_an_effect_of_which_one_number_was_shown_is_believed_whole() -> None:
    """A model file's effect has all its parameters, those that were not shown as known before."""
    body = {"total_mass_kg": Number(4100.0, "kg", 10.0)}
    body |= {f"centre_of_mass_{k}_m": Number(0.0, "m", 0.005) for k in "xyz"}
    left, right = "rope.direction@rope_left", "rope.direction@rope_right"
    ropes = {
        f"{left}.azimuth": Number(0.01, "rad", 0.001, (0.0, 0.007)),
        f"{left}.elevation": Number(0.002, "rad", 0.007, (0.0, 0.007)),
        f"{right}.azimuth": Number(0.002, "rad", 0.007, (0.0, 0.007)),
        f"{right}.elevation": Number(0.002, "rad", 0.007, (0.0, 0.007)),
    }
    file = believed(Weighed(body | ropes, 100.0, np.zeros(3), {}), build_machine(), 280.0)
    directions = {e.place: set(e.parameters) for e in file.effects if e.name == "rope.direction"}
    assert directions == {"rope_left": {"azimuth", "elevation"}}


@pytest.mark.long
def test_from_the_command_line_a_drawn_machine_finds_itself_and_stands_better_for_it(
    tmp_path: Path,
) -> None:
    """Commission, estimate with what was found, run with it; every number beside the truth."""
    model, drawn = (
        tmp_path / "model.yaml",
        ["--set", "machine.draw=workshop", "--set", "machine.seed=22"],
    )
    run = tmp_path / "run"
    found = _testbed(
        "commission", "commissioning_flat", "--out", model, "--seed", "21", "--json", *drawn
    )
    assert found["simulated_s"] < 600.0
    assert "rope directions" not in found["not_shown"]
    assert (tmp_path / "model.html").is_file()
    _testbed("run", "stand_slope_45", "--out", run, "--duration", "10", "--json", *drawn)
    truth = read_mapping(run / "truth_machine.yaml")["numbers"]
    assert set(found["numbers"]) <= set(truth)
    off_kg = found["numbers"]["total_mass_kg"]["value"] - truth["total_mass_kg"]["value"]
    assert abs(off_kg) < 0.01 * truth["total_mass_kg"]["value"]
    for name in ("robot.attitude@body.roll", "robot.attitude@body.pitch"):
        assert abs(found["numbers"][name]["value"] - truth[name]["value"]) < 2e-3
    _testbed("estimate", run, "--model", model, "--out", tmp_path / "forces.parquet", "--json")
    file = tmp_path / "forces.parquet"
    forces = read_columns(file, {"t": "t", "force_fl_n": "load"}, declared_in=file)
    assert len(forces["t"]) == 10_000 and np.isfinite(forces["force_fl_n"]).all()
    again = _testbed(
        "run", "stand_slope_45", "--model", model, "--out", tmp_path / "again", "--json", *drawn
    )
    assert again["verdict"] == "stood"


def _testbed(*arguments: object) -> dict[str, Any]:
    """What a command prints as JSON."""
    answer: dict[str, Any] = json.loads(completed(*map(str, arguments), check=True).stdout)
    return answer
