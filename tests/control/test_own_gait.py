"""A gait of the user's own: found, made from the start, looked at, live and over a recording."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from walking_machine import START, believed_start, scenario

from testbed.control.gait import Measured
from testbed.control.gaits.table import checked_gait
from testbed.errors import InputError, UserCodeError
from testbed.recording.rows import DataRow
from testbed.scenario.scenario import load_scenario
from testbed.simulation.replay import replay
from testbed.world.simulation import Simulation

HEAD = "import numpy as np\nfrom testbed.control.gait import Command\n"
MINE = (
    HEAD + "class Mine:\n    def __init__(self, start):\n        self.start = start\n"
    "    def command(self, t, dt, measured):\n        return {}\n"
)
HELD = "Command(self.start.joints)"
SCENARIO = "format: roboclimber-scenario/1\nname: mine\ntask: {kind: program, file: mine.py:Mine}\n"


def _made(folder: Path, answer: str = HELD, text: str = MINE) -> Path:
    file = folder / "mine.py"
    file.write_text(text.format(answer))
    return file


def test_a_gait_is_made_from_the_start_that_it_stands_at(tmp_path: Path) -> None:
    gait = checked_gait(f"{_made(tmp_path)}:Mine", believed_start(scenario()))
    command = gait.command(0.0, 0.01, Measured.of())
    assert command.joints == pytest.approx(START) and command.stance.all()


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        ("self.start.joints", "command = 'ndarray': returned a command .* .allowed: a Command"),
        ("Command(np.zeros(11))", r"joints = \(11,\): .* .allowed: \(12,\)"),
        ("Command(np.full(12, np.nan))", "joints = .*nan.* .allowed: finite numbers"),
        ("Command(self.start.joints, stance=np.ones(3))", r"stance = \(3,\): .* .allowed: \(4,\)"),
    ],
)
def test_what_cannot_be_followed_is_refused(tmp_path: Path, answer: str, said: str) -> None:
    gait = checked_gait(f"{_made(tmp_path, answer)}:Mine", believed_start(scenario()))
    with pytest.raises(InputError, match=said):
        gait.command(0.0, 0.01, Measured.of())


def test_a_gait_that_is_not_made_from_a_start_is_refused(tmp_path: Path) -> None:
    file = _made(tmp_path, text=MINE.replace("self, start", "self, start, more"))
    with pytest.raises(InputError, match=r"cannot be made: .*'more'.* takes BelievedStart"):
        checked_gait(f"{file}:Mine", believed_start(scenario()))


def test_a_relative_file_is_looked_for_beside_the_scenario_and_then_in_the_working_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    beside, here = tmp_path / "beside", tmp_path / "here"
    for folder in (beside, here):
        folder.mkdir()
        _made(folder)
    (beside / "mine.yaml").write_text(SCENARIO)
    monkeypatch.chdir(here)
    found = load_scenario(beside / "mine.yaml", ["control.distribution=mine.py:Mine"])
    assert found.task.model_dump()["file"] == f"{beside.resolve()}/mine.py:Mine"
    assert found.control.distribution == f"{beside.resolve()}/mine.py:Mine"
    (beside / "mine.py").unlink()
    found = load_scenario(beside / "mine.yaml")
    assert found.task.model_dump()["file"] == f"{here.resolve()}/mine.py:Mine"
    (here / "mine.py").unlink()
    with pytest.raises(InputError, match=r"mine\.py: task\.file = 'mine\.py:Mine': no such file"):
        load_scenario(beside / "mine.yaml")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("task.file=mine", "task.file = 'mine': no such name .allowed: FILE.py:Class"),
        ("control.distribution=drills", "did you mean 'drill'"),
        ("events=[{kind: lift_foot, at_s: 1, leg: fl}]", "moves what the task program moves"),
    ],
)
def test_a_scenario_that_names_no_class_is_refused(tmp_path: Path, change: str, said: str) -> None:
    _made(tmp_path)
    (tmp_path / "mine.yaml").write_text(SCENARIO)
    with pytest.raises(InputError, match=said):
        load_scenario(tmp_path / "mine.yaml", [change])


def test_what_a_gait_raises_in_a_run_is_its_own(tmp_path: Path) -> None:
    from testbed.world.simulation import Simulation

    _made(tmp_path, "Command(self.start.joints) if t < 0.05 else 1 / 0")
    (tmp_path / "mine.yaml").write_text(SCENARIO)
    simulation = Simulation(load_scenario(tmp_path / "mine.yaml"))
    try:
        with pytest.raises(UserCodeError, match=r"mine\.py: line 7 .* ZeroDivisionError"):
            simulation.run_block(200)
    finally:
        simulation.close()


def test_over_a_recording_a_gait_is_asked_at_every_tick(tmp_path: Path) -> None:
    answer = "Command(self.start.joints, stance=measured.load > 100.0, hold_drill=t > 0.025)"
    gait = checked_gait(f"{_made(tmp_path, answer)}:Mine", believed_start(scenario()))
    rows = DataRow.zeros(40)
    rows["t"] = 0.001 * np.arange(1, 41)
    rows["estimate"]["own"][:25] = 7000.0
    commands = replay(gait, rows)
    assert commands.t == pytest.approx([0.01, 0.02, 0.03, 0.04])
    assert commands.row.tolist() == [9, 19, 29, 39]
    assert commands.stance.all(axis=1).tolist() == [True, True, False, False]
    assert commands.hold_drill.tolist() == [False, False, True, True]
    assert commands.joints.shape == (4, 12) and commands.rope_rates_m_s.shape == (4, 2)


IN_PLACE = (
    HEAD
    + """
class Copies:
    def __init__(self, start):
        self.wanted = start.joints.copy()
        self.wanted[2::3] += 0.002

    def command(self, t, dt, measured):
        return Command(self.wanted)


class InPlace(Copies):
    def __init__(self, start):
        self.wanted = start.joints
        self.wanted[2::3] += 0.002
        start.load_n[:] = start.rope_tension_n[:] = 0.0
"""
)


def test_a_gait_may_change_in_place_what_start_it_was_handed(tmp_path: Path) -> None:
    """Its start is its own: the run is that of a gait which copied it first."""
    (tmp_path / "mine.py").write_text(IN_PLACE)
    rows = []
    for name in ("Copies", "InPlace"):
        text = SCENARIO.replace("Mine}", f"{name}}}") + "duration_s: 0.2\n"
        (tmp_path / "s.yaml").write_text(text)
        world = Simulation(load_scenario(tmp_path / "s.yaml"))
        rows.append(world.run_block(200)[0])
        world.close()
    np.testing.assert_array_equal(*rows)
