"""Two runs on one page: what differs in their scenarios, what they come to, and their series side
by side.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from synthetic_run import write_synthetic_run
from test_hostile_names import HOSTILE, foreign

from testbed.errors import InputError
from testbed.report.comparison import differences
from testbed.workflows.report import write_comparison


def test_it_shows_the_numbers_of_both_under_their_names(tmp_path: Path) -> None:
    runs = [write_synthetic_run(tmp_path / name, 3.0) for name in ("plain", "changed")]
    (runs[0] / "scenario.yaml").write_text("terrain: {slope_deg: 45.0, friction: 0.6}\n")
    (runs[1] / "scenario.yaml").write_text("terrain: {slope_deg: 45.0, friction: 0.4}\n")
    summary = json.loads((runs[1] / "summary.json").read_text())
    (runs[1] / "summary.json").write_text(json.dumps({**summary, "verdict": "slid"}))
    text = write_comparison(runs, tmp_path / "both.html").read_text().replace("<wbr>", "")
    assert not foreign(text)
    assert "<td>terrain.friction</td><td>0.6</td><td>0.4</td>" in text
    assert '<td>verdict</td><td class="n">stood</td><td class="n">slid</td>' in text
    assert "terrain.slope_deg" not in text and text.count("<svg") == 3


@pytest.mark.parametrize("count", [0, 1, 3])
def test_it_wants_two_runs(tmp_path: Path, count: int) -> None:
    with pytest.raises(InputError, match="1 or 2"):
        write_comparison([tmp_path] * count, tmp_path / "both.html")
    assert not list(tmp_path.iterdir())


def test_lists_differ_entry_by_entry_and_what_only_one_has_is_told() -> None:
    one = {"task": {"kind": "drill"}, "events": [{"at_s": 1.0}, {"at_s": 2.0}], "seed": 1}
    other = {"task": {"kind": "crawl", "steps": 4}, "events": [{"at_s": 1.0}], "seed": 1}
    assert differences(one, other) == [
        ("task.kind", "drill", "crawl"),
        ("events.1.at_s", "2", "–"),
        ("task.steps", "–", "4"),
    ]


def test_what_a_user_wrote_is_not_taken_for_html(tmp_path: Path) -> None:
    word = " ".join(HOSTILE[:3])
    runs = [write_synthetic_run(tmp_path / name, 1.0) for name in ("one", word.replace("/", "\\"))]
    (runs[0] / "scenario.yaml").write_text(json.dumps({"description": word, word: [word]}))
    assert not foreign(write_comparison(runs, tmp_path / "both.html").read_text())
