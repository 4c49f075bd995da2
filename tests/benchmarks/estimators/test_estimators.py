"""The comparison of estimators: sums that add up to known marks, trials that differ as they say,
one short run.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from shipped import MACHINE

from testbed.benchmarks.estimators.benchmark import Estimators
from testbed.benchmarks.estimators.scores import (
    ALONE,
    FLOOR,
    WHOLE,
    _sums,
    marks,
    merged,
    scores,
)
from testbed.benchmarks.estimators.trials import CHOOSE, JUDGE, simulate
from testbed.benchmarks.harness import write
from testbed.errors import InputError
from testbed.estimation.live.uncertainty import Uncertainty
from testbed.scenario.scenario import load_scenario
from testbed.world.believed_robot import BelievedRobot


def test_marks_of_known_errors() -> None:
    error = np.array([[3.0, -4.0, 0.0, 100.0]])
    speed = np.array([[0.01, 0.01, 0.004, 0.0]])
    sums = _sums(error, speed, np.full((1, 4), 10.0))
    moving, rest = marks(sums["moving"]), marks(sums["rest"])
    assert moving["rmse_n"] == pytest.approx((25.0 / 3.0) ** 0.5) and moving[
        "bias_n"
    ] == pytest.approx(-1.0 / 3.0)
    assert (
        moving["covered"] == 1.0
        and rest["covered"] == 0.0
        and rest["width_n"] == pytest.approx(32.9)
    )
    assert marks(sums["slow"])["n"] == 1 and marks(sums["fast"])["n"] == 2
    both = marks(merged([sums, sums])["moving"])
    assert both["n"] == 6 and both["rmse_n"] == moving["rmse_n"] and both["p99_n"] == 5.0


def test_nothing_is_judged_on_what_was_chosen_on() -> None:
    assert not {t.seed for t in CHOOSE} & {t.seed for t in JUDGE}
    slopes = [
        {t.load().terrain.slope_deg for t in trials if t.kind != "walk"}
        for trials in (CHOOSE, JUDGE)
    ]
    assert not slopes[0] & slopes[1]
    assert {t.oil_degc for t in JUDGE} == {10.0, 25.0, 40.0, 50.0}
    friction = [t.load().hydraulics.parameters["vertical_cylinder.coulomb_out_n"] for t in JUDGE]
    assert 0.02 < np.std(friction) / MACHINE.vertical_cylinder.coulomb_out_n < 0.1


@pytest.mark.slow
def test_a_short_run_is_scored_and_written(tmp_path: Path) -> None:
    series = simulate(load_scenario("stand_slope_45", ["task={kind: sway}"], seed=5, duration=4.0))
    (tmp_path / "mine.py").write_text(
        "class Mine:\n    def update(self, row):\n        return row.estimate.two_chamber\n"
    )
    own = f"{tmp_path / 'mine.py'}:Mine"
    found = scores(series, BelievedRobot(MACHINE, sure=Uncertainty(None)), (own,))
    assert found[own] == found["two_chamber"]
    errors = {name: marks(found[name]["all"])["rmse_n"] or 0.0 for name in found}
    assert (
        errors[FLOOR]
        < errors[WHOLE]
        < errors[ALONE]
        < errors["two_chamber"]
        < errors["one_chamber"]
    )
    assert (marks(found[WHOLE]["tangential_all"])["rmse_n"] or 0.0) < 300.0
    kept = {"name": "a", "kind": "move", "oil_degc": 40.0, "scores": found}
    benchmark = Estimators()
    answer = benchmark.summarise({"a": kept})
    write(benchmark, answer, tmp_path)
    assert set(answer["groups"]) == {
        "all temperatures",
        "at the calibration's temperature",
        "move",
    }
    assert answer["targets"][0]["wanted"].startswith("load while moving")
    page = (tmp_path / "estimators.html").read_text()
    assert (
        own in page
        and "All runs, 10 to 50 °C" in page
        and f'<tr class="best"><td>{WHOLE}</td>' in page
    )


def test_the_few_are_one_run_of_each_kind() -> None:
    kinds = [trial.kind for trial in Estimators(few=True).cases().values()]
    assert len(kinds) == len(set(kinds)) == len({t.kind for t in Estimators().cases().values()})
    assert {trial.kind for trial in Estimators(kinds=("liar",)).cases().values()} == {"liar"}
    with pytest.raises(InputError, match="no such kind of run"):
        Estimators(kinds=("flying",))


def test_an_estimator_of_ones_own_has_to_be_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--estimator"):
        Estimators(own=(f"{tmp_path / 'mine.py'}:Mine",))
