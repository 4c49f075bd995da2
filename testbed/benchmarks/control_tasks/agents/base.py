"""What an agent is: it is told an observation, and says an action."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from testbed.control.gait import Observed
from testbed.envs.observations import in_units
from testbed.formats.networks import Network

Vector = NDArray[np.float32]


class Agent(Protocol):
    """Acts for one episode."""

    def act(self, observation: Vector) -> Vector:
        """An action in [-1, 1] of a flat observation."""
        ...


class Constant:
    """The same action all the time."""

    def __init__(self, action: Sequence[float] | Vector) -> None:
        self._action = np.asarray(action, dtype=np.float32)

    def act(self, observation: Vector) -> Vector:
        """See Agent."""
        del observation
        return self._action.copy()


class Trained:
    """A policy of `testbed train`."""

    def __init__(self, network: Network) -> None:
        self._network = network

    def act(self, observation: Vector) -> Vector:
        """See Agent."""
        return self._network.answer(observation.astype(float)).astype(np.float32)


class Readings:
    """A flat observation's rows by name, in their units."""

    def __init__(self, observation: Vector, table: Sequence[Observed]) -> None:
        self._values = in_units(observation, table)

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def each(self, name: str, labels: Sequence[str]) -> NDArray[Any]:
        """Rows `name_label` of all labels, as a vector."""
        return np.array([self._values[f"{name}_{label}"] for label in labels])
