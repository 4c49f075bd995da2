"""Sets of numbers inferred from a figure of the paper: changes of roboclimber.yaml by name."""

from __future__ import annotations

from pathlib import Path

from testbed.machine.provenance import read_parameters, roboclimber


def inferred(*names: str) -> dict[str, float]:
    """Changes (dotted path of roboclimber.yaml -> SI value) of the sets `names` of inferred.yaml; all for none.

    Raises InputError for a set or a parameter that there is not.
    """
    sets = read_parameters(Path(__file__).with_name("inferred.yaml"))
    out: dict[str, float] = {}
    for name in names or tuple(sets):
        for path, quantity in sets.group(name).leaves():
            roboclimber().quantity(path)  # there is such a number
            out[path] = quantity.value
    return out
