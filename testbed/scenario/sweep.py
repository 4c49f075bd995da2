"""Sweep files: one scenario, many changes of it, each with every seed, checked before the first run begins."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from testbed.errors import InputError
from testbed.formats.checked import Checked, Sequence, checked
from testbed.formats.yaml_files import read_yaml
from testbed.resources import sweep as sweep_path
from testbed.scenario.scenario import Scenario, load_scenario

MOST_RUNS = 100_000
LONGEST_LABEL = 60
Changes = dict[str, Any]


class Sweep(Checked):
    """A sweep file: runs = entries of `list` x combinations of `grid` x seeds."""

    format: Literal["roboclimber-sweep/1"] = Field(description="format of the file")
    description: str = Field(default="", description="what it is for")
    scenario: str = Field(
        description="scenario file (relative to this one), or the name of a shipped one"
    )
    duration_s: float | None = Field(
        default=None, gt=0, le=36000, description="instead of the scenario's [s]"
    )
    seeds: Annotated[tuple[int, ...], Sequence] = Field(
        default=(1,), min_length=1, description="every run is made with each of them"
    )
    set: Changes = Field(default_factory=dict, description="dotted path -> value, for all runs")
    grid: dict[str, Annotated[tuple[Any, ...], Sequence]] = Field(
        default_factory=dict, description="dotted path -> values; every combination is run"
    )
    list: Annotated[tuple[Changes, ...], Sequence] = Field(
        default=({},), min_length=1, description="changes that go together: dotted path -> value"
    )
    keep: Literal["all", "summary"] = Field(
        default="all",
        description="summary: series and pictures are removed once a run is summed up",
    )


@dataclass(frozen=True)
class SweepRun:
    """One run of a sweep: what was changed and the checked scenario."""

    changes: Changes
    scenario: Scenario

    @property
    def name(self) -> str:
        """Its folder: the changes in words, the seed, and a mark of everything in the scenario."""
        words = [f"{path.rpartition('.')[2]}-{value}" for path, value in self.changes.items()]
        label = re.sub(r"[^A-Za-z0-9.-]+", "_", "_".join(words))[:LONGEST_LABEL].strip("_.")
        text = json.dumps(self.scenario.model_dump(mode="json"), sort_keys=True)
        mark = hashlib.sha256(text.encode()).hexdigest()[:8]
        return "_".join(part for part in (label, f"seed-{self.scenario.seed}", mark) if part)


def load_sweep(path_or_name: str | Path) -> tuple[Sweep, list[SweepRun]]:
    """Read a sweep file (or a shipped one by name) and all its runs; identical ones count once.

    Raises InputError (file, field, value, what is allowed) for anything that cannot be used, in any of the runs.
    """
    path = sweep_path(path_or_name)
    tree = read_yaml(path)
    if isinstance(tree, dict) and tree.get("grid"):
        _check_grid(tree["grid"], path)
    sweep = checked(Sweep, tree, path)
    _check_paths(sweep, path)
    count = len(sweep.seeds) * len(sweep.list)
    for values in sweep.grid.values():
        count *= len(values)
    if count > MOST_RUNS:
        raise InputError(
            "asks for too many runs",
            file=path,
            value=count,
            field="runs",
            allowed=f"at most {MOST_RUNS}",
        )
    beside = path.parent / sweep.scenario
    scenario = beside if beside.is_file() else Path(sweep.scenario)
    runs: dict[str, SweepRun] = {}
    for changes, seed in product(_combinations(sweep), sweep.seeds):
        given = [f"{key}={json.dumps(value)}" for key, value in {**sweep.set, **changes}.items()]
        try:
            run = SweepRun(changes, load_scenario(scenario, given, seed, sweep.duration_s))
        except InputError as error:
            raise InputError(f"{_shown(changes, seed)}: {error}", file=path) from error
        runs.setdefault(run.name, run)
    return sweep, list(runs.values())


def _check_grid(grid: Any, path: Path) -> None:
    for key, values in grid.items() if isinstance(grid, dict) else ():
        if not isinstance(values, list) or not values:
            raise InputError(
                "cannot be used",
                file=path,
                field=f"grid.{key}",
                value=values,
                allowed="a list of values",
            )


def _check_paths(sweep: Sweep, path: Path) -> None:
    """Refuse a change of what the file says elsewhere for every run: no run would be made with it."""
    everywhere = {"seed": "seeds: the seeds of every run"}
    if sweep.duration_s is not None:
        everywhere["duration_s"] = "duration_s in one place, for all runs or here"
    by_grid = dict.fromkeys(sweep.grid, "grid or here, not both")
    in_every_entry = set.intersection(*(set(changes) for changes in sweep.list))
    by_list = dict.fromkeys(in_every_entry, "list or here, not both")
    _refuse("set", sweep.set, by_list | by_grid | everywhere, path)
    _refuse("grid", sweep.grid, everywhere, path)
    for number, changes in enumerate(sweep.list):
        _refuse(f"list.{number}", changes, by_grid | everywhere, path)


def _refuse(section: str, changes: Changes, elsewhere: dict[str, str], path: Path) -> None:
    """Raise InputError for the first change whose path is ruled elsewhere."""
    for key, value in changes.items():
        if key.strip() in elsewhere:
            raise InputError(
                "would have no effect",
                file=path,
                field=f"{section}.{key}",
                value=value,
                allowed=elsewhere[key.strip()],
            )


def _combinations(sweep: Sweep) -> Iterator[Changes]:
    for together in sweep.list:
        for values in product(*sweep.grid.values()):
            yield {**together, **dict(zip(sweep.grid, values, strict=True))}


def _shown(changes: Changes, seed: int) -> str:
    return ", ".join([*(f"{key}={value}" for key, value in changes.items()), f"seed {seed}"])
