"""Environments that take random actions: what they show stays finite and in its bounds."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from testbed.benchmarks.soak.sandbox import Judged, forked
from testbed.envs import ENVIRONMENTS, make

PHYSICS_STEPS = 10_000
"""Of one trial: a hundred trials make a million."""


def random_actions(number: int, rng: np.random.Generator, folder: Path) -> tuple[Judged, int]:
    """Random actions in an environment for so many physics steps; also how many were made under
    them. The environments take turns by the trial's number.
    """
    name, counted = sorted(ENVIRONMENTS)[number % len(ENVIRONMENTS)], folder / "steps"
    done = forked(partial(_act, name, rng, counted))
    return done.judged, int(counted.read_text()) if counted.is_file() else 0


def _act(name: str, rng: np.random.Generator, counted: Path) -> None:
    """As many episodes as it takes. Raises ValueError for what is shown and cannot be."""
    env = make(name, disable_env_checker=True)
    env.action_space.seed(int(rng.integers(2**31)))
    made, over, before_s = 0, True, 0.0
    while made < PHYSICS_STEPS:
        if over:
            shown, info = env.reset(seed=int(rng.integers(2**31)))
            paid, over = 0.0, False
        else:
            shown, reward, lost, ended, info = env.step(env.action_space.sample())
            paid = float(reward)
            made += max(_steps(env, info["t_s"] - before_s), 1)
            over = lost or ended
        before_s = info["t_s"]
        if not (np.isfinite(paid) and env.observation_space.contains(shown)):
            raise ValueError(f"{name} showed {shown} for {paid}")
        counted.write_text(str(made))


def _steps(env: Any, seconds: float) -> int:
    """Physics steps of so much simulated time."""
    simulation = getattr(env.unwrapped, "_sim", None)
    return 0 if simulation is None else round(seconds / simulation.dt)
