"""Small networks as plain arrays: tanh between the layers, nothing after the last, answers clipped
to [-1, 1].

    answer = clip(W_n tanh(... tanh(W_0 view + b_0) ...) + b_n, -1, 1)

The file (.npz) holds weight_0, bias_0, weight_1, ... and words on where they come from. Arrays of
objects, which could run code when they are read, are refused.
"""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.formats.files import whole

MOST_BYTES = 64_000_000
ALLOWED = "a policy.npz of `testbed train`"


@dataclass(frozen=True, eq=False)
class Network:
    """Weights (outputs, inputs) and biases (outputs,) of each layer, the first one first."""

    layers: tuple[tuple[Array, Array], ...]

    @property
    def inputs(self) -> int:
        """Length of what it looks at."""
        return int(self.layers[0][0].shape[1])

    @property
    def outputs(self) -> int:
        """Length of its answer."""
        return int(self.layers[-1][0].shape[0])

    def answer(self, view: Array) -> Array:
        """(outputs,) in [-1, 1] of a view (inputs,)."""
        found = np.asarray(view, dtype=float)
        for weight, bias in self.layers[:-1]:
            found = np.tanh(weight @ found + bias)
        weight, bias = self.layers[-1]
        answer: Array = np.clip(weight @ found + bias, -1.0, 1.0)
        return answer


def network(arrays: Mapping[str, Any], file: str | Path) -> Network:
    """The network of weight_0, bias_0, ... in single or double precision.

    Raises InputError, naming `file` and the array, where one is missing, fits no other or is not
    finite.
    """
    layers: list[tuple[Array, Array]] = []
    for layer in count():
        if layer > 0 and f"weight_{layer}" not in arrays:
            break
        layers.append(
            (_numbers(arrays, f"weight_{layer}", file), _numbers(arrays, f"bias_{layer}", file))
        )
        weight, bias = layers[-1]
        inputs = weight.shape[-1] if layer == 0 else layers[-2][0].shape[0]
        if weight.ndim != 2 or weight.size == 0 or weight.shape[1] != inputs:
            raise InputError("is no policy", file=file, field=f"weight_{layer}", value=weight.shape)
        if bias.shape != weight.shape[:1]:
            raise InputError("is no policy", file=file, field=f"bias_{layer}", value=bias.shape)
    return Network(tuple(layers))


def _numbers(arrays: Mapping[str, Any], name: str, file: str | Path) -> Array:
    if name not in arrays:
        raise InputError("is no policy", file=file, field=name, allowed=ALLOWED)
    found = np.asarray(arrays[name])
    if found.ndim == 0 or found.dtype.kind != "f" or not np.isfinite(found).all():
        raise InputError("is not finite numbers", file=file, field=name, allowed=ALLOWED)
    return found.astype(float)


def read_network(file: Path) -> tuple[Network, dict[str, str]]:
    """The network of an .npz, and its words by name. Raises InputError for a file that holds no
    such network.
    """
    try:
        with zipfile.ZipFile(file) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > MOST_BYTES:
                raise InputError("is too large", file=file, allowed=f"{MOST_BYTES} bytes unpacked")
        with np.load(file, allow_pickle=False) as data:
            arrays = {name: np.asarray(data[name]) for name in data.files}
    except FileNotFoundError as error:
        raise InputError("no such file", file=file, allowed=ALLOWED) from error
    except (OSError, ValueError, KeyError, zipfile.BadZipFile, EOFError, MemoryError) as error:
        raise InputError("is no policy", file=file, allowed=ALLOWED) from error
    words = {name: str(value) for name, value in arrays.items() if value.dtype.kind == "U"}
    return network(arrays, file), words


def write_network(file: Path, arrays: Mapping[str, Any], **words: str) -> None:
    """Write arrays and words as .npz, whole or not at all."""
    everything: dict[str, Any] = {
        **arrays,
        **{name: np.array(word) for name, word in words.items()},
    }
    with whole(file) as hidden:
        np.savez_compressed(hidden, **everything)
