"""Which machine the paper's experiments run on: the declared one, or one with the numbers inferred from a figure."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from functools import lru_cache, wraps
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")
_CHANGES: ContextVar[tuple[tuple[str, float], ...]] = ContextVar(
    "changes of the machine", default=()
)


def changes() -> dict[str, float]:
    """Changes of roboclimber.yaml that hold now."""
    return dict(_CHANGES.get())


@contextmanager
def changed(by: Mapping[str, float]) -> Iterator[None]:
    """Experiments inside run on the machine with these changes."""
    token = _CHANGES.set(tuple(sorted(by.items())))
    try:
        yield
    finally:
        _CHANGES.reset(token)


def once_per_machine(function: Callable[P, R]) -> Callable[P, R]:
    """Remember a function's results, for each machine by itself."""

    @lru_cache(maxsize=32)
    def remembered(_machine: Any, args: tuple[Any, ...], named: tuple[tuple[str, Any], ...]) -> Any:
        return function(*args, **dict(named))

    @wraps(function)
    def call(*args: P.args, **named: P.kwargs) -> R:
        found: R = remembered(_CHANGES.get(), args, tuple(sorted(named.items())))
        return found

    return call
