"""What every scalar filter is made of: a compiled step over one sample, and that step over an
array.

A filter is a file: `Numbers` (its constants) and a compiled `step(state, z, numbers) -> x`, which
takes one sample z (N) and changes its state in place. `run = over(step, State, Numbers)` filters an
array.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from testbed.compiled import njit_over
from testbed.formats.arrays import Array
from testbed.formats.records import Record

Run = Callable[..., Array]


step: Any = None
"""In `_loop`, the filter's own."""


def _loop(state: Any, z: Any, numbers: Any, x: Any) -> None:
    for index in range(z.size):
        x[index] = step(state[0], z[index], numbers[0])


def over(step: Any, state: type[Record], numbers: type[Record]) -> Run:
    """`run(z, **numbers) -> x`: a step over z (n,) in N, starting from nothing, with its constants
    by name.
    """
    compiled = njit_over(_loop, step)

    def run(z: Array, **constants: float) -> Array:
        x = np.empty(z.size)
        compiled(state.zeros(), z, numbers.one(**constants), x)
        return x

    return run
