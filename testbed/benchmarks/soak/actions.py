"""Environments that take random actions: what they show stays finite and in its bounds."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from testbed.benchmarks.soak.sandbox import Judged
from testbed.envs import ENVIRONMENTS, make

PHYSICS_STEPS = 1_000
"""Of one trial: a thousand trials make a million."""


def random_actions(rng: np.random.Generator) -> tuple[Judged, int]:
    """Random actions in one of the environments for so many physics steps, over as many episodes as
    that takes; also how many were made.
    """
    name = sorted(ENVIRONMENTS)[int(rng.integers(len(ENVIRONMENTS)))]
    env = _environment(name)
    env.action_space.seed(int(rng.integers(2**31)))
    made, wrong, over = 0, "", True
    while made < PHYSICS_STEPS and not wrong:
        if over:
            shown, info = env.reset(seed=int(rng.integers(2**31)))
            reward, before_s, over = 0.0, info["t_s"], False
            made += _steps(env, info["t_s"])
        else:
            shown, reward, lost, ended, info = env.step(env.action_space.sample())
            made += max(_steps(env, info["t_s"] - before_s), 1)
            before_s, over = info["t_s"], lost or ended
        if not (np.isfinite(float(reward)) and env.observation_space.contains(shown)):
            wrong = f"{name} showed {shown} for {reward}"
    return ("served", wrong), made


@cache
def _environment(name: str) -> Any:
    return make(name, disable_env_checker=True)


def _steps(env: Any, seconds: float) -> int:
    """Physics steps of so much simulated time."""
    simulation = getattr(env.unwrapped, "_sim", None)
    return 0 if simulation is None else round(seconds / simulation.dt)
