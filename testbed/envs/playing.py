"""Let a trained policy act for one episode."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from testbed.envs import named
from testbed.envs.policies import read_policy
from testbed.errors import InputError
from testbed.formats.files import check_file, whole

PICTURES_HZ = 5
"""Pictures of a video, a simulated second."""


def play(
    policy: Path, scenario: str, seed: int = 0, gui: bool = False, video: Path | None = None
) -> dict[str, Any]:
    """One episode of a policy on a scenario as it is written; `video`: a .gif of it, five pictures a simulated second.

    Raises InputError for a file that is no policy or another task's, and for a video that cannot be written.
    """
    import gymnasium

    task, network = read_policy(policy)
    if video is not None:
        check_file(video, (".gif",), "--video")
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
    pictures: list[Any] = []
    while not over:
        if video is not None and info["t_s"] >= len(pictures) / PICTURES_HZ:
            pictures.append(env.render())
        action = network.answer(observation).astype(np.float32)
        observation, gained, terminated, truncated, info = env.step(action)
        reward, over = reward + float(gained), terminated or truncated
        lowest, use = min(lowest, info["lowest_normal_n"]), max(use, info["friction_use"])
    env.close()
    if video is not None:
        _write_gif(pictures, video)
    return {
        "reward": reward,
        "simulated_s": info["t_s"],
        "verdict": info["verdict"],
        "lowest_normal_n": float(lowest),
        "friction_use_highest": use,
    }


def _write_gif(pictures: list[Any], file: Path) -> None:
    from PIL import Image

    first, *others = [Image.fromarray(picture).quantize(64) for picture in pictures]
    with whole(file) as hidden:
        first.save(
            hidden, save_all=True, append_images=others, duration=1000 // PICTURES_HZ, loop=0
        )
