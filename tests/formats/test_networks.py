"""Trained networks are arrays: what could run code, or is none of ours, is refused in one line."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from testbed.errors import InputError
from testbed.formats.networks import network, read_network, write_network

RNG = np.random.default_rng(0)
GOOD: dict[str, Any] = {
    "weight_0": RNG.normal(size=(4, 3)),
    "bias_0": RNG.normal(size=4),
    "weight_1": RNG.normal(size=(2, 4)),
    "bias_1": RNG.normal(size=2),
}


class Evil:
    """Makes a file where it is unpickled."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[Any, tuple[str]]:
        return os.mkdir, (str(self.mark),)


def test_what_is_written_is_read_and_answers_by_the_formula(tmp_path: Path) -> None:
    write_network(tmp_path / "policy.npz", GOOD, task="stand")
    found, words = read_network(tmp_path / "policy.npz")
    view = RNG.normal(size=3)
    hidden = np.tanh(GOOD["weight_0"] @ view + GOOD["bias_0"])
    wanted = np.clip(GOOD["weight_1"] @ hidden + GOOD["bias_1"], -1.0, 1.0)
    assert found.answer(view) == pytest.approx(wanted, abs=1e-12)
    assert (found.inputs, found.outputs, words) == (3, 2, {"task": "stand"})


def test_a_pickled_object_is_refused_and_does_not_run(tmp_path: Path) -> None:
    evil = np.array([Evil(tmp_path / "ran")], dtype=object)
    np.savez(tmp_path / "policy.npz", **{**GOOD, "weight_0": evil})
    with pytest.raises(InputError, match=r"policy\.npz: is no policy"):
        read_network(tmp_path / "policy.npz")
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize(
    "change",
    [
        {"weight_0": np.ones((4, 3), dtype=int)},
        {"weight_0": np.full((4, 3), np.nan)},
        {"weight_0": np.ones(3)},
        {"weight_1": np.ones((2, 5))},
        {"bias_1": np.ones(3)},
        {"bias_0": np.array("words")},
        {"weight_0": np.ones((0, 3)), "bias_0": np.ones(0)},
    ],
    ids=lambda change: " ".join(change),
)
def test_arrays_that_fit_no_network_are_refused(change: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=r"p: (weight|bias)"):
        network({**GOOD, **change}, "p")


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04broken", b"not a zip at all"])
def test_a_broken_file_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "policy.npz").write_bytes(content)
    with pytest.raises(InputError, match=r"policy\.npz: is no policy"):
        read_network(tmp_path / "policy.npz")


def test_a_small_file_that_unpacks_to_gigabytes_is_refused(tmp_path: Path) -> None:
    np.savez_compressed(tmp_path / "policy.npz", **GOOD, more=np.zeros(10_000_000))
    with pytest.raises(InputError, match="is too large"):
        read_network(tmp_path / "policy.npz")
