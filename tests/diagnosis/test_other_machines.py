"""The robot's diagnosis on a machine that none of its numbers was fitted on: the quarter model."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from testbed.scenario.scenario import load_scenario
from testbed.simulation.run import run_scenario
from testbed.workflows.diagnose import diagnose

PAYLOAD = "{effect: robot.payload, at: body, parameters: {mass: 6.0, x: 0.15, y: 0.05, z: 0.1}}"


def found_on(folder: Path, *undeclared: str, seed: int = 3) -> dict[str, Any]:
    """Findings on a drawn quarter model that sways for 14 s."""
    drawn = ["machine.draw=workshop", f"machine.seed={seed}"]
    changes = ["task.kind=sway", "duration_s=14", *drawn]
    hidden = f"undeclared=[{', '.join(undeclared)}]"
    run_scenario(load_scenario("quarter_model_stand", [*changes, hidden]), folder / "run")
    return diagnose(folder / "run", folder / "found").tree


@pytest.mark.slow
def test_drawn_quarter_models_are_left_alone_or_hardly_doubted(tmp_path: Path) -> None:
    """Of one in thirty a name may be said, as of ROBOCLIMBER, but none is likely."""
    all_found = [found_on(tmp_path / str(seed), seed=seed) for seed in (3, 4, 5)]
    likeliest = [max(found["hypotheses"], key=lambda h: h["probability"]) for found in all_found]
    assert [one["names"] for one in likeliest] == [[], [], []]
    assert sum(found["verdict"] == "none" for found in all_found) >= 2


@pytest.mark.slow
def test_what_lies_on_it_is_weighed(tmp_path: Path) -> None:
    found = found_on(tmp_path, PAYLOAD)
    assert [(e["name"], e["place"]) for e in found["effects"]] == [("robot.payload", "body")]
    low, high = found["effects"][0]["parameters"]["mass"]["interval90"]
    assert low < 6.0 < high < 12.0
    assert found["error"]["force_n"]["after"] < 0.6 * found["error"]["force_n"]["before"]
