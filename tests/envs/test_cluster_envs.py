"""Environments on a Dask cluster answer a training as environments of its own process do."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

from testbed.envs.training import MANY_STEPS
from testbed.errors import InputError

WITHOUT_EXTRAS = not (find_spec("stable_baselines3") and find_spec("distributed"))
pytestmark = [
    pytest.mark.rl,
    pytest.mark.slow,
    pytest.mark.skipif(WITHOUT_EXTRAS, reason="needs the extras rl and sweep"),
]


class Walk(gymnasium.Env[Any, Any]):
    """A number that goes on by its action and by chance, for three steps."""

    def __init__(self, first: float) -> None:
        self.observation_space = gymnasium.spaces.Box(-10.0, 10.0, (1,), np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,), np.float32)
        self.first = first
        self._at, self._steps = first, 0

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        super().reset(seed=seed)
        self._at, self._steps = self.first + float(self.np_random.random()), 0
        return np.array([self._at], np.float32), {"begun": self._at}

    def step(self, action: Any) -> Any:
        self._at, self._steps = self._at + float(action[0]), self._steps + 1
        return np.array([self._at], np.float32), self._at, False, self._steps == 3, {}

    def doubled(self, what: float) -> float:
        """So that a method can be asked for."""
        return 2.0 * what


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None
    ) as cluster:
        yield str(cluster.scheduler_address)


def test_two_environments_on_a_cluster_tell_what_they_tell_in_one_process(address: str) -> None:
    from stable_baselines3.common.vec_env import DummyVecEnv

    from testbed.envs.cluster import ClusterEnvs

    makers = [partial(Walk, first) for first in (1.0, 2.0)]
    told = []
    for envs in (DummyVecEnv(makers), ClusterEnvs(address, makers)):
        envs.seed(5)
        rows = [envs.reset().tolist()]
        for k in range(4):
            observations, rewards, over, infos = envs.step(np.full((2, 1), 0.25 * k, np.float32))
            ended = [info.get("terminal_observation") for info in infos]
            rows.append([observations.tolist(), rewards.tolist(), over.tolist(), str(ended)])
            rows.append([info.get("TimeLimit.truncated", False) for info in infos])
        rows += [envs.reset_infos, envs.get_attr("first"), envs.env_method("doubled", 3.0)]
        envs.set_attr("first", 7.0, indices=1)
        rows += [envs.get_attr("first"), envs.env_is_wrapped(gymnasium.Wrapper)]
        envs.close()
        told.append(rows)
    assert told[0] == told[1]
    assert told[0][5][2] == [True, True]


def test_a_training_on_a_cluster_ends_with_the_weights_of_one_in_processes(
    address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two environments, a round of 16 steps each."""
    from testbed.envs.training import train

    monkeypatch.setitem(MANY_STEPS, "n_steps", 16)
    monkeypatch.setitem(MANY_STEPS, "batch_size", 16)
    found = []
    for out, cluster in ((tmp_path / "here", None), (tmp_path / "there", address)):
        policy = train("stand", out, 32, workers=2, cluster=cluster, duration_s=0.2)
        found.append(policy.read_bytes())
        assert len(list((out / "episodes").glob("*.monitor.csv"))) == 2
    assert found[0] == found[1]


def test_a_scheduler_that_is_not_there_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    from testbed.envs.cluster import ClusterEnvs

    monkeypatch.setattr("testbed.simulation.workers.CONNECT_S", 0.3)
    with pytest.raises(InputError, match="--dask"):
        ClusterEnvs("tcp://127.0.0.1:9", [partial(Walk, 1.0)])
