"""Train and play policies with stable-baselines3 (extra `rl`): checkpoints, resuming, CSV of episodes, video.

A trained policy is written as plain arrays (policy.npz); that of the force distribution is a controller by its name.
"""

from __future__ import annotations

import importlib.util
import re
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import numpy as np

from testbed.envs import ENVIRONMENTS
from testbed.envs.policies import OPTIMISER, WEIGHTS, actor, read_policy, read_tensors
from testbed.errors import InputError
from testbed.formats.files import read_json, write_json
from testbed.formats.networks import write_network
from testbed.formats.ownership import owned
from testbed.simulation.video import Video

TASKS = {
    re.sub(r"(?<!^)(?=[A-Z])", "-", name.split("/")[1][:-3]).lower(): name for name in ENVIRONMENTS
}
"""stand, climb, drill, force-distribution -> id."""
SHARED = "force-distribution"
"""The task whose policy becomes a controller, too."""
CHECKPOINT_STEPS = 10_000
"""Steps of all workers together from checkpoint to checkpoint."""
SETTINGS: dict[str, Any] = {
    "n_steps": 2000,
    "batch_size": 1000,
    "n_epochs": 4,
    "gae_lambda": 0.9,
    "gamma": 0.95,
    "ent_coef": 0.0,
    "policy_kwargs": {"net_arch": [32, 32], "log_std_init": -2.0},
}
"""Of the proximal policy optimisation; the rest is the library's (E). Few passes over many steps: cases differ more
than actions do, and no action is a good one."""


def library() -> Any:
    """stable_baselines3. Raises InputError with the command that installs it."""
    try:
        import stable_baselines3
    except ImportError as error:
        raise InputError(
            "needs the extra `rl`", allowed="pip install 'roboclimber-testbed[rl]'"
        ) from error
    return stable_baselines3


def environment(task: str) -> str:
    """The environment of a task. Raises InputError with the tasks there are."""
    if task not in TASKS:
        raise InputError("no such task", field="task", value=task, allowed=", ".join(TASKS))
    return TASKS[task]


def train(
    task: str,
    out: Path,
    steps: int,
    seed: int = 0,
    workers: int = 1,
    progress: Callable[[int], None] | None = None,
) -> Path:
    """Train `steps` steps in all, going on from the last checkpoint in `out`; returns the policy's file.

    Leaves policy.npz (arrays), policy.zip (the library's), checkpoints/, episodes/ (CSV, a line per episode: reward,
    length, time), training.json and, where tensorboard is installed, tensorboard/.
    Raises InputError for an unknown task, a folder of another task or a missing library.
    """
    name, kit = environment(task), library()
    with owned(out):
        _claim(out, {"task": task, "seed": seed, "settings": SETTINGS})
        model = _trained(kit, name, out, steps, seed, workers, progress)
        made_by = f"testbed train {task} --steps {steps} --seed {seed} --workers {workers}"
        arrays = actor(model.policy.state_dict())
        write_network(out / "policy.npz", arrays, made_by=made_by, task=task)
    return out / "policy.npz"


def _trained(
    kit: Any,
    name: str,
    out: Path,
    steps: int,
    seed: int,
    workers: int,
    progress: Callable[[int], None] | None,
) -> Any:
    """The library's model after `steps` steps in all, saved in `out`."""
    from stable_baselines3.common.callbacks import CheckpointCallback
    from stable_baselines3.common.env_util import make_vec_env
    from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv

    way = SubprocVecEnv if workers > 1 else DummyVecEnv
    envs = make_vec_env(
        name,
        workers,
        seed=seed,
        vec_env_cls=way,
        monitor_dir=str(out / "episodes"),
        monitor_kwargs={"override_existing": False},
    )
    try:
        last = latest(out)
        board = _tensorboard(out)
        model = kit.PPO(
            "MlpPolicy", envs, seed=seed, device="cpu", tensorboard_log=board, **SETTINGS
        )
        if last is not None:
            _take_over(model, last)
        saver = CheckpointCallback(
            max(CHECKPOINT_STEPS // workers, 1), str(out / "checkpoints"), "policy"
        )
        left = steps - int(model.num_timesteps)
        if left > 0:
            model.learn(left, callback=[saver, _reporter(progress)], reset_num_timesteps=False)
            model.save(out / "checkpoints" / f"policy_{model.num_timesteps}_steps.zip")
        model.save(out / "policy.zip")
    finally:
        envs.close()
    return model


def _take_over(model: Any, checkpoint: Path) -> None:
    """Give a new model the weights, the optimiser's state and the number of steps of a checkpoint: tensors alone."""
    try:
        model.policy.load_state_dict(read_tensors(checkpoint, WEIGHTS))
        model.policy.optimizer.load_state_dict(read_tensors(checkpoint, OPTIMISER))
    except (RuntimeError, ValueError, KeyError) as error:
        raise InputError("is of another training", file=checkpoint, field="--out") from error
    model.num_timesteps = _steps(checkpoint)


def _tensorboard(out: Path) -> str | None:
    return str(out / "tensorboard") if importlib.util.find_spec("tensorboard") else None


def latest(out: Path) -> Path | None:
    """The whole checkpoint with the most steps, None if there is none; a kill may leave the last one in pieces."""
    found = [p for p in (out / "checkpoints").glob("*_steps.zip") if _steps(p) > 0]
    found = sorted(found, key=_steps, reverse=True)
    return next((checkpoint for checkpoint in found if zipfile.is_zipfile(checkpoint)), None)


def _steps(checkpoint: Path) -> int:
    """How many steps a checkpoint has behind it, by its name; 0 for another name."""
    found = re.search(r"_(\d+)_steps", checkpoint.name)
    return int(found[1]) if found else 0


def play(
    policy: Path, scenario: str, seed: int = 0, gui: bool = False, video: Path | None = None
) -> dict[str, Any]:
    """One episode of a policy on a scenario; `video`: a .mp4, .gif or .webp of it.

    Raises InputError for a file that is no policy or another task's, and for a video that cannot be written.
    """
    import gymnasium

    task, network = read_policy(policy)
    film = Video(video) if video is not None else None
    mode = "human" if gui else "rgb_array" if video is not None else None
    kwargs: dict[str, Any] = {"scenario": scenario, "render_mode": mode}
    if task == SHARED:
        kwargs["randomisation"] = None
    env = gymnasium.make(environment(task), **kwargs)
    if ((network.inputs,), (network.outputs,)) != (
        env.observation_space.shape,
        env.action_space.shape,
    ):
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


def _claim(out: Path, what: dict[str, Any]) -> None:
    file = out / "training.json"
    if file.is_file() and read_json(file).get("task") != what["task"]:
        raise InputError(
            "holds another task's training", file=out, field="--out", allowed="a new folder"
        )
    write_json(file, what)


def _reporter(progress: Callable[[int], None] | None) -> Any:
    from stable_baselines3.common.callbacks import BaseCallback

    class Report(BaseCallback):  # type: ignore[misc]
        """Tells the number of steps done."""

        def _on_step(self) -> bool:
            if progress is not None:
                progress(int(self.num_timesteps))
            return True

    return Report()
