"""Trained policies as they are opened: arrays only, so that nothing in a file can run code.

A `policy.zip` of the library holds weights beside pickled objects; the weights alone are taken from
it, with PyTorch's own reader that builds nothing but tensors.
"""

from __future__ import annotations

import io
import warnings
import zipfile
from pathlib import Path
from typing import Any

from testbed.errors import InputError, extra
from testbed.formats.files import read_json
from testbed.formats.networks import Network, network, read_network

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
    torch = extra("torch", "rl", file=file)
    if not file.is_file():
        raise InputError("no such file", file=file, allowed=ALLOWED)
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
