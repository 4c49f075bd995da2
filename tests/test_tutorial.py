"""Every tutorial does what it says: its files are written, its commands and its Python run, in
their order.
"""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import numpy as np
import pyarrow.csv as csv
import pytest
from typer.testing import CliRunner

from testbed.cli import app
from testbed.machine.names import LEGS
from testbed.simulation.replay import replay_gait
from testbed.simulation.runs import read_series

ROOT = Path(__file__).parents[1]
TUTORIALS = sorted((ROOT / "docs" / "tutorials").glob("*.md"))
MOST_LINES = 60
SMALLER = {
    r"--cases \d+": "--cases 1",
    r"--jobs \d+": "--jobs 1",
    r"--hours [\d.]+": "--hours 0.01",
}
"""What a test changes of a command, so that it takes seconds."""


def _blocks(text: str) -> list[tuple[str, str]]:
    """Head and body of every block of code, in order."""
    return re.findall(r"^```(\S[^\n]*)\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


def _run(head: str, body: str) -> None:
    """Write the block's file, run its commands, or run its Python."""
    language, _, file = head.partition(" file=")
    if file:
        Path(file).write_text(body)
    elif language == "sh":
        for line in body.splitlines():
            _command(line.partition("  #")[0])
    elif language == "python":
        exec(body, {"__name__": "__main__"})


def _command(line: str) -> None:
    for pattern, small in SMALLER.items():
        line = re.sub(pattern, small, line)
    program, *arguments = shlex.split(line)
    assert program == "testbed"
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 0, f"{line}: {done.output} {done.exception}"


@pytest.mark.slow
@pytest.mark.parametrize("tutorial", TUTORIALS, ids=lambda file: file.stem)
def test_a_tutorial_is_short_is_named_in_the_readme_and_runs(
    tutorial: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = tutorial.read_text()
    assert text.count("\n") <= MOST_LINES
    assert f"docs/tutorials/{tutorial.name}" in (ROOT / "README.md").read_text()
    monkeypatch.chdir(tmp_path)
    for head, body in _blocks(text):
        _run(head, body)
    AFTER[tutorial.stem]()


def _after_own_controller() -> None:
    result = json.loads(Path("compared/distribution.json").read_text())
    assert [entry["name"] for entry in result["controllers"]] == ["mine.py:Mine", "qp", "oracle"]
    assert 0.0 < result["controllers"][0]["friction_use_median"] <= 1.5
    assert json.loads(Path("drilled/summary.json").read_text())["verdict"] == "stood"


def _after_own_detector() -> None:
    contact = np.asarray(read_series(Path("run"), "data")["contact_fl"])
    assert np.all(contact[100:] == 1.0)


def _after_own_estimator() -> None:
    live = read_series(Path("run"), "data")
    over = csv.read_csv("forces.csv")
    for leg in LEGS:
        load = np.asarray(live[f"estimate_own_{leg}"])
        assert np.ptp(load) > 1.0
        np.testing.assert_allclose(over[f"force_{leg}_n"].to_numpy(), load, atol=1e-3)
        low = np.asarray(live[f"own_low_{leg}"])
        np.testing.assert_allclose(over[f"force_{leg}_n_low"].to_numpy(), low, atol=1e-3)
        np.testing.assert_allclose(load - low, 1000.0, atol=1e-2)
    assert json.loads(Path("run/summary.json").read_text())["force_rms_n"]["own"] < 1000.0, (
        "the areas of the shipped machine's cylinders leave no more than friction"
    )


def _after_own_gait() -> None:
    assert json.loads(Path("bowed/summary.json").read_text())["verdict"] == "stood"
    commands, recorded = replay_gait("bow.py:Bow", "bowed")
    ordered = np.stack([recorded[f"reference_{leg}_vertical"] for leg in ("fl", "rr")], axis=1)
    assert np.ptp(ordered, axis=0) == pytest.approx(0.05, abs=2e-3)
    # A row holds the set points at its own time: the end of the tick before.
    assert commands.joints[:-1, [2, 11]] == pytest.approx(ordered[commands.row[1:]], abs=2e-3)


AFTER = {
    "own_controller": _after_own_controller,
    "own_detector": _after_own_detector,
    "own_estimator": _after_own_estimator,
    "own_gait": _after_own_gait,
}
"""What each tutorial leaves behind."""


def test_the_environment_of_the_guide_steps() -> None:
    (code,) = [
        body
        for head, body in _blocks((ROOT / "docs" / "guides" / "python.md").read_text())
        if head == "python" and "gymnasium.make" in body
    ]
    scope: dict[str, object] = {}
    exec(code, scope)
    scope["env"].close()  # type: ignore[attr-defined]
    assert scope["observation"].shape == (41,) and scope["terminated"] is False  # type: ignore[attr-defined]


@pytest.mark.slow
def test_the_controller_of_the_guide_hears_what_the_recording_says(tmp_path: Path) -> None:
    (code,) = [
        body
        for head, body in _blocks((ROOT / "docs" / "guides" / "recordings.md").read_text())
        if head == "python"
    ]
    recording = ROOT / "tests" / "data" / "first_version" / "robot"
    scope: dict[str, object] = {}
    exec(code.replace("RECORDING", str(recording)), scope)
    told = scope["told"]["estimate"]["own"][0]  # type: ignore[index]
    _command(f"testbed estimate {recording} --out {tmp_path / 'forces.csv'}")
    over = csv.read_csv(tmp_path / "forces.csv")
    for leg, load in zip(LEGS, told, strict=True):
        assert over[f"force_{leg}_n"].to_numpy()[-1] == pytest.approx(load, abs=1e-3)
