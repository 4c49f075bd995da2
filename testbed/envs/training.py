"""Train policies with stable-baselines3 (extra `rl`), session by session: what was killed goes on
where it was.

A training is a row of rounds of some thousand steps. A round begins with fresh episodes and
random numbers, drawn from the training's seed and the steps done before it, and ends with a
checkpoint: what was killed or stopped in the middle of a round makes that round again, and ends
with the very weights of a training that was not. A session is one call of `train`. A folder of a
training holds

    training.json            task, seed, settings, options and every session with its workers
    checkpoints/             the library's models; policy_<steps>_steps.zip
    episodes/                a file a session and worker, for stable_baselines3's results_plotter
    policy.zip, policy.npz   the last policy: the library's, and as plain arrays
"""

from __future__ import annotations

import importlib.util
import re
import signal
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from threading import current_thread, main_thread
from typing import Any

import numpy as np

from testbed.envs import named
from testbed.envs.policies import OPTIMISER, WEIGHTS, actor, read_tensors
from testbed.errors import InputError, extra
from testbed.formats.files import owned, read_json, whole, write_json
from testbed.formats.networks import write_network
from testbed.simulation.workers import single_threaded

MANY_STEPS: dict[str, Any] = {
    "n_steps": 2000,
    "batch_size": 1000,
    "n_epochs": 4,
    "gae_lambda": 0.9,
    "gamma": 0.95,
    "ent_coef": 0.0,
    "policy_kwargs": {"net_arch": [32, 32], "log_std_init": -2.0},
}
"""For a step of 20 ms. Few passes over many steps: cases differ more than actions do, and no action
is a good one.
"""
FEW_STEPS: dict[str, Any] = {
    "n_steps": 500,
    "batch_size": 125,
    "n_epochs": 8,
    "gae_lambda": 0.95,
    "gamma": 0.99,
    "ent_coef": 0.0,
    "policy_kwargs": {"net_arch": [32, 32], "log_std_init": -1.5},
}
"""For decisions of a tenth of a second and longer, of which an episode has some tens."""
SHORT_EPISODES: dict[str, Any] = {
    "n_steps": 800,
    "batch_size": 200,
    "n_epochs": 10,
    "learning_rate": 1e-3,
    "gae_lambda": 0.95,
    "gamma": 0.98,
    "ent_coef": 0.0,
    "policy_kwargs": {"net_arch": [32, 32], "log_std_init": -1.5},
}
"""For episodes of eighty decisions, ten of them between two updates."""
SETTINGS = {"keep": SHORT_EPISODES, "drill-hole": FEW_STEPS, "climb": FEW_STEPS}
"""By task; MANY_STEPS where there is none."""


def settings_of(task: str) -> dict[str, Any]:
    """The settings of a task by its name."""
    return SETTINGS.get(task, MANY_STEPS)


ROUND_STEPS = 4_000
"""Least steps of all workers together from checkpoint to checkpoint."""
Progress = Callable[[int], None]


