"""What a run is said to have come to: verdict, wrong leg-seconds, fields that are all described."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import testbed
from testbed.errors import SimulationFault
from testbed.estimation.contact_losses import LossRule
from testbed.machine.names import LEGS
from testbed.machine.scale import Scale
from testbed.report.console import run_status
from testbed.scenario.scenario import load_scenario
from testbed.simulation import metrics
from testbed.simulation.run import run_scenario
from testbed.simulation.run_summary import Ending

DOCS = Path(__file__).parents[2] / "docs"
PACKAGE = Path(testbed.__file__).parent


def described() -> set[str]:
    """Fields, dotted, that the page of verdicts has a row for."""
    return set(re.findall(r"^\| `([\w.]+)` \|", (DOCS / "verdicts.md").read_text(), re.MULTILINE))


def quantities() -> list[str]:
    """Those of them that have a unit."""
    rows = re.findall(
        r"^\| `([\w.]+)` \| (\S+) \|", (DOCS / "verdicts.md").read_text(), re.MULTILINE
    )
    return [name for name, unit in rows if unit != "|"]


def undescribed(summary: dict[str, Any]) -> list[str]:
    """Fields of a summary, dotted, that the page lacks; what stands below a field that has no rows
    of its own goes by its meaning.
    """
    fields = described()
    found = [name for name in summary if name not in fields]
    for name, part in summary.items():
        if isinstance(part, dict) and any(field.startswith(f"{name}.") for field in fields):
            found += [f"{name}.{key}" for key in part if f"{name}.{key}" not in fields]
    return found


def _columns(lost_s: float, carrying: float = 1.0) -> tuple[dict[str, Any], dict[str, Any]]:
    """Ten seconds in which `rr` bears nothing for `lost_s`, and no word ever says so."""
    t = np.arange(10_000) / 1000.0
    data: dict[str, Any] = {"t": t}
    truth: dict[str, Any] = {"t": t}
    for leg in LEGS:
        truth[f"contact_normal_{leg}"] = np.full(len(t), 9000.0)
        data[f"carrying_{leg}"] = np.ones(len(t))
        data[f"contact_{leg}"] = np.ones(len(t))
    truth["contact_normal_rr"][t >= 10.0 - lost_s] = 0.0
    data["carrying_rr"][:] = carrying
    return data, truth


@pytest.mark.parametrize(
    ("lost_s", "carrying", "verdict"),
    [(4.9, 1.0, "stood"), (5.2, 1.0, "lost footing"), (5.2, 0.0, "stood")],
)
def test_a_foot_that_hangs_for_long_is_not_stood_on(
    lost_s: float, carrying: float, verdict: str
) -> None:
    data, truth = _columns(lost_s, carrying)
    longest_s, share = metrics.unloaded(data, truth)
    assert longest_s["fl"] == share["fl"] == 0.0
    figures = {"longest_unloaded_s": longest_s, "unloaded_share": share}
    assert Ending(0.0).verdict("stood", figures) == verdict
    assert Ending(0.0).verdict("slid", figures) == "slid"


@pytest.mark.parametrize(
    ("longest_s", "share", "verdict"),
    [(6.0, 0.4, "stood"), (6.0, 0.6, "lost footing"), (11.0, 0.1, "lost footing")],
)
def test_a_walk_may_hang_for_a_while(longest_s: float, share: float, verdict: str) -> None:
    figures = {"longest_unloaded_s": {"fl": longest_s}, "unloaded_share": {"fl": share}}
    assert Ending(0.0).verdict("stood", figures) == verdict


@pytest.mark.parametrize(
    ("bears", "off_s", "share", "verdict"),
    [
        ((0.0, 0.0), 9.999, 0.0, "off its feet"),  # lies all along
        ((9.0, 10.0), 0.0, 0.0, "stood"),  # lay for long, and was raised then
        ((0.0, 9.0), 1.0, 0.1, "off its feet"),  # was let down at last
        ((0.0, 10.0), 0.0, 0.0, "stood"),
    ],
)
def test_a_robot_that_lies_has_not_stood_and_is_not_meant_to_carry_yet(
    bears: tuple[float, float], off_s: float, share: float, verdict: str
) -> None:
    data, truth = _columns(0.0)
    begin, end = bears
    for leg in LEGS:
        truth[f"contact_normal_{leg}"][(truth["t"] < begin) | (truth["t"] >= end)] = 0.0
    longest_s, shares = metrics.unloaded(data, truth)
    found_s = metrics.off_its_feet_s(truth, metrics.LOSS_FORCE_N)
    assert found_s == pytest.approx(off_s, abs=2e-3)
    assert shares["fl"] == pytest.approx(share, abs=1e-3)
    figures = {
        "longest_unloaded_s": longest_s,
        "unloaded_share": shares,
        "off_its_feet_s": found_s,
    }
    assert Ending(0.0).verdict("stood", figures) == verdict
    assert Ending(0.0).verdict("fell", figures) == "fell"


def test_wrong_leg_seconds_are_counted_though_no_word_ever_changed() -> None:
    data, truth = _columns(2.0)
    data["contact_fl"][:] = 0.0  # wrong from the first row on
    scores = metrics.state_scores(data, truth, LossRule(10_000.0))
    summed = metrics.detector_summary([], scores, 1.0)
    assert summed["missed_s"] == pytest.approx(2.0, abs=2e-3)
    assert summed["false_flight_s"] == pytest.approx(10.0, abs=2e-3)


def test_a_fault_is_said_before_any_verdict() -> None:
    ending = Ending(0.0, fault=SimulationFault("72 GN"))
    assert ending.verdict("rope broke", {}) == "fault: 72 GN"


@pytest.mark.parametrize(
    ("mass_kg", "load_n"), [(4000.0, 1e4), (4120.0, 1e4), (8000.0, 2e4), (49.2, 120.0)]
)
def test_the_nominal_load_goes_with_the_mass_to_two_figures(mass_kg: float, load_n: float) -> None:
    assert Scale.of(mass_kg).nominal_load_n == pytest.approx(load_n)


@pytest.mark.parametrize(
    ("summary", "status"),
    [
        ({}, 0),
        ({"expectations": {"met": True, "unmet": []}}, 0),
        ({"expectations": {"met": False, "unmet": ["verdict"]}}, 3),
        ({"interrupted": True}, 130),
    ],
)
def test_the_exit_status_says_whether_expectations_were_met(
    summary: dict[str, Any], status: int
) -> None:
    assert run_status(summary) == status


OF_EACH_PROGRAM = ("hole_depth_m",)
"""Fields that each of the drill's programs says of itself; a run has one program."""


