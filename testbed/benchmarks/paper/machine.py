"""Which machine the paper's experiments run on: the default one, another set of numbers, or one
with changes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from functools import lru_cache, wraps
from typing import Any, ParamSpec, TypeVar

from testbed.machine.build import build_machine
from testbed.machine.model import Machine
from testbed.machine.provenance import DEFAULT, SetName

P = ParamSpec("P")
R = TypeVar("R")


@dataclass(frozen=True)
class Chosen:
    """A set of the machine's numbers, and changes of it by path."""

    of_set: SetName = DEFAULT
    changes: tuple[tuple[str, float], ...] = ()

    def machine(self, more: Mapping[str, float] | None = None) -> Machine:
        """The machine, with more changes."""
        return build_machine(dict(self.changes) | dict(more or {}), of_set=self.of_set)


_DEFAULT = Chosen()
_CHOSEN: ContextVar[Chosen] = ContextVar("the machine of the experiments", default=_DEFAULT)


def chosen() -> Chosen:
    """What experiments run on now."""
    return _CHOSEN.get()


@contextmanager
def _now(choice: Chosen) -> Iterator[None]:
    token = _CHOSEN.set(choice)
    try:
        yield
    finally:
        _CHOSEN.reset(token)


def changed(by: Mapping[str, float]) -> AbstractContextManager[None]:
    """Context: experiments inside run on the machine with these changes."""
    return _now(replace(chosen(), changes=tuple(sorted(by.items()))))


def of_set(name: SetName) -> AbstractContextManager[None]:
    """Context: experiments inside run on another set of numbers."""
    return _now(Chosen(name))


def once_per_machine(function: Callable[P, R]) -> Callable[P, R]:
    """Remember a function's results, for each machine by itself."""

    @lru_cache(maxsize=32)
    def remembered(_machine: Any, args: tuple[Any, ...], named: tuple[tuple[str, Any], ...]) -> Any:
        return function(*args, **dict(named))

    @wraps(function)
    def call(*args: P.args, **named: P.kwargs) -> R:
        found: R = remembered(chosen(), args, tuple(sorted(named.items())))
        return found

    return call
