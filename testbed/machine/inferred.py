"""Sets of numbers inferred from a figure of the paper: changes of roboclimber.yaml by name."""

from __future__ import annotations

from pathlib import Path

from testbed.errors import InputError
from testbed.machine.provenance import read_quantities


def inferred(*names: str) -> dict[str, float]:
    """Changes (dotted path of roboclimber.yaml -> SI value) of the sets `names` of inferred.yaml; all for none.

    Raises InputError for a set that there is not.
    """
    path = Path(__file__).with_name("inferred.yaml")
    sets: dict[str, dict[str, float]] = {}
    for name, quantity in read_quantities(path).items():
        chosen, _, parameter = name.partition(".")
        sets.setdefault(chosen, {})[parameter] = quantity.value
    out: dict[str, float] = {}
    for name in names or tuple(sets):
        if name not in sets:
            raise InputError("no such group", file=path.name, field=name, allowed=", ".join(sets))
        out |= sets[name]
    return out