@cache
def _places() -> dict[str, set[str]]:
    """Key of a dictionary -> files in which one is given it, but for pages, tables and
    benchmarks.
    """
    found: dict[str, set[str]] = {}
    for room in ("estimation", "control", "world", "simulation"):
        for path in (PACKAGE / room).rglob("*.py"):
            if path.name == "sweep.py":
                continue
            for node in ast.walk(ast.parse(path.read_text())):
                for key in node.keys if isinstance(node, ast.Dict) else ():
                    if isinstance(key, ast.Constant):
                        found.setdefault(key.value, set()).add(path.relative_to(PACKAGE).as_posix())
    return found


@pytest.mark.parametrize("field", quantities())
def test_every_quantity_of_a_summary_is_worked_out_in_one_place(field: str) -> None:
    places = _places().get(field.rpartition(".")[2], set())
    if field in OF_EACH_PROGRAM:
        assert places == {"world/drilling/cycle.py", "world/drilling/drilling.py"}
    elif field not in ("events", "total_mass_kg"):
        assert len(places) == 1, places
    else:
        assert places  # words that other dictionaries have too


def test_a_quantity_that_two_places_work_out_is_a_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    from testbed.simulation import run_summary

    told = run_summary.world_summary
    more = {"tilt_max_deg": 0.0, "seed": 1}
    monkeypatch.setattr(run_summary, "world_summary", lambda simulation: told(simulation) | more)
    run = testbed.simulate(testbed.load_scenario("stand_flat", duration=0.05))
    run.step(50)
    with pytest.raises(AssertionError, match="are worked out in two places"):
        run.summary()


@pytest.mark.slow
def test_every_field_of_a_summary_is_described_and_an_unfinished_task_said() -> None:
    scenario = testbed.load_scenario("drill_deep", duration=0.5)
    with testbed.simulate(scenario) as run:
        run.step(500)
    summary = run.summary()
    assert undescribed(summary) == []
    assert not summary["progress"]["done"]
    assert summary["progress"]["hole_depth_wanted_m"] == scenario.task.depth_m
    assert {"verdict", "detector.missed_s"} <= described()


def _margins(name: str, *changes: str) -> float:
    """Lowest wrench margin of a run of 1.2 s, N."""
    with testbed.simulate(testbed.load_scenario(name, list(changes), seed=1, duration=1.2)) as run:
        while not run.finished:
            run.step(400)
        return float(run.summary()["lowest_wrench_margin_n"])


@pytest.mark.slow
def test_margins_reckon_with_the_friction_that_is_there() -> None:
    """Rain, or a patch under every foot, leaves what a slope of that friction has."""
    slippery = "terrain.friction=0.2"
    rain = "events=[{kind: set_friction, at_s: 0.4, friction: 0.2}]"
    ice = "terrain.patches=[{radius_m: 9, friction: 0.2}]"
    dry, *wet = (_margins("stand_slope_45", change) for change in ("seed=1", slippery, rain, ice))
    assert wet == pytest.approx(3 * [wet[0]], rel=0.05)
    assert dry > 2.0 * wet[0]


@pytest.mark.slow
def test_margins_reckon_with_all_that_the_machine_carries() -> None:
    """The smallest push that is too much grows with a load in its middle, whoever knows of it."""
    store = "{effect: robot.payload, at: body, parameters: {mass: 1000, x: 0, y: 0, z: 0}}"
    put_on = "events=[{kind: payload, at_s: 0, mass_kg: 1000}]"
    light, declared, event, hidden = (
        _margins("stand_flat", change)
        for change in ("seed=1", "robot.payload_kg=1000", put_on, f"undeclared=[{store}]")
    )
    assert declared == pytest.approx(1.25 * light, rel=0.01)
    assert event == pytest.approx(declared, rel=0.03)
    assert hidden == pytest.approx(declared, rel=0.01)


def test_a_run_of_one_row_has_every_figure_that_others_read(tmp_path: Path) -> None:
    brief = load_scenario("stand_flat", ["rates.record_hz=100"], duration=0.005)
    summary = run_scenario(brief, tmp_path / "run").summary
    assert set(summary["force_rms_n"]) >= {"one_chamber", "two_chamber", "friction", "own"}
    assert all(np.isfinite(error) for error in summary["force_rms_n"].values())
    assert summary["contact_loss_events"] == [] and summary["detector"]["losses"] == 0
    assert summary["lowest_stability_margin"] > 0.0
