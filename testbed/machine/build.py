"""The one place where a machine is built: the numbers of a set, then what its URDF says, then
changes.

Everything else gets its machine handed in. `testbed.scenario.machines` builds the two of a
scenario, the world's and the model's; recordings, benchmarks and the command line build theirs
here.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from testbed import resources
from testbed.errors import InputError
from testbed.machine.folder import NUMBERS, bodies_of_folder, drawing_board, own_numbers
from testbed.machine.frame_groups import SlideLinkage
from testbed.machine.model import SHIPPED, Machine, shared_path
from testbed.machine.names import GRAVITY_M_S2, LEGS
from testbed.machine.provenance import DEFAULT, SetName, machine_set, read_quantities
from testbed.machine.urdf_geometry import differing, urdf_numbers

HOW_TO_AGREE = (
    "no number, or a URDF that says so: `testbed machine FOLDER --draw` draws one, "
    "with strokes by joints.*.upper_m"
)
ALIKE = 1e-9
"""Changes that differ by less are the same."""

Changes = Mapping[str, Any]


def build_machine(
    changes: Changes | None = None,
    *,
    urdf: str | Path | None = None,
    folder: str | Path | None = None,
    file: str | Path = SHIPPED,
    section: str = "",
    of_set: SetName = DEFAULT,
) -> Machine:
    """The drawing-board machine of a set, that of a folder or that of another URDF, with some
    numbers changed by path.

    Raises InputError, naming `section` of `file`, for a path or value that cannot be, and for a
    URDF that cannot be followed.
    """
    machine = _shipped(of_set) if folder is None else _of_folder(Path(folder))
    if urdf is not None:
        machine = following(machine, Path(urdf))
    changed = machine.replaced(changes or {}, file, section)
    _check_weight(changed, machine.power_unit.supply_pressure_pa)
    return changed


def _check_weight(machine: Machine, supply_pa: float) -> None:
    """Refuse a machine that its own vertical cylinders could not lift off the level ground, at the
    supply that it has or had before a scenario changed it.
    """
    supply_pa = max(supply_pa, machine.power_unit.supply_pressure_pa)
    push_n = 0.0
    for leg in LEGS:
        axis = machine.axes[f"{leg}_vertical"]
        assert isinstance(axis.linkage, SlideLinkage)
        push_n += axis.linkage.ratio * supply_pa * math.pi / 4.0 * axis.cylinder.bore_m**2
    if machine.total_mass_kg * GRAVITY_M_S2 > push_n:
        raise InputError(
            f"its four vertical cylinders could not lift it: {push_n / 1e3:.4g} kN at "
            f"{supply_pa / 1e5:.4g} bar",
            file=machine.urdf,
            field="total mass",
            value=f"{machine.total_mass_kg:.6g} kg",
            allowed=f"at most {push_n / GRAVITY_M_S2:.5g} kg, or larger bores",
        )


def following(machine: Machine, urdf: Path) -> Machine:
    """The machine with another URDF and the numbers that it gives. Raises InputError for legs of
    another plan.
    """
    changes = _shared(_read_from(machine, urdf))
    return machine.with_urdf(urdf).replaced(changes, urdf, source=f"read from {urdf.name}")


def _read_from(machine: Machine, urdf: Path) -> dict[str, Any]:
    """What a URDF says otherwise than the machine's numbers."""
    found = urdf_numbers(urdf)
    return differing(found, {path: machine.quantity(path).value for path in found})


def _shared(changes: Changes) -> dict[str, Any]:
    """Changes that are the same for all legs, or all cylinders of a joint, as one of the path that
    they share.
    """
    out: dict[str, Any] = {}
    alike: dict[str, list[str]] = {}
    for path in changes:
        alike.setdefault(shared_path(path) or path, []).append(path)
    for shared, paths in alike.items():
        first = changes[paths[0]]
        if len(paths) == 4 and all(
            np.allclose(changes[path], first, rtol=0.0, atol=ALIKE) for path in paths
        ):
            out[shared] = first
        else:
            out |= {path: changes[path] for path in paths}
    return out


def _of_folder(folder: Path) -> Machine:
    """The machine of a folder: its numbers, then what its URDF says.

    Raises InputError for a number of its own that its URDF overrules.
    """
    machine, urdf = drawing_board(folder), bodies_of_folder(folder)
    own = own_numbers(folder)
    for path, value in _read_from(machine, urdf).items():
        name = next((name for name in (path, shared_path(path)) if name in own), None)
        if name is not None:
            raise InputError(
                f"would have no effect: {urdf.name} says {_rounded(value)}",
                file=folder / NUMBERS,
                field=f"numbers.{name}",
                value=own[name].value,
                allowed=HOW_TO_AGREE,
            )
    return following(machine, urdf)


def _rounded(value: Any) -> Any:
    """Numbers as a person reads them, without what turning a frame left."""
    if isinstance(value, tuple):
        return tuple(_rounded(number) for number in value)
    return round(value, 9) + 0.0


@lru_cache(maxsize=4)
def _shipped(of_set: SetName) -> Machine:
    quantities = read_quantities(Path(__file__).with_name(SHIPPED))
    return Machine.of(quantities | machine_set(of_set), resources.urdf())
