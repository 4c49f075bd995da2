"""Sets of numbers under which the machine can be had: the default one, and others that differ from
it by name.

`inferred` is roboclimber.yaml itself: the circuit under which the paper's figures hold together
(its numbers say which figure they come from). sets.yaml lists by what the others differ: `original`
the circuit declared before, `overlapped` valves without feedback of their spools.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Literal, get_args

from testbed.machine.provenance import Quantity, read_quantities

SetName = Literal["inferred", "original", "overlapped"]
SET_NAMES: tuple[SetName, ...] = get_args(SetName)
DEFAULT: SetName = "inferred"


@lru_cache(maxsize=4)
def machine_set(name: SetName) -> dict[str, Quantity]:
    """By what the set differs from roboclimber.yaml: dotted path -> quantity; empty for the default
    one.
    """
    quantities = read_quantities(Path(__file__).with_name("sets.yaml"))
    prefix = f"{name}."
    return {
        key.removeprefix(prefix): quantity
        for key, quantity in quantities.items()
        if key.startswith(prefix)
    }
