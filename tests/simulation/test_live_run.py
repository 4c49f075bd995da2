"""A run as an object: the same bits however it is stepped, with parts of the caller's own."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import testbed
from testbed.control.distribution.quadratic import Quadratic
from testbed.control.gait import Command
from testbed.errors import InputError, UserCodeError
from testbed.recording.rows import DataRow
from testbed.simulation.run import run_scenario

DURATION_S = 0.4


def _scenario(*changes: str) -> Any:
    return testbed.load_scenario(
        "drill_slope_45", ["task.start_s=0.1", *changes], seed=4, duration=DURATION_S
    )


def _stepped(run: testbed.Run, pieces: tuple[int, ...] = (1000,)) -> testbed.Run:
    """The run, stepped to its end in pieces of these sizes, over and over."""
    with run:
        turn = 0
        while not run.finished:
            run.step(pieces[turn % len(pieces)])
            turn += 1
    return run


@pytest.fixture(scope="module")
def whole() -> testbed.Run:
    return _stepped(testbed.simulate(_scenario()))


def test_a_run_stepped_in_pieces_is_the_run_at_one_go_to_the_last_bit(whole: testbed.Run) -> None:
    pieces = _stepped(testbed.simulate(_scenario()), (1, 7, 10, 93))
    assert np.array_equal(pieces.rows.table, whole.rows.table)
    assert np.array_equal(pieces.truth.table, whole.truth.table)


@pytest.mark.slow
def test_a_recorded_run_in_pieces_has_the_rows_and_figures_of_testbed_run(
    tmp_path: Path, whole: testbed.Run
) -> None:
    plain = run_scenario(_scenario(), tmp_path / "plain")
    _stepped(testbed.simulate(_scenario(), out=tmp_path / "pieces"), (1, 7, 10, 93))
    one, other = testbed.read_run(tmp_path / "plain"), testbed.read_run(tmp_path / "pieces")
    for name in one.data:
        assert np.array_equal(one.data[name], other.data[name]), name
    for name in one.truth:
        assert np.array_equal(one.truth[name], other.truth[name]), name
    in_memory = whole.rows.as_recorded()
    assert all(np.array_equal(one.data[name], in_memory[name]) for name in one.data)
    timeless = [{k: v for k, v in s.items() if k != "wall_s"} for s in _summaries(tmp_path, whole)]
    assert timeless[0] == timeless[1] == timeless[2]
    assert plain.summary["verdict"] == "stood"


def _summaries(folder: Path, run: testbed.Run) -> list[dict[str, Any]]:
    written = [json.loads((folder / n / "summary.json").read_text()) for n in ("plain", "pieces")]
    return [*written, json.loads(json.dumps(run.summary()))]


def test_a_step_is_a_physics_step_and_gives_the_rows_recorded_meanwhile() -> None:
    with testbed.simulate(_scenario("rates.record_hz=500")) as run:
        assert run.dt_s == pytest.approx(1e-3)
        assert len(run.step()) == 0  # every second step is recorded
        rows = run.step()
        assert len(rows) == 1 and rows["t"][0] == pytest.approx(2e-3)
        assert len(run.step(10)) == 5
        assert run.t_s == pytest.approx(12e-3) and len(run.rows) == 6


def test_rows_go_by_field_and_by_column(whole: testbed.Run) -> None:
    by_field = whole.rows["pressure_a"]
    assert by_field.shape == (400, 12)
    assert np.array_equal(by_field[:, 2], whole.rows["pressure_a_fl_vertical"])
    assert whole.rows.columns == tuple(DataRow.column_names())
    with pytest.raises(KeyError):
        whole.rows["nothing"]


def test_a_run_left_early_says_that_it_was_interrupted() -> None:
    with testbed.simulate(_scenario()) as run:
        run.step(50)
    assert run.interrupted and run.finished
    assert run.summary()["interrupted"] and run.summary()["simulated_s"] == pytest.approx(0.05)


def test_what_raises_in_the_callers_code_closes_the_run_and_is_its_fault(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError), testbed.simulate(_scenario(), out=tmp_path / "r") as run:
        run.step(50)
        raise ZeroDivisionError("mine")
    assert testbed.read_run(tmp_path / "r").summary["verdict"] == "fault: mine"


class Still:
    """A gait that holds the posture of the start."""

    def __init__(self, start: Any) -> None:
        self.joints = start.joints.copy()

    def command(self, t: float, dt: float, measured: Any) -> Command:
        return Command(joints=self.joints)


class Loads:
    """An estimator that says what the shipped one says."""

    def update(self, row: Any) -> Any:
        return row.estimate.own


class Never:
    """A detector that never speaks."""

    def update(self, sample: Any) -> Any:
        return np.zeros(4)


def test_an_own_gait_is_followed_as_class_object_or_file(tmp_path: Path) -> None:
    crawl = testbed.load_scenario("crawl_slope_30", duration=0.2)
    (tmp_path / "mine.py").write_text(
        "from testbed.control.gait import Command\n"
        "class Mine:\n"
        "    def __init__(self, start):\n        self.joints = start.joints.copy()\n"
        "    def command(self, t, dt, measured):\n        return Command(joints=self.joints)\n"
    )
    by_class = _stepped(testbed.simulate(crawl, gait=Still))
    assert np.ptp(by_class.rows["reference"], axis=0).max() == 0.0
    by_file = _stepped(testbed.simulate(crawl, gait=f"{tmp_path / 'mine.py'}:Mine"))
    assert np.array_equal(by_class.rows.table, by_file.rows.table)


def test_orders_that_an_own_gait_would_not_follow_are_refused() -> None:
    events = "events=[{kind: cut_rope, at_s: 0.1, rope: left}, {kind: lift_foot, at_s: 1, leg: fl}]"
    scenario = testbed.load_scenario("stand_slope_45", [events])
    with pytest.raises(
        InputError, match=r"events\.1 = 'lift_foot': is what a gait of your own does"
    ):
        testbed.simulate(scenario, gait=Still)


def test_an_own_controller_is_the_shipped_one_where_it_is_its_class() -> None:
    named = _stepped(testbed.simulate(_scenario("control.distribution=qp")))
    for given in ("qp", Quadratic, Quadratic()):
        own = _stepped(testbed.simulate(_scenario(), controller=given))
        assert np.array_equal(named.rows.table, own.rows.table)


def test_what_rides_along_sees_every_row_and_changes_nothing(whole: testbed.Run) -> None:
    riding = {"detectors": ["cusum", Never], "estimators": [Loads()]}
    run = _stepped(testbed.simulate(_scenario(), **riding), (30,))
    assert np.array_equal(run.rows.table, whole.rows.table)
    assert run.scores["cusum"].shape == run.scores["Never"].shape == (400, 4)
    assert np.array_equal(run.loads["Loads"], run.rows["estimate"]["own"])


def test_what_cannot_be_used_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    for wrong in (
        {"detectors": ["nobody"]},
        {"detectors": [Never, Never]},
        {"estimators": ["nobody"]},
        {"controller": "nobody"},
        {"gait": "nobody.py:Mine"},
    ):
        with pytest.raises(InputError):
            testbed.simulate(_scenario(), out=tmp_path / "out", **wrong)
    assert not (tmp_path / "out").exists()


def test_what_a_file_of_the_user_raises_is_said_to_be_his(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("class Mine:\n    def update(self, row):\n        1 / 0\n")
    run = testbed.simulate(_scenario(), estimators=[f"{tmp_path / 'mine.py'}:Mine"])
    with pytest.raises(UserCodeError, match=r"mine\.py"), run:
        run.step(10)


def test_the_front_door_opens_without_its_rooms() -> None:
    heavy = "numba", "numpy", "pinocchio", "pybullet", "scipy", "pydantic"
    code = f"import sys, testbed; dir(testbed); print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
    assert all(getattr(testbed, name) is not None for name in testbed.__all__)
    with pytest.raises(AttributeError):
        testbed.nothing  # noqa: B018


def test_environments_go_by_id_and_by_short_name() -> None:
    for name in ("drill", "Roboclimber/Drill-v0"):
        env = testbed.make_env(name, duration_s=1.0)
        assert env.spec.id == "Roboclimber/Drill-v0"
        env.close()
    with pytest.raises(InputError, match="force-distribution"):
        testbed.make_env("nothing")
