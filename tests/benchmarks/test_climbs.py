"""The climbs' bookkeeping: what counts as good, what is run again, and a climb of a hand's breadth."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from testbed.benchmarks.climbs.climbs import CASES, Outcome, climbs, evaluate, main, read, table

GOOD = Outcome("plane 45", 1, "stood", 10.01, 510.0, 102, 0.003, 0.13, 3200.0, 1.8e4, 0.7)


@pytest.mark.parametrize(
    "change",
    [{"verdict": "slid"}, {"way_m": 9.99}, {"slip_m": 0.05}, {"tilt_deg": 3.0}, {"goal_m": 11.0}],
)
def test_a_climb_is_good_that_stood_got_there_and_kept_every_limit(
    change: dict[str, object],
) -> None:
    assert GOOD.good and not replace(GOOD, **change).good  # type: ignore[arg-type]


def test_a_case_is_told_by_its_worst_run() -> None:
    row = table([GOOD, replace(GOOD, seed=2, verdict="fell", way_m=4.0, slip_m=0.2)]).split("\n")[2]
    assert row.startswith("| plane 45 | 1 of 2 | 1 | 4.00 | 200.0 | 0.13 | 3200 |")


def test_seeds_differ_in_rock_and_friction_and_every_case_is_a_scenario() -> None:
    made = climbs(list(CASES), 2)
    assert len(made) == 2 * len(CASES) and [c.seed for c in made[: len(CASES)]] == [1] * len(CASES)
    frictions = {c.scenario().terrain.friction for c in made}
    assert len(frictions) == 2 and all(0.6 <= f <= 0.8 for f in frictions)
    rocks = {c.scenario().terrain.roughness_seed for c in made if c.case == "rough 60"}
    assert rocks == {1, 2}


def test_a_climb_that_is_there_is_not_run_again_and_a_cut_line_is(tmp_path: Path) -> None:
    found = evaluate(tmp_path, ["plane 45"], 1, 1, way_m=0.02)
    assert found[0].verdict == "stood" and found[0].way_m >= 0.02 and found[0].good
    lines = tmp_path / "climbs.jsonl"
    whole = lines.read_text()
    assert evaluate(tmp_path, ["plane 45"], 1, 1, way_m=0.02) == found
    assert lines.read_text() == whole, "nothing was run"
    lines.write_text(whole[:40])
    assert read(lines) == []
    assert evaluate(tmp_path, ["plane 45"], 1, 1, way_m=0.02) == found
    assert lines.read_text() == whole[:40] + "\n" + whole
    assert (tmp_path / "climbs.md").read_text() == table(found)


def test_a_case_that_is_none_is_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    with pytest.raises(SystemExit) as end:
        main(["--out", str(tmp_path / "none"), "--cases", "plane 90"])
    assert (
        end.value.code == 2
        and "plane 85" in capsys.readouterr().err
        and not (tmp_path / "none").exists()
    )