@dataclass(frozen=True)
class Session:
    """One call of `train` on its folder."""

    out: Path
    task: str
    seed: int
    number: int
    """How many sessions there were before."""
    workers: int
    options: Mapping[str, Any] = field(default_factory=dict)
    """Of the environment."""
    cluster: str | None = None
    """Address of a Dask scheduler whose workers hold the environments."""

    def seed_at(self, done: int) -> int:
        """Seed of the episodes and the exploration of the round that begins after so many steps."""
        return int(np.random.SeedSequence([self.seed, done]).generate_state(1)[0] // 2)

    def episodes(self, worker: int) -> Path:
        """Where a worker writes a line an episode."""
        return self.out / "episodes" / f"session_{self.number:03d}_{worker:02d}"


def train(
    task: str,
    out: Path,
    steps: int,
    seed: int | None = None,
    workers: int = 1,
    progress: Progress | None = None,
    cluster: str | None = None,
    **options: Any,
) -> Path:
    """Train until `steps` steps are done in all, going on from the last checkpoint in `out`;
    returns the policy's file.

    cluster: the address of a Dask scheduler on whose workers the environments are, which see the
    same files under the same names; None for processes of this machine. seed: of a new training, 0
    if None; one that goes on keeps its own. options: of the environment, plain JSON values, kept
    with the training in the same way. An interruption (Ctrl-C) writes the policy as it is and is
    raised again. Raises InputError for numbers that cannot be, an unknown task, a folder of another
    training or a missing library.
    """
    for option, value in (("--steps", steps), ("--workers", workers)):
        if value < 1:
            raise InputError("must be at least 1", field=option, value=value)
    named(task, "task")
    single_threaded()
    kit = extra("stable_baselines3", "rl")
    with owned(out):
        begun = _begin(out, {"task": task, "seed": seed, "options": options}, workers)
        session = replace(begun, cluster=cluster)
        try:
            _learn(kit, session, steps, progress)
        finally:
            _write_policy(session)
    return out / "policy.npz"


def _begin(out: Path, asked: dict[str, Any], workers: int) -> Session:
    """Enter a new session into training.json. Raises InputError for a folder of another
    training.
    """
    file = out / "training.json"
    kept = read_json(file) if file.is_file() else {}
    if asked["seed"] is None:
        asked["seed"] = kept.get("seed", 0)
    asked["settings"] = settings_of(asked["task"])
    for name, value in asked.items():
        if kept and kept.get(name) != value:
            raise InputError(
                f"holds another training, of {name} {kept.get(name)}",
                file=out,
                field="--out",
                allowed="a new folder",
            )
    sessions = [*kept.get("sessions", []), {"workers": workers}]
    write_json(file, {**asked, "sessions": sessions})
    return Session(out, asked["task"], asked["seed"], len(sessions) - 1, workers, asked["options"])


def _learn(kit: Any, session: Session, steps: int, progress: Progress | None) -> None:
    """Train the library's model, round by round, until `steps` steps are done in all.

    policy.zip is written in any case; a checkpoint by whole rounds alone.
    """
    import torch

    torch.set_num_threads(1)
    envs = _environments(session)
    try:
        last = latest(session.out)
        done = 0 if last is None else _steps(last)
        while True:
            model = _model(kit, session, envs, done)
            try:
                if done < steps:
                    end = min(done + _round_steps(session), steps)
                    report = _reporter(progress)
                    model.learn(end - done, callback=report, reset_num_timesteps=False)
            finally:
                _save(model, session.out / "policy.zip")
            done = int(model.num_timesteps)
            if done:
                _save(model, session.out / "checkpoints" / f"policy_{done}_steps.zip")
            if done >= steps:
                return
    finally:
        envs.close()


def _environments(session: Session) -> Any:
    """The training's environments: on a cluster, in processes, or in this one."""
    from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv

    makers = [partial(_worker, session, k) for k in range(session.workers)]
    if session.cluster is not None:
        from testbed.envs.cluster import ClusterEnvs

        return ClusterEnvs(session.cluster, makers)
    return SubprocVecEnv(makers) if session.workers > 1 else DummyVecEnv(makers)


def _round_steps(session: Session) -> int:
    """Steps of a round: whole rollouts of all workers."""
    rollout = int(settings_of(session.task).get("n_steps", 2048)) * session.workers
    return -(-ROUND_STEPS // rollout) * rollout


def _model(kit: Any, session: Session, envs: Any, done: int) -> Any:
    """The library's model at the beginning of the round after so many steps."""
    model = kit.PPO(
        "MlpPolicy",
        envs,
        seed=session.seed_at(done),
        device="cpu",
        tensorboard_log=_tensorboard(session.out),
        **settings_of(session.task),
    )
    if model.tensorboard_log is None:
        from stable_baselines3.common.logger import Logger

        model.set_logger(Logger(None, []))  # the library's own leaves a folder in /tmp behind
    last = latest(session.out)
    if last is not None:
        _take_over(model, last)
    return model


def _save(model: Any, file: Path) -> None:
    """The library's model in a file, whole or not at all."""
    file.parent.mkdir(exist_ok=True)
    with whole(file) as hidden:
        model.save(hidden)


def _worker(session: Session, number: int) -> Any:
    """One environment with its file of episodes. In a process of its own it leaves Ctrl-C to the
    parent.
    """
    from multiprocessing import parent_process

    import gymnasium
    from stable_baselines3.common.monitor import Monitor

    if parent_process() is not None and current_thread() is main_thread():
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    file = session.episodes(number)
    file.parent.mkdir(parents=True, exist_ok=True)
    env = gymnasium.make(f"testbed.envs:{named(session.task)}", **session.options)
    return Monitor(env, str(file))


def _write_policy(session: Session) -> None:
    """The last policy as plain arrays, where there is one."""
    file = session.out / "policy.zip"
    if file.is_file():
        arrays = actor(read_tensors(file, WEIGHTS))
        made_by = f"testbed train {session.task} --seed {session.seed} --workers {session.workers}"
        write_network(session.out / "policy.npz", arrays, made_by=made_by, task=session.task)


def _take_over(model: Any, checkpoint: Path) -> None:
    """Give a new model the weights, the optimiser's state and the number of steps of a checkpoint:
    tensors alone.
    """
    try:
        model.policy.load_state_dict(read_tensors(checkpoint, WEIGHTS))
        model.policy.optimizer.load_state_dict(read_tensors(checkpoint, OPTIMISER))
    except (RuntimeError, ValueError, KeyError) as error:
        raise InputError("is of another training", file=checkpoint, field="--out") from error
    model.num_timesteps = _steps(checkpoint)


def _tensorboard(out: Path) -> str | None:
    return str(out / "tensorboard") if importlib.util.find_spec("tensorboard") else None


def latest(out: Path) -> Path | None:
    """The whole checkpoint with the most steps, None if there is none. What a killed process was
    still writing is hidden, and may look like a whole archive: the parts in it are archives too.
    """
    found = [p for p in (out / "checkpoints").glob("[!.]*_steps.zip") if _steps(p) > 0]
    found = sorted(found, key=_steps, reverse=True)
    return next((checkpoint for checkpoint in found if _is_whole(checkpoint)), None)


def _is_whole(checkpoint: Path) -> bool:
    try:
        with zipfile.ZipFile(checkpoint) as archive:
            return {WEIGHTS, OPTIMISER} <= set(archive.namelist())
    except (OSError, zipfile.BadZipFile):
        return False


def _steps(checkpoint: Path) -> int:
    """How many steps a checkpoint has behind it, by its name; 0 for another name."""
    found = re.search(r"_(\d+)_steps", checkpoint.name)
    return int(found[1]) if found else 0


def _reporter(progress: Progress | None) -> Any:
    from stable_baselines3.common.callbacks import BaseCallback

    class Report(BaseCallback):  # type: ignore[misc]
        """Tells the number of steps done."""

        def _on_step(self) -> bool:
            if progress is not None:
                progress(int(self.num_timesteps))
            return True

    return Report()
