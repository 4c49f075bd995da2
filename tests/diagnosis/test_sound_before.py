"""What a recording from before, when nothing was wrong with the robot, adds to its diagnosis."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from testbed.benchmarks.diagnosis.robot_draws import drawn
from testbed.benchmarks.diagnosis.robot_recordings import simulated
from testbed.benchmarks.diagnosis.robot_trials import Asked, balances_in, before_of
from testbed.diagnosis.robot.diagnose import LONGEST_S, check_memory, judged
from testbed.errors import InputError
from testbed.recording.leg_model import Parameter
from testbed.recording.robot_model import RobotModelFile, write_robot_model
from testbed.workflows.diagnose import Before, Wanted, diagnose_folder, diagnose_recordings

FAINT = 10751
"""A run whose inertial unit is off by too little for a machine that knows its drawing alone."""


def test_before_anything_is_hidden_it_is_the_same_machine_at_the_same_place() -> None:
    case = drawn(FAINT)
    now = case.scenario()
    for before in case.before():
        assert not before.undeclared
        assert now.undeclared
        assert before.machine == now.machine
        assert before.terrain == now.terrain
        assert before.seed != now.seed


def test_a_rig_has_no_recording_from_before(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--sound"):
        diagnose_folder(tmp_path, tmp_path / "out", Wanted(sound=tmp_path))


def test_nothing_can_have_been_moved_since_no_recording(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--moved"):
        diagnose_folder(tmp_path, tmp_path / "out", Wanted(moved=True))


@pytest.mark.long
def test_a_recording_from_before_shows_a_faint_effect() -> None:
    case = drawn(FAINT)
    run, before = simulated(case.scenario()), before_of(case, Asked())
    alone, both = (judged("run", balances_in(run, known)).verdict for known in (None, before))
    (name,) = case.truth
    assert alone.kind == "none" and both.kind != "none"
    assert both.probability(name) > 0.2 > 5.0 * alone.probability(name)


def test_a_commissioned_model_and_a_recording_from_before_are_not_counted_twice(
    tmp_path: Path,
) -> None:
    model = tmp_path / "m.yaml"
    number = Parameter(value=0.0701, unit="m")
    write_robot_model(model, RobotModelFile(machine={"axes.fl_vertical.cylinder.bore_m": number}))
    run = cast(Any, SimpleNamespace(file=tmp_path / "recording.yaml"))
    with pytest.raises(InputError, match="twice"):
        diagnose_recordings([run], model, Before(run))


def test_recordings_too_long_to_be_weighed_together_are_refused(tmp_path: Path) -> None:
    """Their covariance would ask for tens of gigabytes."""
    check_memory([(LONGEST_S, tmp_path)])
    with pytest.raises(InputError, match="too long to be weighed: 160 s in all"):
        check_memory([(100.0, tmp_path), (60.0, tmp_path)])
