"""Trained policies as they are opened: arrays only, so that nothing in a file can run code.

A `policy.zip` of the library holds weights beside pickled objects; the weights alone are taken from
it, with PyTorch's own reader that builds nothing but tensors.
"""

from __future__ import annotations

import io
import warnings
import zipfile
from pathlib import Path
from typing import Any, cast

import numpy as np

from testbed.envs import ENVIRONMENTS, named
from testbed.errors import InputError, extra
from testbed.formats.files import read_json
from testbed.formats.networks import Network, network, read_network
from testbed.simulation.video import Video

ALLOWED = "a policy.npz or policy.zip of `testbed train`"
WEIGHTS, OPTIMISER = "policy.pth", "policy.optimizer.pth"


def read_policy(policy: Path) -> tuple[str, Network]:
    """The task that a policy was trained for, and its network.

    Raises InputError for a file that is no policy; of a .zip where PyTorch is not installed, too.
    """
    if policy.suffix == ".npz":
        found, words = read_network(policy)
        if "task" not in words:
            raise InputError("says no task", file=policy, field="task", allowed=ALLOWED)
        return words["task"], found
    training = policy.with_name("training.json")
    state = read_tensors(policy, WEIGHTS)
    return str(read_json(training).get("task")), network(actor(state), policy)


def actor(state: Any) -> dict[str, Any]:
    """Weights and biases of the actor, single precision, of the library's tensors by name."""
    layers = sorted(name[:-7] for name in state if name.startswith("mlp_extractor.policy_net."))
    names = [name for name in layers if f"{name}.weight" in state]
    names += ["action_net"] if "action_net.weight" in state else []
    return {
        f"{word}_{index}": state[f"{name}.{word}"].detach().cpu().numpy()
        for index, name in enumerate(names)
        for word in ("weight", "bias")
    }


def read_tensors(file: Path, part: str) -> Any:
    """The tensors by name of one part of a .zip of the library, and no other object.

    Raises InputError for a file that holds no such part, or more in it than tensors.
    """
    if not file.is_file():
        problem = "is not a file" if file.exists() else "no such file"
        raise InputError(problem, file=file, allowed=ALLOWED)
    if not zipfile.is_zipfile(file):
        raise InputError("is no policy", file=file, allowed=ALLOWED)
    torch = extra("torch", "rl", file=file)
    try:
        with zipfile.ZipFile(file) as archive:
            inside = io.BytesIO(archive.read(part))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what it thinks of a file that is refused below
            return torch.load(inside, map_location="cpu", weights_only=True)
    except Exception as error:  # PyTorch raises what it meets: pickle's, its own, the archive's
        raise InputError(
            f"is no policy: it has no safe {part}", file=file, allowed=ALLOWED
        ) from error


# Let a trained policy act for one episode.


def play(
    policy: Path, scenario: str, seed: int = 0, gui: bool = False, video: Path | None = None
) -> dict[str, Any]:
    """One episode of a policy on a scenario as it is written, to its end, at the rates of the
    policy's environment; `video`: a .mp4, .gif or .webp of it.

    Raises InputError for a file that is no policy or another task's, and for a video that cannot be
    written.
    """
    import gymnasium

    task, network = read_policy(policy)
    film = Video(video) if video is not None else None
    mode = "human" if gui else "rgb_array" if video is not None else None
    own = ENVIRONMENTS[named(task, "task")][1].get("overrides", ())
    env = gymnasium.make(
        named(task, "task"),
        scenario=scenario,
        overrides=[change for change in own if change.startswith("rates.")],
        duration_s=None,
        randomisation=None,
        render_mode=mode,
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
