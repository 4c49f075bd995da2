"""Environments on the workers of a Dask cluster, for a training of stable-baselines3."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from stable_baselines3.common.vec_env.base_vec_env import VecEnv

from testbed.errors import InputError
from testbed.simulation.workers import cluster_client, single_threaded


class Hosted:
    """One environment on a worker: what a training asks of it, each answer a plain value."""

    def __init__(self, make: Callable[[], Any]) -> None:
        single_threaded()
        self._env = make()

    def spaces(self) -> tuple[Any, Any]:
        """Of observations and of actions."""
        return self._env.observation_space, self._env.action_space

    def reset(self, seed: int | None, options: dict[str, Any] | None) -> tuple[Any, dict[str, Any]]:
        """As the environment's."""
        observation, info = self._env.reset(seed=seed, **({"options": options} if options else {}))
        return observation, info

    def step(self, action: Any) -> tuple[Any, float, bool, dict[str, Any], dict[str, Any]]:
        """Observation, reward, whether the episode is over, info, info of a new reset; after an end
        the observation is the next episode's first one.
        """
        observation, reward, lost, over, info = self._env.step(action)
        info["TimeLimit.truncated"] = over and not lost
        begun: dict[str, Any] = {}
        if lost or over:
            info["terminal_observation"] = observation
            observation, begun = self._env.reset()
        return observation, float(reward), bool(lost or over), info, begun

    def get(self, name: str) -> Any:
        """An attribute, of the outermost wrapper that has it."""
        return self._env.get_wrapper_attr(name)

    def set(self, name: str, value: Any) -> None:
        """Give an attribute a value."""
        self._env.set_wrapper_attr(name, value)

    def call(self, name: str, given: Sequence[Any], named: dict[str, Any]) -> Any:
        """The answer of a method."""
        return self._env.get_wrapper_attr(name)(*given, **named)

    def wrapped_in(self, kind: type) -> bool:
        """Whether one of its wrappers is of a class."""
        env = self._env
        while True:
            if isinstance(env, kind):
                return True
            if not hasattr(env, "env"):
                return False
            env = env.env

    def close(self) -> None:
        """Give the engine back."""
        self._env.close()


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
            host.reset(seed, options)
            for host, seed, options in zip(self._hosts, self._seeds, self._options, strict=True)
        ]
        told = [future.result() for future in asked]
        self.reset_infos = [info for _, info in told]
        self._reset_seeds()
        self._reset_options()
        return np.stack([observation for observation, _ in told])

    def step_async(self, actions: Any) -> None:
        """See VecEnv."""
        pairs = zip(self._hosts, actions, strict=True)
        self._asked = [host.step(action) for host, action in pairs]

    def step_wait(self) -> Any:
        """See VecEnv."""
        told = [future.result() for future in self._asked]
        observations, rewards, over, infos, begun = zip(*told, strict=True)
        self.reset_infos = [
            new if ended else old
            for new, old, ended in zip(begun, self.reset_infos, over, strict=True)
        ]
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
        return [host.get(attr_name).result() for host in self._chosen(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """See VecEnv."""
        for host in self._chosen(indices):
            host.set(attr_name, value).result()

    def env_method(
        self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any
    ) -> list[Any]:
        """See VecEnv."""
        hosts = self._chosen(indices)
        return [host.call(method_name, method_args, method_kwargs).result() for host in hosts]

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """See VecEnv."""
        return [host.wrapped_in(wrapper_class).result() for host in self._chosen(indices)]
