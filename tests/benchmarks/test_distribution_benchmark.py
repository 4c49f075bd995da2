"""The force-distribution benchmark: identical cases, honest counts, and the controllers' order."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from testbed.benchmarks.distribution.benchmark import benchmark, kept, mark, summarise, write
from testbed.benchmarks.distribution.cases import Case, Outcome, draw_cases
from testbed.benchmarks.distribution.compare import against_base
from testbed.benchmarks.distribution.run import breaks, count_losses, possible, run_case
from testbed.control.distribution.quadratic import Quadratic
from testbed.errors import InputError


def test_cases_do_not_depend_on_how_many_there_are() -> None:
    assert draw_cases(5) == draw_cases(9)[:5]
    assert len({case.overrides for case in draw_cases(50)}) == 50


def test_the_drawn_ranges_are_those_of_the_benchmark() -> None:
    specs = [case.scenario() for case in draw_cases(40)]
    assert all(
        30 <= s.terrain.slope_deg <= 80 and 0.455 <= s.terrain.friction <= 0.845 for s in specs
    )
    assert all(0 <= s.robot.payload_kg <= 4000 / 3 and abs(s.ropes.azimuth_deg) <= 6 for s in specs)
    assert 5 <= sum(bool(s.undeclared) for s in specs) <= 22


def test_a_loss_is_a_foot_without_load_for_twenty_milliseconds() -> None:
    load = np.full(1000, 5000.0)
    load[100:119] = 0.0  # 19 ms: a blow
    load[300:320] = 0.0
    load[900:] = 50.0  # lost for good, and at the end
    assert count_losses(load) == 2


def test_a_plan_is_judged_by_the_constraints_and_their_possibility_by_a_linear_program() -> None:
    from tests.control.test_distribution import _balance

    now, sharing = _balance(60.0, pull_n=17_000.0), Quadratic()
    c = sharing.constraints(now, 0.0)
    z = sharing.plan(now).forces / c.scale
    pulling = z.copy()
    pulling[0] = -0.1
    assert possible(c) and not breaks(z, c) and breaks(pulling, c)
    now.balance[:, 12:] = 0.0  # no ropes on 60 degrees
    assert not possible(sharing.constraints(now, 0.0))


def test_regret_is_friction_use_over_the_oracles() -> None:
    def outcome(name: str, use: float, losses: int) -> Outcome:
        return Outcome(name, use, 1000.0, losses, 0.001, 0.0, 0.0, 0.0, 10, 0, 1e-4, "stood")

    cases = draw_cases(2)
    rows = [
        [outcome("qp", 0.33, 1), outcome("oracle", 0.30, 0)],
        [outcome("qp", 0.44, 0), outcome("oracle", 0.40, 0)],
    ]
    table = {entry["name"]: entry for entry in summarise(cases, rows)["controllers"]}
    assert table["qp"]["friction_use_regret_median"] == pytest.approx(0.10)
    assert table["qp"]["losses_per_hour"] == pytest.approx(1 / 0.002)
    assert table["oracle"]["friction_use_regret_p95"] == 0.0


def test_savings_are_case_by_case_against_the_quadratic_program_with_an_interval() -> None:
    """Half the friction in every case saves 50 %, whatever the cases; the base itself has no row."""

    def outcome(name: str, use: float) -> Outcome:
        return Outcome(name, use, 1000.0, 0, 0.001, 0.0, 0.0, 0.0, 10, 0, 1e-4, "stood")

    cases = draw_cases(10, seeds=2)
    uses = np.linspace(0.1, 0.9, len(cases))
    found = against_base(cases, [[outcome("qp", use), outcome("half", use / 2)] for use in uses])
    assert set(found) == {"half"}
    for kind in ("undeclared", "none"):
        assert found["half"][kind]["interval95"] == pytest.approx([0.5, 0.5])
        assert set(found["half"][kind]["by_seed"]) == {0, 1}
    assert against_base(cases, [[outcome("half", use)] for use in uses]) == {}


def test_a_robot_that_slides_before_anything_is_planned_has_lost() -> None:
    poor = (
        "duration_s=6",
        "terrain.slope_deg=79",
        "terrain.friction=0.4",
        "ropes.share=0.92",
        "ropes.azimuth_deg=5.2",
    )
    found = run_case(Case(1, (*poor, "robot.payload_kg=730"), (0.0,) * 4), "qp")
    assert found.verdict == "slid" and found.losses == 1 and found.hours * 3600.0 < 1.0
    assert found.plans_checked == 0 and found.solve_p99_s == 0.0


def test_wrong_counts_and_folders_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="at least 1"):
        benchmark(0)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        write({}, tmp_path / "file")


@pytest.mark.slow
def test_sharing_by_force_uses_less_friction_than_holding_positions(tmp_path: Path) -> None:
    cases = tmp_path / "out" / "cases"
    result = benchmark(1, names=("position_hold", "qp"), folder=cases)
    assert (
        benchmark(1, names=("qp",), folder=cases)["runs"][0][0] == result["runs"][0][1]
    )  # kept, not run again
    path = write(result, tmp_path / "out")
    read = json.loads(path.read_text())
    lines = (tmp_path / "out" / "distribution.csv").read_text().splitlines()
    assert lines[0].startswith("set,case,slope_deg,") and [
        line.split(",")[6] for line in lines[1:]
    ] == [
        "position_hold",
        "qp",
        "oracle",
    ]
    table = {entry["name"]: entry for entry in read["controllers"]}
    assert read["cases"] == 1 and set(table) == {"position_hold", "qp", "oracle"}
    assert table["qp"]["friction_use_median"] < table["position_hold"]["friction_use_median"]
    assert table["qp"]["lowest_normal_force_n"] > table["position_hold"]["lowest_normal_force_n"]
    assert table["qp"]["infeasible"] == 0 and table["qp"]["plans_checked"] > 10


def test_a_finished_case_is_taken_over_and_one_of_other_sources_is_not(tmp_path: Path) -> None:
    outcome = Outcome("qp", 0.3, 1000.0, 0, 0.001, 0.0, 0.0, 0.0, 10, 0, 1e-4, "stood")
    file = tmp_path / f"{draw_cases(1)[0].key}.json"
    entry = {"mark": mark("qp"), "outcome": asdict(outcome)}
    file.write_text(json.dumps({"qp": entry, "oracle": entry}))
    assert kept(file, "qp") == outcome
    assert kept(file, "drill") is None and kept(tmp_path / "0001.json", "qp") is None
    file.write_text(json.dumps({"qp": entry | {"mark": "another"}}))
    assert kept(file, "qp") is None


def test_a_controllers_own_file_marks_its_runs(tmp_path: Path) -> None:
    marks, name = [], f"{tmp_path / 'mine.py'}:Mine"
    for weight in (1.0, 2.0):
        text = f"from testbed.control.distribution.quadratic import Quadratic\nclass Mine(Quadratic):\n    weight = {weight}\n"
        (tmp_path / "mine.py").write_text(text)
        mark.cache_clear()
        marks.append(mark(name))
    assert marks[0] != marks[1] and marks[0] != mark("qp")


@pytest.mark.slow
def test_the_same_case_gives_the_same_outcome() -> None:
    case = draw_cases(1)[0]
    first, again = run_case(case, "qp"), run_case(case, "qp")
    assert (first.friction_use, first.lowest_normal_n) == (
        again.friction_use,
        again.lowest_normal_n,
    )
