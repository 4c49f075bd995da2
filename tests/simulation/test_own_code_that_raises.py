"""What a class of the user's own raises, or answers wrongly, in any of the sockets is theirs: their
file, the line, exit status 2.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from testbed.cli import main
from testbed.errors import InputError, UserCodeError
from testbed.formats.sockets import user_code
from testbed.scenario.scenario import load_scenario
from testbed.simulation.live_run import simulate
from testbed.world.simulation import Simulation

MINE = {
    "controller": "class Mine:\n    def plan(self, now):\n        return {answer}\n",
    "detector": (
        "class Mine:\n    threshold = 0.5\n    def update(self, sample):\n        return {answer}\n"
    ),
    "estimator": (
        "class Mine:\n    def start(self, dt):\n        pass\n"
        "    def update(self, row):\n        return {answer}\n"
    ),
}
LINE = {"controller": 3, "detector": 4, "estimator": 5}
LIVE = {
    "controller": "control.distribution={}",
    "detector": "estimator.detector={}",
    "estimator": "estimator.method={}",
}
"""What a scenario says to have it follow the class."""


def _file(folder: Path, socket: str, answer: str = "[][7]") -> str:
    (folder / "mine.py").write_text(MINE[socket].format(answer=answer))
    return f"{folder / 'mine.py'}:Mine"


def _live(name: str, socket: str) -> None:
    simulation = Simulation(load_scenario("stand_slope_45", [LIVE[socket].format(name)]))
    try:
        simulation.run_steps(30)
    finally:
        simulation.close()


@pytest.mark.parametrize("socket", MINE)
def test_in_a_run_that_follows_it(tmp_path: Path, socket: str) -> None:
    with (
        pytest.raises(UserCodeError, match=rf"mine\.py: line {LINE[socket]} .* IndexError"),
        user_code(),
    ):
        _live(_file(tmp_path, socket), socket)


@pytest.mark.parametrize("socket", ["detector", "estimator"])
def test_where_it_rides_along(tmp_path: Path, socket: str) -> None:
    riding = {f"{socket}s": [_file(tmp_path, socket)]}
    with (
        pytest.raises(UserCodeError, match=rf"mine\.py: line {LINE[socket]} .* IndexError"),
        simulate(load_scenario("stand_slope_45"), **riding) as run,  # type: ignore[arg-type]
    ):
        run.step(30)


@pytest.mark.parametrize("socket", MINE)
@pytest.mark.parametrize("answer", ["None", "'a word'", "[1.0, 2.0]", "float('nan')"])
def test_an_answer_that_is_none_is_refused_by_the_name_of_what_gave_it(
    tmp_path: Path, socket: str, answer: str
) -> None:
    with pytest.raises(InputError, match=r"Mine|mine\.py") as error, user_code():
        _live(_file(tmp_path, socket, answer), socket)
    assert "\n" not in str(error.value)


def test_the_command_says_so_in_one_line_with_status_2(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    own = LIVE["controller"].format(_file(tmp_path, "controller"))
    out = ["--out", str(tmp_path / "run"), "--duration", "0.1"]
    monkeypatch.setattr(sys, "argv", ["testbed", "run", "stand_slope_45", "--set", own, *out])
    with pytest.raises(SystemExit) as end:
        main()
    told = capsys.readouterr().err.splitlines()
    assert end.value.code == 2
    assert [line for line in told if "mine.py: line 3 of your own file raised IndexError" in line]
    assert len([line for line in told if line.startswith("testbed:")]) == 1
