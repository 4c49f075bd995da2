"""Let a trained policy act for one episode."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import numpy as np

from testbed.envs import named
from testbed.envs.policies import read_policy
from testbed.errors import InputError
from testbed.simulation.video import Video


def play(
    policy: Path, scenario: str, seed: int = 0, gui: bool = False, video: Path | None = None
) -> dict[str, Any]:
    """One episode of a policy on a scenario as it is written; `video`: a .mp4, .gif or .webp of it.

    Raises InputError for a file that is no policy or another task's, and for a video that cannot be
    written.
    """
    import gymnasium

    task, network = read_policy(policy)
    film = Video(video) if video is not None else None
    mode = "human" if gui else "rgb_array" if video is not None else None
    env = gymnasium.make(
        named(task, "task"), scenario=scenario, randomisation=None, render_mode=mode
    )
    shapes = (env.observation_space.shape, env.action_space.shape)
    if ((network.inputs,), (network.outputs,)) != shapes:
        env.close()
        raise InputError("is no policy of this task", file=policy, field="task", value=task)
    observation, info = env.reset(seed=seed)
    reward, lowest, use, over = 0.0, np.inf, 0.0, False
    while not over:
        if film is not None and film.due(info["t_s"]):
            film.add(cast(Any, env.render()))
        action = network.answer(observation).astype(np.float32)
        observation, gained, terminated, truncated, info = env.step(action)
        reward, over = reward + float(gained), terminated or truncated
        lowest, use = min(lowest, info["lowest_normal_n"]), max(use, info["friction_use"])
    env.close()
    if film is not None:
        film.write()
    return {
        "reward": reward,
        "simulated_s": info["t_s"],
        "verdict": info["verdict"],
        "lowest_normal_n": float(lowest),
        "friction_use_highest": use,
    }
