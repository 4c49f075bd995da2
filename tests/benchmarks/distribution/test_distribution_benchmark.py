"""The force-distribution benchmark: identical cases, honest counts, and the controllers' order."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from testbed.benchmarks.distribution.benchmark import ForceDistribution
from testbed.benchmarks.distribution.run import (
    Case,
    Outcome,
    breaks,
    count_losses,
    draw_cases,
    possible,
    run_case,
)
from testbed.benchmarks.distribution.summary import against_base, summarise
from testbed.benchmarks.harness import LINES, code, run
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
    """Half the friction in every case saves 50 %, whatever the cases; the base itself has no
    row.
    """

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


@pytest.mark.parametrize("options", [{"count": 0}, {"seeds": 0}, {"controllers": ("absent",)}])
def test_wrong_counts_and_controllers_are_refused(options: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=r"at least 1|absent"):
        ForceDistribution(**options)


@pytest.mark.slow
def test_sharing_by_force_uses_less_friction_than_holding_positions(tmp_path: Path) -> None:
    result = run(ForceDistribution(1, controllers=("position_hold", "qp")), tmp_path)
    made = (tmp_path / LINES).read_text()
    again = run(ForceDistribution(1, controllers=("qp",)), tmp_path)
    assert again["runs"][0][0] == result["runs"][0][1]
    assert (tmp_path / LINES).read_text() == made, "kept, not run again"
    table = {entry["name"]: entry for entry in result["controllers"]}
    assert result["cases"] == 1 and set(table) == {"position_hold", "qp", "oracle"}
    assert table["qp"]["friction_use_median"] < table["position_hold"]["friction_use_median"]
    assert table["qp"]["lowest_normal_force_n"] > table["position_hold"]["lowest_normal_force_n"]
    assert table["qp"]["infeasible"] == 0 and table["qp"]["plans_checked"] > 10
    written = json.loads((tmp_path / "distribution.json").read_text())
    assert [entry["name"] for entry in written["controllers"]] == ["qp", "oracle"]
    lines = (tmp_path / "distribution.csv").read_text().splitlines()
    assert lines[0].startswith("set,case,slope_deg,")
    assert [line.split(",")[6] for line in lines[1:]] == ["qp", "oracle"]


def test_a_controllers_own_file_marks_its_runs_and_no_other_ones(tmp_path: Path) -> None:
    name = f"{tmp_path / 'mine.py'}:Mine"
    marks = []
    for weight in (1.0, 2.0):
        base = "from testbed.control.distribution.quadratic import Quadratic\n"
        (tmp_path / "mine.py").write_text(f"{base}class Mine(Quadratic):\n    weight = {weight}\n")
        code.cache_clear()
        benchmark = ForceDistribution(1, controllers=(name, "qp"))
        marks.append([benchmark.mark(case) for case in benchmark.cases().values()])
    (mine, qp, oracle), (mine_later, qp_later, oracle_later) = marks
    assert mine != mine_later and (qp, oracle) == (qp_later, oracle_later) and mine != qp


@pytest.mark.slow
def test_the_same_case_gives_the_same_outcome() -> None:
    case = draw_cases(1)[0]
    first, again = run_case(case, "qp"), run_case(case, "qp")
    assert (first.friction_use, first.lowest_normal_n) == (
        again.friction_use,
        again.lowest_normal_n,
    )
