"""Nothing is accepted without effect: every number of the machine, changed, changes a run or is
refused.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from perturbed import Run, changes_recording
from shipped import MACHINE

from testbed.diagnosis.robot.rig import through_amplifier
from testbed.errors import InputError
from testbed.estimation.live.believed import Believed
from testbed.estimation.live.chain import NEEDED, rows_of
from testbed.machine.model import AXIS_GROUPS, shared_path
from testbed.world.hydraulic_parameters import axis_parameters

HERE = Path(__file__).parent
AXES, LEGS = ("fl_vertical", "rr_radial", "fr_rotation"), ("fl", "rr")
"""Those whose own numbers are tried: one axis of each joint, one leg of each end."""
SECTIONS = ("hydraulics", "model")


@lru_cache(maxsize=1)
def _plan() -> dict[str, Any]:
    return dict(yaml.safe_load((HERE / "every_number.yaml").read_text()))


def _runs(number: str) -> list[Run]:
    """The runs in which a shared number may matter, the likeliest first."""
    plan = _plan()
    names = next(runs for pattern, runs in plan["runs_for"] if re.fullmatch(pattern, number))
    fill = {"{tests}": str(HERE.parent)}
    found = []
    for name in names:
        changes = plan["runs"][name]["changes"]
        for mark, text in (*fill.items(), ("{run}", name)):
            changes = [change.replace(mark, text) for change in changes]
        found.append((plan["runs"][name]["scenario"], tuple(changes)))
    return found


def _other(section: str, number: str) -> str:
    """Another value of a shared number, as YAML."""
    value = MACHINE.quantity(number).value
    if number in _plan()["values"][section]:
        return json.dumps(_plan()["values"][section][number])
    if isinstance(value, tuple):
        return json.dumps([1.03 * v + 1e-3 for v in value])
    return json.dumps(1.03 * value if value else 0.01)


def _shared() -> list[str]:
    return [path for path, _ in MACHINE.leaves()]


def _own() -> list[str]:
    """Paths of single axes' and legs' numbers."""
    paths = [
        f"axes.{axis}.{group}.{name}"
        for axis in AXES
        for group in AXIS_GROUPS
        for name in type(getattr(MACHINE.axes[axis], group)).model_fields
    ]
    paths += [f"each_leg.{leg}.{name}" for leg in LEGS for name in type(MACHINE.legs).model_fields]
    parts = _plan()["parts_of_an_axis"]
    known = set(_shared())
    return [p for p in paths if shared_path(p) in known and p.rpartition(".")[2] not in parts]


def _fates(section: str, paths: Iterable[str]) -> dict[str, list[str]]:
    """Which numbers change a run, which are refused and which are idle."""
    fates: dict[str, list[str]] = {"changed": [], "refused": [], "idle": []}
    for path in paths:
        number = shared_path(path) or path
        change = f"{section}.parameters.{path}={_other(section, number)}"
        try:
            moved = any(changes_recording(run, change) for run in _runs(number))
        except InputError as error:
            assert "would have no effect" in str(error), f"{path}: {error}"
            fates["refused"].append(path)
            continue
        fates["changed" if moved else "idle"].append(path)
    return fates


def _allowed_idle(section: str, paths: Iterable[str]) -> list[str]:
    over = _plan()["over_recordings"] if section == "model" else {}
    return [path for path in paths if (shared_path(path) or path) in over]


@pytest.mark.long
@pytest.mark.parametrize("section", SECTIONS)
@pytest.mark.parametrize(("paths", "least"), [(_shared(), 85), (_own(), 90)], ids=["shared", "own"])
def test_every_number_changes_a_run_or_is_refused(
    section: str, paths: list[str], least: int
) -> None:
    fates = _fates(section, paths)
    idle = [p for p in fates["idle"] if p not in _allowed_idle(section, paths)]
    assert not idle
    assert len(fates["changed"]) >= least and len(fates["refused"]) > 50


@pytest.mark.parametrize("section", SECTIONS)
def test_a_sample_of_numbers_changes_a_run_or_is_refused(section: str) -> None:
    """A few numbers, so that a new one without effect may be seen early."""
    paths = [*_shared(), *_own()][::127]
    fates = _fates(section, paths)
    assert not [p for p in fates["idle"] if p not in _allowed_idle(section, paths)]
    assert fates["changed"]


@pytest.mark.parametrize("number", _plan()["parts_of_an_axis"])
def test_an_axis_has_a_load_holding_valve_of_its_own(number: str) -> None:
    other = axis_parameters(MACHINE.replaced({f"axes.fr_radial.valve.{number}": 2}))
    differs = [a != b for a, b in zip(other, axis_parameters(MACHINE), strict=True)]
    assert [list(MACHINE.axes)[k] for k in np.flatnonzero(differs)] == ["fr_radial"]


@pytest.mark.parametrize("number", ["amplifier_lag_s", "hysteresis"])
def test_what_reaches_the_spool_of_a_recorded_command_follows_the_belief(number: str) -> None:
    time_s = np.arange(0.0, 1.0, 1e-3)
    command = 0.2 * np.sin(6.0 * time_s)
    other = MACHINE.replaced({f"axes.fl_vertical.valve.{number}": 0.01}).axes
    spools = [
        through_amplifier(command, time_s, other[axis].valve)
        for axis in ("fl_vertical", "fr_vertical")
    ]
    assert np.abs(spools[0] - spools[1]).max() > 1e-3


def test_the_believed_supply_pressure_stands_in_where_none_was_recorded() -> None:
    columns = dict.fromkeys(NEEDED, np.zeros(3))
    for kind, ready in ((0.0, 8.0e6), (1.0, 2.1e6)):
        numbers = {"supply_kind": kind, "supply_pressure_pa": 8.0e6, "standby_pressure_pa": 2.1e6}
        machine = MACHINE.replaced({f"power_unit.{name}": v for name, v in numbers.items()})
        rows = rows_of(columns, Believed.from_machine(machine, 1e-3))
        assert (rows["supply_pressure"] == ready).all()
