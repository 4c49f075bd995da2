"""The one place where a machine is built: the numbers of roboclimber.yaml, followed by what a URDF says, then changes.

Everything else gets its machine handed in. `testbed.scenario.machines` builds the two of a scenario, the world's and
the model's; recordings, benchmarks and the command line build theirs here.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from testbed import resources
from testbed.machine.model import SHIPPED, Machine
from testbed.machine.provenance import read_quantities

Changes = Mapping[str, Any]


def build_machine(
    changes: Changes | None = None,
    *,
    urdf: str | Path | None = None,
    file: str | Path = SHIPPED,
    section: str = "",
) -> Machine:
    """The drawing-board machine, or that of another URDF, with some numbers changed by path.

    Raises InputError, naming `section` of `file`, for a path or value that cannot be, and for a URDF that cannot be.
    """
    machine = _shipped() if urdf is None else _shipped().with_urdf(Path(urdf))
    return machine.replaced(changes or {}, file, section)


@lru_cache(maxsize=1)
def _shipped() -> Machine:
    quantities = read_quantities(Path(__file__).with_name(SHIPPED))
    return Machine.of(quantities, resources.urdf())
