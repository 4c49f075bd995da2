"""A run that is saved and restored, into itself, from a file or into a branch, goes on to the last
bit.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import testbed
from testbed.cli import main
from testbed.errors import InputError
from testbed.simulation.run import Beginning, run_scenario
from testbed.world.saved import State, read_state

AT, MORE = 300, 150
"""Steps until the run is saved, and after it."""
CASES = {
    "drill": ["drill_slope_45", "task.start_s=0.1", "control.supervisor=true"],
    "distribution": ["drill_slope_45", "task.start_s=0.1", "control.distribution=qp"],
    "loose": ["loose_ground"],
    "rough": ["crawl_rough_45", "task.start_s=0.05"],
    "lying": [
        "stand_slope_45",
        "robot.vertical_m=0",
        "terrain.slope_deg=20",
        "ropes.enabled=false",
        "events=[{kind: set_friction, at_s: 0.1, friction: 0.3}]",
    ],
    "brisk": ["crawl_slope_45", "task.gait=brisk", "task.start_s=0.05"],
    "detector": ["stand_slope_45", "estimator.detector=glr", "machine.draw=workshop"],
}


def _scenario(case: str, steps: int = AT + MORE) -> Any:
    name, *changes = CASES[case]
    return testbed.load_scenario(name, changes, seed=5, duration=steps * 1e-3)


def _last(run: testbed.Run) -> bytes:
    """What the run recorded since it was saved, truth included."""
    return bytes(run.rows.table[-MORE:].tobytes() + run.truth.table[-MORE:].tobytes())


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_a_restored_run_goes_on_to_the_last_bit(case: str, tmp_path: Path) -> None:
    with testbed.simulate(_scenario(case)) as run:
        run.step(AT)
        state = run.save()
        file = state.write(tmp_path / "state.npz")
        with run.branch() as branch:
            branch.step(MORE)
            twin = _last(branch)
        run.step(MORE)
        went, events = _last(run), list(run.events)
        run.restore(state)
        assert run.t_s == pytest.approx(AT * 1e-3)
        run.step(MORE)
        assert _last(run) == went
        assert run.events == events
    assert twin == went
    with testbed.simulate(_scenario(case, 2 * AT)) as other:  # longer: it would go on
        other.restore(file)
        other.step(MORE)
        assert _last(other) == went
        assert not other.finished


@pytest.fixture(scope="module")
def saved() -> tuple[testbed.Run, State]:
    run = testbed.simulate(_scenario("drill"))
    run.step(50)
    return run, run.save()


@pytest.mark.slow
def test_a_state_belongs_to_its_scenario_and_model(saved: tuple[testbed.Run, State]) -> None:
    other = testbed.load_scenario("stand_slope_45", seed=5, duration=1.0)
    with testbed.simulate(other) as run, pytest.raises(InputError, match=r"differs in .*task"):
        run.restore(saved[1])


@pytest.mark.slow
def test_branches_differ_by_seed_and_by_what_happens(saved: tuple[testbed.Run, State]) -> None:
    run, _ = saved
    tables = []
    for seed, cut in ((None, False), (1, False), (1, True)):
        with run.branch(seed) as branch:
            if cut:
                branch.happen("cut_rope", rope="left")
            branch.step(30)
            tables.append((branch.rows["pressure_a"][-1], branch.truth["rope_force_in_world"][-1]))
    assert not np.array_equal(tables[0][0], tables[1][0]), "the same noise"
    assert tables[1][1][0].any()
    assert not tables[2][1][0].any(), "the rope still pulls"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "fields", "match"),
    [
        ("lift_foot", {"leg": "fl"}, "carried out by the task"),
        ("stop", {"duration_s": 1.0}, "carried out by the task"),
        ("turn", {"heading_deg": 20.0}, "carried out by the task"),
        ("cut_rope", {"rope": "left", "at_s": 9.0}, "happens now"),
        ("payload", {"mass_kg": -1000.0}, "more mass off the rod store than it has"),
        ("cut_rope", {"rope": "middle"}, "rope"),
        ("explode", {}, "unknown kind"),
    ],
)
def test_what_cannot_happen_now_is_refused(
    saved: tuple[testbed.Run, State], kind: str, fields: dict[str, Any], match: str
) -> None:
    before = list(saved[0].events)
    with pytest.raises(InputError, match=match):
        saved[0].happen(kind, **fields)
    assert saved[0].events == before, "told of what has not happened"


@pytest.mark.slow
def test_no_run_goes_on_from_beyond_its_end_and_nothing_is_written(
    saved: tuple[testbed.Run, State], tmp_path: Path
) -> None:
    ended = _scenario("drill", 40)
    with pytest.raises(InputError, match=r"duration_s = 0\.04: is over at the state's 0\.05 s"):
        run_scenario(ended, tmp_path / "on", beginning=Beginning(saved[1]))
    assert not (tmp_path / "on").exists()


def test_a_state_from_after_the_end_is_refused_with_how_it_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "state.npz"
    monkeypatch.setattr("sys.argv", ["testbed", "save", "slide", "--at", "8", "--out", str(file)])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2 and "--at = 8.0: slid at 0.5 s" in capsys.readouterr().err
    assert not file.exists()


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 broken", b"\x93NUMPY"])
def test_a_file_that_is_no_state_is_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "state.npz"
    path.write_bytes(content)
    with pytest.raises(InputError, match="is no saved state"):
        read_state(path)


def test_a_state_is_read_without_pickle(tmp_path: Path) -> None:
    path = tmp_path / "state.npz"
    np.savez(path, head=np.array([{"format": "x"}], dtype=object))
    with pytest.raises(InputError, match="is no saved state"):
        read_state(path)
