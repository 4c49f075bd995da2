"""The state of a tree of objects, taken and put into another tree that was built alike."""

from __future__ import annotations

import json
from collections import deque
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np
import pytest

from testbed.errors import InputError
from testbed.formats.snapshot import Snapshot, capture, constants, put_back

constant = constants()


class Mood(Enum):
    CALM = "calm"
    BUSY = "busy"


@dataclass
class Piece:
    size: float = 0.0


@dataclass(frozen=True)
class Order:
    way: np.ndarray


@dataclass
class Machine:
    """Whatever a run may hold: arrays and views, lists, random numbers, parts that come and go."""

    board: np.ndarray = field(default_factory=lambda: np.zeros(2, [("a", "f8"), ("b", "i4", 3)]))
    queue: list[Piece] = field(default_factory=list)
    past: deque[float] = field(default_factory=lambda: deque(maxlen=None))
    mood: Mood = Mood.CALM
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(3))
    order: Order | None = None
    now: Piece | None = None
    counts: dict[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.first = self.board[0]
        self.act = self.work

    def work(self) -> None:
        """Change everything there is."""
        self.first["a"] += self.rng.standard_normal()
        self.board["b"] += 1
        self.now = Piece(float(self.rng.uniform()))
        self.queue = [self.now, Piece(2.0)]
        self.past.append(self.now.size)
        self.mood = Mood.BUSY
        self.order = Order(np.arange(3.0) + self.now.size)
        self.counts["work"] = self.counts.get("work", 0) + 1


def _told(machine: Machine) -> list[Any]:
    """Everything that can be seen of a machine."""
    order = None if machine.order is None else machine.order.way.tolist()
    pieces = [piece.size for piece in machine.queue]
    seen = [machine.board.tobytes(), pieces, list(machine.past), machine.mood, order]
    return [*seen, machine.counts, machine.rng.bit_generator.state]


def _worked(times: int) -> Machine:
    machine = Machine()
    for _ in range(times):
        machine.act()
    return machine


@pytest.mark.parametrize("before", [0, 1, 5])
def test_another_tree_goes_on_as_the_first_one_does(before: int) -> None:
    machine, other = _worked(3), _worked(before)
    put_back(capture(machine, constant), other, constant)
    assert _told(other) == _told(machine)
    for one in (machine, other):
        one.act()
    assert _told(other) == _told(machine)


def test_what_was_shared_is_shared_again_and_views_stay_views() -> None:
    machine, other = _worked(2), Machine()
    put_back(capture(machine, constant), other, constant)
    assert other.queue[0] is other.now
    other.first["a"] = 17.0
    assert other.board["a"][0] == 17.0
    assert machine.board["a"][0] != 17.0


def test_a_state_does_not_change_with_what_it_was_taken_from() -> None:
    machine = _worked(2)
    before, taken = _told(machine), capture(machine, constant)
    machine.act()
    other = Machine()
    put_back(taken, other, constant)
    assert other.board.tobytes() == before[0]


def test_a_state_survives_json() -> None:
    machine, other = _worked(3), Machine()
    taken = capture(machine, constant)
    put_back(Snapshot(json.loads(json.dumps(taken.nodes)), taken.arrays), other, constant)
    assert _told(other) == _told(machine)


def test_what_no_state_can_hold_is_named() -> None:
    machine = Machine()
    machine.now = (n for n in range(3))  # type: ignore[assignment]
    with pytest.raises(InputError, match="now: a generator cannot be saved"):
        capture(machine, constant)


@pytest.mark.parametrize("kind", ["subprocess:Popen", "os:_wrap_close", "builtins:type"])
def test_a_state_cannot_make_objects_of_other_modules(kind: str) -> None:
    taken = capture(Machine(), constant)
    taken.nodes[0]["object"] = kind
    with pytest.raises(InputError, match="no class of this run"):
        put_back(taken, Machine(), constant)
