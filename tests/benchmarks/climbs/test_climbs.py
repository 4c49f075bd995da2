"""The climbs' bookkeeping: what counts as good, what is run again, and a climb of a hand's
breadth.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from testbed.benchmarks.climbs import climbs as climbs_module
from testbed.benchmarks.climbs.climbs import CASES, Climb, Climbs, Outcome, climb_up, climbs, table
from testbed.benchmarks.harness import LINES, run
from testbed.errors import InputError
from testbed.scenario.tasks import Crawl

GOOD = Outcome("plane 45", 1, "stood", 10.01, 510.0, 102, 0.003, 0.13, 3200.0, 1.8e4, 0.7)

STILL = """
from testbed.control.gait import Command


class Still:
    def __init__(self, start):
        self.joints = start.joints.copy()

    def command(self, t, dt, measured):
        return Command(joints=self.joints)
"""


@pytest.mark.parametrize(
    "change",
    [{"verdict": "slid"}, {"way_m": 9.99}, {"slip_m": 0.05}, {"tilt_deg": 3.0}, {"goal_m": 11.0}],
)
def test_a_climb_is_good_that_stood_got_there_and_kept_every_limit(
    change: dict[str, object],
) -> None:
    assert GOOD.good and not replace(GOOD, **change).good  # type: ignore[arg-type]


def test_a_case_is_told_by_its_worst_run() -> None:
    (row,) = table([GOOD, replace(GOOD, seed=2, verdict="fell", way_m=4.0, slip_m=0.2)]).rows
    assert row[:8] == ["plane 45", "crawl", "1 of 2", "1", "4.00", "200.0", "0.13", "3200"]


def test_every_gait_has_a_row_and_what_it_does_not_say_is_a_dash() -> None:
    own = replace(GOOD, gait="mine.py:Mine", steps=None, least_planned_margin_n=None)
    rows = table([GOOD, own]).rows
    assert [row[1] for row in rows] == ["crawl", "mine.py:Mine"]
    assert rows[1][2] == "1 of 1" and rows[1][7] == rows[1][9] == "-"


def test_a_seed_has_one_effect_that_nobody_declared_in_all_of_its_cases() -> None:
    hidden = climbs(["plane 45", "aside 60"], 12, undeclared=True)
    lacking = {climb.seed: climb.scenario().undeclared for climb in hidden}
    assert all(climb.scenario().undeclared == lacking[climb.seed] for climb in hidden)
    assert all(len(effects) == 1 for effects in lacking.values())
    assert len({effects[0].effect for effects in lacking.values()}) > 4
    assert not climbs(["plane 45"], 1)[0].scenario().undeclared


@pytest.mark.slow
def test_a_gait_of_ones_own_climbs_beside_the_shipped_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mine.py").write_text(STILL)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(climbs_module, "LONG", ("task.steps=4", "duration_s=0.3"))
    short = Climbs(seeds=1, way_m=0.02, chosen=("plane 45",), own=("mine.py:Still",))
    shipped, own = run(short, tmp_path / "out")
    assert (shipped.gait, own.gait) == ("crawl", "mine.py:Still")
    assert own.verdict == "stood" and not own.good and own.steps is None


def test_a_gait_whose_file_is_another_is_run_again(tmp_path: Path) -> None:
    marks = []
    for name, text in (("one", STILL), ("other", STILL.replace("copy()", "copy() + 0.0"))):
        (tmp_path / name).mkdir()
        (tmp_path / name / "mine.py").write_text(text)
        gait = f"{tmp_path / name / 'mine.py'}:Still"
        benchmark = Climbs(seeds=1, chosen=("plane 45",), own=(gait,))
        mark = benchmark.made_from(benchmark.cases()[f"plane 45, seed 1, 10 m, {gait}"])
        marks.append(mark.replace(gait, ""))
    assert marks[0] != marks[1]


def test_seeds_differ_in_rock_and_friction_and_every_case_is_a_scenario() -> None:
    made = climbs(list(CASES), 2)
    assert len(made) == 2 * len(CASES) and [c.seed for c in made[: len(CASES)]] == [1] * len(CASES)
    frictions = {c.scenario().terrain.friction for c in made}
    assert len(frictions) == 2 and all(0.6 <= f <= 0.8 for f in frictions)
    rocks = {c.scenario().terrain.roughness_seed for c in made if c.case == "rough 60"}
    assert rocks == {1, 2}


def test_changes_are_made_in_every_climb_and_are_in_its_mark() -> None:
    plain, brisk = (
        Climbs(seeds=1, chosen=("plane 45",), overrides=changes)
        for changes in ((), ("task.gait=brisk",))
    )
    (one,), (other,) = plain.cases().values(), brisk.cases().values()
    assert (one.scenario().task.gait, other.scenario().task.gait) == ("flowing", "brisk")
    assert plain.made_from(one) != brisk.made_from(other)


@pytest.mark.slow
def test_a_climb_of_a_hands_breadth_is_good_and_is_not_run_again(tmp_path: Path) -> None:
    short = Climbs(seeds=1, way_m=0.02, chosen=("plane 45",))
    (found,) = run(short, tmp_path)
    assert found.verdict == "stood" and found.way_m >= 0.02 and found.good
    lines = (tmp_path / LINES).read_text()
    assert run(short, tmp_path) == [found]
    assert (tmp_path / LINES).read_text() == lines, "nothing was run"
    assert "| plane 45 | crawl | 1 of 1 | 0 |" in (tmp_path / "climbs.md").read_text()


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"chosen": ("plane 90",)}, "plane 85"),
        ({"own": ("nobody.py:Mine",)}, "no such file"),
        ({"first_seed": 0}, "--first-seed"),
        ({"seeds": 1, "first_seed": 2}, "--first-seed"),
        ({"overrides": ("task.gait=dance",)}, r"task\.gait"),
    ],
)
def test_cases_and_seeds_that_are_none_are_refused(options: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        Climbs(**options)


@pytest.mark.slow
def test_a_climb_that_control_would_not_begin_is_no_fall_and_not_good() -> None:
    refused = climb_up(Climb("plane 45", 1, ("ropes.azimuth_deg=25",)))
    assert refused.verdict.startswith("refused: ")
    assert not refused.good
    (row,) = table([refused, GOOD]).rows
    assert row[2:4] == ["1 of 2", "0"]


def test_a_shorter_stride_is_a_share_of_the_cases_own() -> None:
    (climb,) = climbs(["plane 45"], 1)
    whole, shorter = climb.scenario().task, climb.scenario(0.9).task
    assert isinstance(whole, Crawl) and isinstance(shorter, Crawl)
    assert shorter.step_length_m == pytest.approx(0.9 * whole.step_length_m)
    assert shorter.steps == whole.steps


@pytest.mark.slow
def test_a_machine_whose_ropes_lead_aside_climbs_with_the_stride_that_fits() -> None:
    (climb,) = climbs(["plane 30"], 3, first=3, draw="workshop")
    outcome = climb_up(climb, way_m=0.02)
    assert outcome.verdict == "stood" and outcome.stride_share < 1.0


@pytest.mark.slow
def test_a_foot_that_is_held_by_a_step_of_the_rock_rises_above_it() -> None:
    """Its leg lags at the very start of the swing, so the swing waited for it: for good."""
    (climb,) = climbs(["rough 45"], 63, 63, draw="workshop", further=("task.gait=brisk",))
    outcome = climb_up(climb, way_m=0.6)
    assert outcome.way_m >= 0.6
    assert outcome.time_s < 60.0
