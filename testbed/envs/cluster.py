"""Environments on the workers of a Dask cluster, for a training of stable-baselines3."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv

from testbed.errors import InputError
from testbed.simulation.workers import cluster_client, single_threaded


class Hosted(DummyVecEnv):  # type: ignore[misc]
    """One environment on a worker."""

    def __init__(self, make: Callable[[], Any]) -> None:
        single_threaded()
        super().__init__([make])

    def spaces(self) -> tuple[Any, Any]:
        """Of observations and of actions."""
        return self.observation_space, self.action_space

    def begin(self, seed: int | None, options: dict[str, Any]) -> tuple[Any, Any]:
        """A new episode's first observation and info."""
        self._seeds, self._options = [seed], [options]
        return self.reset()[0], self.reset_infos[0]

    def go(self, action: Any) -> tuple[Any, ...]:
        """Observation, reward, whether the episode is over, info, info of the last reset."""
        return *(of_all[0] for of_all in self.step([action])), self.reset_infos[0]


class ClusterEnvs(VecEnv):  # type: ignore[misc]
    """The environments of `makers`, each on a worker of the cluster at `address`: as many workers
    as there are, one after the other. Raises InputError where no scheduler answers or none works.
    """

    def __init__(self, address: str, makers: Sequence[Callable[[], Any]]) -> None:
        self._client = cluster_client(address)
        workers = sorted(self._client.scheduler_info(n_workers=-1)["workers"])
        if not workers:
            self._client.close()
            raise InputError("has no workers", field="--dask", value=address)
        self._hosts = [
            self._client.submit(
                Hosted, make, actor=True, pure=False, workers=[workers[k % len(workers)]]
            ).result()
            for k, make in enumerate(makers)
        ]
        self._asked: list[Any] = []
        super().__init__(len(self._hosts), *self._hosts[0].spaces().result())

    def reset(self) -> Any:
        """See VecEnv."""
        asked = [
            host.begin(seed, options)
            for host, seed, options in zip(self._hosts, self._seeds, self._options, strict=True)
        ]
        answers = [future.result() for future in asked]
        self.reset_infos = [info for _, info in answers]
        self._reset_seeds()
        self._reset_options()
        return np.stack([observation for observation, _ in answers])

    def step_async(self, actions: Any) -> None:
        """See VecEnv."""
        pairs = zip(self._hosts, actions, strict=True)
        self._asked = [host.go(action) for host, action in pairs]

    def step_wait(self) -> Any:
        """See VecEnv."""
        answers = [future.result() for future in self._asked]
        observations, rewards, over, infos, begun = zip(*answers, strict=True)
        self.reset_infos = list(begun)
        return np.stack(observations), np.array(rewards, np.float32), np.array(over), list(infos)

    def close(self) -> None:
        """See VecEnv."""
        for host in self._hosts:
            host.close().result()
        self._hosts = []
        self._client.close()

    def _chosen(self, indices: Any) -> list[Any]:
        return [self._hosts[k] for k in self._get_indices(indices)]

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """See VecEnv."""
        return [host.get_attr(attr_name).result()[0] for host in self._chosen(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """See VecEnv."""
        for host in self._chosen(indices):
            host.set_attr(attr_name, value).result()

    def env_method(
        self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any
    ) -> list[Any]:
        """See VecEnv."""
        hosts = self._chosen(indices)
        asked = [host.env_method(method_name, *method_args, **method_kwargs) for host in hosts]
        return [future.result()[0] for future in asked]

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """See VecEnv."""
        return [host.env_is_wrapped(wrapper_class).result()[0] for host in self._chosen(indices)]
