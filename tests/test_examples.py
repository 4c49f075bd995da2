"""Every example stands in one short file and runs."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parents[1] / "examples").glob("*.py"))
MOST_LINES = 40
MARKS = {
    "diagnose": [pytest.mark.long],
    "own_controller": [pytest.mark.slow],
    "what_if": [pytest.mark.slow],
}
"""What takes more than a minute, and more than a few seconds."""
SAYS = {
    "diagnose": "sensor.gain_a at fl_vertical",
    "environment": "stood after 2.00 s",
    "own_controller": "CheapRopes",
    "own_detector": "Half says so at",
    "own_estimator": "shipped estimate",
    "own_gait": "the body went 2.",
    "read_a_run": "5.00 s: cut_rope",
    "run_and_plot": "stood: loads.png",
    "sweep": "lowest normal force",
    "undeclared_effects": "a worn piston",
    "what_if": "same bits again: True",
}
"""Something that each of them prints."""


def test_each_example_is_known_and_short() -> None:
    assert {file.stem for file in EXAMPLES} == set(SAYS)
    assert len(EXAMPLES) >= 10
    assert max(file.read_text().count("\n") for file in EXAMPLES) <= MOST_LINES


@pytest.mark.parametrize(
    "example",
    [pytest.param(file, id=file.stem, marks=MARKS.get(file.stem, [])) for file in EXAMPLES],
)
@pytest.mark.slow
def test_an_example_runs(
    example: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    runpy.run_path(str(example), run_name="__main__")
    assert SAYS[example.stem] in capsys.readouterr().out
