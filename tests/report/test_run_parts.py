"""Which pictures a run's report has, by the columns that were recorded; nothing is drawn here."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from shipped import MACHINE
from synthetic_run import write_synthetic_run

from testbed.machine.names import LEGS
from testbed.report.run_parts import NO_FEET, Shown, parts, shown
from testbed.robot.robot import Robot
from testbed.simulation.runs import read_run


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Shown:
    folder: Path = write_synthetic_run(tmp_path_factory.mktemp("runs") / "run", 5.0)
    read = read_run(folder)
    return shown((read.data, read.truth), {}, Robot.of(MACHINE), None, None)


def titles(run: Shown) -> list[str]:
    return [part.title for part in parts(run)]


def without(run: Shown, *gone: str) -> Shown:
    return replace(run, data={name: v for name, v in run.data.items() if not name.startswith(gone)})


def test_foot_loads_come_first_and_every_title_once(run: Shown) -> None:
    found = titles(run)
    assert found[0] == "Foot loads" and len(set(found)) == len(found)


@pytest.mark.parametrize(
    ("gone", "title"),
    [
        ("estimate_", "Errors of the estimates"),
        ("expected_", "Expected minus estimated"),
    ],
)
def test_a_picture_whose_columns_were_not_recorded_is_left_out(
    run: Shown, gone: str, title: str
) -> None:
    assert title in titles(run)
    left = titles(without(run, gone))
    assert title not in left and left[0] == "Foot loads"


def test_how_sure_an_estimate_is_needs_its_interval_at_every_foot(run: Shown) -> None:
    title = "How sure the estimate is"
    lows = {f"own_low_{leg}": run.data["t"] for leg in LEGS}
    assert title not in titles(run)
    assert title in titles(replace(run, data={**run.data, **lows}))
    lows.pop("own_low_rr")
    assert title not in titles(replace(run, data={**run.data, **lows}))


def test_a_short_run_is_close_up_as_it_is(run: Shown) -> None:
    assert "Foot loads, close up" in titles(run)
    data, truth = (
        {name: values[:200] for name, values in series.items()} for series in (run.data, run.truth)
    )
    assert "Foot loads, close up" not in titles(replace(run, data=data, truth=truth))


def test_a_lost_foot_is_judged_by_the_machines_own_weight(run: Shown) -> None:
    assert run.loss_n == pytest.approx(0.03 * MACHINE.scale.nominal_load_n)


def test_ropes_and_drill_are_shown_where_they_pull_or_push(run: Shown) -> None:
    assert "Ropes and drill" in titles(run)
    nothing = {name: 0.0 * run.truth[name] for name in NO_FEET}
    assert "Ropes and drill" not in titles(replace(run, truth={**run.truth, **nothing}))
