"""Training: names, checkpoints, resuming, one-line refusals."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

from testbed.envs import ENVIRONMENTS
from testbed.envs.training import TASKS, environment, latest, library, play, train
from testbed.errors import InputError

HAS_RL = importlib.util.find_spec("stable_baselines3") is not None


def test_every_environment_has_a_task() -> None:
    assert set(TASKS.values()) == set(ENVIRONMENTS)
    assert environment("force-distribution") == "Roboclimber/ForceDistribution-v0"
    with pytest.raises(InputError, match="force-distribution"):
        environment("dance")


def test_the_latest_checkpoint_has_the_most_steps_not_the_last_name(tmp_path: Path) -> None:
    assert latest(tmp_path) is None
    (tmp_path / "checkpoints").mkdir()
    for steps in (9000, 10_000, 500):
        (tmp_path / "checkpoints" / f"policy_{steps}_steps.zip").write_text("")
    found = latest(tmp_path)
    assert found is not None and found.name == "policy_10000_steps.zip"


@pytest.mark.skipif(HAS_RL, reason="the extra `rl` is installed")
def test_without_the_library_the_command_that_installs_it_is_named() -> None:
    with pytest.raises(InputError, match="pip install"):
        library()


@pytest.mark.rl
@pytest.mark.slow
@pytest.mark.skipif(not HAS_RL, reason="the extra `rl` is not installed")
def test_training_goes_on_where_it_was_and_the_policy_plays(tmp_path: Path) -> None:
    policy = train("stand", tmp_path / "t", 512)
    first = latest(tmp_path / "t")
    assert first is not None and first.name == "policy_512_steps.zip"
    train("stand", tmp_path / "t", 1000)
    second = latest(tmp_path / "t")
    assert second is not None and second.name == "policy_1024_steps.zip"
    played = play(policy, "stand_flat")
    assert played["simulated_s"] > 1.0 and played["verdict"] in ("stood", "slid", "fell")
    with pytest.raises(InputError, match="another task"):
        train("drill", tmp_path / "t", 512)
