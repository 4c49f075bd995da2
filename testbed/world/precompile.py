"""On a cold cache: the kernels between two engine steps, compiled by two processes beside each other.

The first process needs the contact solver to build its world; meanwhile the second compiles parts of the estimator and
the plant into the shared cache. The first goes on with what is left, and finds them there.
"""

from __future__ import annotations

import inspect
import os
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from types import FunctionType, ModuleType, SimpleNamespace
from typing import Any

import numpy as np

from testbed import compiled
from testbed.estimation.live.chain_step import ChainBelief, ChainState
from testbed.estimation.live.whole_body import balance
from testbed.machine.names import AXES
from testbed.recording.rows import DataRow
from testbed.world.between import FEET, MOVE, PLANT, between_steps
from testbed.world.board import Board

Call = tuple[Any, tuple[Any, ...]]
PLANT_KERNELS = ("plant_step",)
"""The second process's share of what the step calls; with `estimator_calls` about half of all work."""
EVERYTHING = 2**20 - 1


def calls(arguments: Sequence[Any]) -> list[Call]:
    """The kernels that between_steps calls when called so, each with its arguments.

    Its Python text runs on copies of `arguments`, with recorders in the kernels' places.
    """
    found: list[Call] = []

    def recorder(value: Any) -> Any:
        if hasattr(value, "py_func"):
            return lambda *given: found.append((value, given))
        if isinstance(value, ModuleType) and value.__name__.startswith("testbed."):
            public = {
                name: recorder(v) for name, v in vars(value).items() if not name.startswith("__")
            }
            return SimpleNamespace(**public)
        return value

    function = between_steps.py_func
    names = {
        name: recorder(function.__globals__[name])
        for name in function.__code__.co_names
        if name in function.__globals__
    }
    copies = [a.copy() if isinstance(a, np.ndarray) else a for a in arguments]
    FunctionType(function.__code__, names | {"__builtins__": __builtins__})(*copies)
    return found


def estimator_calls() -> list[Call]:
    """The kernels apart within the estimator's step."""
    row, belief, state = DataRow.zeros()[0], ChainBelief.zeros()[0], ChainState.zeros()[0]
    return [(balance, (row, np.zeros(len(AXES)), belief["body"], state["body"]))]


def plant_arguments() -> list[Any]:
    """Arguments of between_steps that reach the plant; what the rest would take is left empty."""
    known = {"due": MOVE | FEET | PLANT, "boards": Board.zeros()}
    plain = {"int": 1, "float": 1e-3, "bool": False}
    return [
        known.get(name, plain.get(str(p.annotation)))
        for name, p in inspect.signature(between_steps.py_func).parameters.items()
    ]


def beside() -> subprocess.Popen[bytes] | None:
    """Start the second process, to be waited for before the first step; None if the cache is warm or there is one core.

    If it fails, the first process compiles everything itself.
    """
    if compiled.is_cached(between_steps) or len(os.sched_getaffinity(0)) < 2:
        return None
    quiet = subprocess.DEVNULL
    return subprocess.Popen(
        [sys.executable, "-m", __name__], stdin=quiet, stdout=quiet, stderr=quiet
    )


def finish(process: subprocess.Popen[bytes] | None, arguments: Sequence[Any]) -> None:
    """Compile the first process's share, then wait for the second one; `arguments` of between_steps, flags aside."""
    if process is not None:
        with suppress(Exception):  # what does not compile here is left to the step that needs it
            found = calls([EVERYTHING, *arguments])
            _compile([call for call in found if call[0].py_func.__name__ not in PLANT_KERNELS])
        process.wait()


def _compile(wanted: Sequence[Call]) -> None:
    for kernel, given in wanted:
        with suppress(Exception):
            compiled.compile_for(kernel, *given)


if __name__ == "__main__":
    _compile(estimator_calls())
    _compile(
        [call for call in calls(plant_arguments()) if call[0].py_func.__name__ in PLANT_KERNELS]
    )
