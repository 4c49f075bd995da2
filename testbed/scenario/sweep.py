"""Sweep files: one scenario, many changes of it, each with every seed, checked before the first run
begins.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from testbed.errors import InputError
from testbed.formats.checked import Checked, Pair, Sequence, checked
from testbed.formats.yaml_files import parse_yaml, read_yaml
from testbed.resources import sweep as sweep_path
from testbed.scenario.raw import put
from testbed.scenario.scenario import Scenario, load_scenario

MOST_RUNS = 100_000
MOST_KEPT = 20
"""More runs than these keep their summaries alone, unless the file says otherwise."""
VARIED = re.compile(r"([^=]+)=(?:(.+):(.+):(\d+)|(.+))")
"""path=low:high:samples, or path=value,value,..."""
SPAN = re.compile(r"[-+.\deE]+(:[-+.\deE]+)+")
"""Numbers with colons between them: a span that lacks its samples, and no value."""
LONGEST_LABEL = 60
Changes = dict[str, Any]


class Latin(Checked):
    """A Latin hypercube: every range is cut into as many equal parts as there are samples, each
    part used once.
    """

    samples: int = Field(ge=1, le=MOST_RUNS)
    """number of samples"""
    seed: int = Field(default=0, ge=0)
    """seed of the draw"""
    ranges: dict[str, Pair] = Field(min_length=1)
    """dotted path -> [low, high]; all are drawn together"""

    def drawn(self) -> Iterator[Changes]:
        """The samples, rounded to six digits."""
        from scipy.stats import qmc

        cube = qmc.LatinHypercube(len(self.ranges), rng=self.seed).random(self.samples)
        for row in cube:
            spread = zip(self.ranges.items(), row, strict=True)
            yield {
                path: float(f"{low + u * (high - low):.6g}") for (path, (low, high)), u in spread
            }


class Sweep(Checked):
    """A sweep file: runs = entries of `list` x combinations of `grid` x samples of `latin` x
    seeds.
    """

    format: Literal["roboclimber-sweep/1"]
    """format of the file"""
    description: str = ""
    """what it is for"""
    scenario: str
    """scenario file (relative to this one), or the name of a shipped one"""
    duration_s: float | None = Field(default=None, gt=0, le=90_000)
    """instead of the scenario's [s]"""
    seeds: Annotated[tuple[int, ...], Sequence] = Field(default=(1,), min_length=1)
    """every run is made with each of them"""
    set: Changes = Field(default_factory=dict)
    """dotted path -> value, for all runs"""
    grid: dict[str, Annotated[tuple[Any, ...], Sequence]] = Field(default_factory=dict)
    """dotted path -> values; every combination is run"""
    list: Annotated[tuple[Changes, ...], Sequence] = Field(default=({},), min_length=1)
    """changes that go together: dotted path -> value"""
    latin: Latin | None = None
    """values drawn from ranges"""
    keep: Literal["all", "summary"] | None = None
    """summary: series and pictures are removed once a run is summed up; null: summary above 20 runs

    """

    def keeps_series(self, runs: int) -> bool:
        """Whether so many runs keep their series and pictures."""
        return runs <= MOST_KEPT if self.keep is None else self.keep == "all"


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


@dataclass(frozen=True)
class FromOutside:
    """What a command line changes of every run, as of a single one: `a.b=c` each, the only seed,
    simulated seconds.
    """

    changes: Collection[str] = ()
    seed: int | None = None
    duration_s: float | None = None

    def put_into(self, tree: Any) -> Any:
        """A sweep's tree with these changes. Raises InputError for what is no assignment."""
        if not isinstance(tree, dict):
            return tree
        changed = dict(tree)
        for text in self.changes:
            put({}, text)
            path, _, value = text.partition("=")
            common = changed.get("set") or {}
            changed["set"] = {**common, path.strip(): parse_yaml(value, f"--set {path}")}
        if self.seed is not None:
            changed["seeds"] = [self.seed]
        if self.duration_s is not None:
            changed["duration_s"] = self.duration_s
        return changed


NOTHING = FromOutside()


def load_sweep(
    path_or_name: str | Path, changes: FromOutside = NOTHING
) -> tuple[Sweep, list[SweepRun]]:
    """Read a sweep file (or a shipped one by name) and all its runs; identical ones count once.

    Raises InputError (file, field, value, what is allowed) for anything that cannot be used, in any
    of the runs.
    """
    path = sweep_path(path_or_name)
    return _runs_of(changes.put_into(read_yaml(path)), path)


def sweep_of(
    scenario: str, vary: list[str], changes: FromOutside = NOTHING
) -> tuple[Sweep, list[SweepRun]]:
    """A sweep of a scenario from the command line: `path=a,b,c` is a grid, `path=low:high:samples`
    a Latin hypercube.

    `seed=1,2` are the seeds. Raises InputError as load_sweep does.
    """
    tree: dict[str, Any] = {"format": "roboclimber-sweep/1", "scenario": scenario, "grid": {}}
    for text in vary:
        found = VARIED.fullmatch(text)
        if found is None:
            raise _not_varied(text)
        path, low, high, samples, values = found.groups()
        if values is None:
            latin = tree.setdefault("latin", {"samples": int(samples), "ranges": {}})
            if latin["samples"] != int(samples):
                raise _not_varied(text, f"{latin['samples']} samples, as before")
            latin["ranges"][path.strip()] = [parse_yaml(low, "--vary"), parse_yaml(high, "--vary")]
        elif path.strip() == "seed":
            if changes.seed is not None:
                raise _not_varied(text, "seeds here or --seed, not both")
            tree["seeds"] = parse_yaml(f"[{values}]", "--vary seed")
        elif SPAN.fullmatch(values):
            raise _not_varied(text)
        else:
            tree["grid"][path.strip()] = parse_yaml(f"[{values}]", f"--vary {path}")
    return _runs_of(changes.put_into(tree), Path("--vary"))


def _not_varied(
    text: str, allowed: str = "path=value,value or path=low:high:samples, a whole number of them"
) -> InputError:
    return InputError("cannot be used", field="--vary", value=text, allowed=allowed)


def _runs_of(tree: Any, path: Path) -> tuple[Sweep, list[SweepRun]]:
    """A sweep's tree, checked, and all its runs. `path`: where it comes from."""
    if isinstance(tree, dict) and tree.get("grid"):
        _check_grid(tree["grid"], path)
    sweep = checked(Sweep, tree, path)
    _check_paths(sweep, path)
    count = len(sweep.seeds) * len(sweep.list) * (sweep.latin.samples if sweep.latin else 1)
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
    """Refuse a change of what the file says elsewhere for every run: no run would be made with
    it.
    """
    everywhere = {"seed": "seeds: the seeds of every run"}
    if sweep.duration_s is not None:
        everywhere["duration_s"] = "duration_s in one place, for all runs or here"
    by_grid = dict.fromkeys(sweep.grid, "grid or here, not both")
    in_every_entry = set.intersection(*(set(changes) for changes in sweep.list))
    by_list = dict.fromkeys(in_every_entry, "list or here, not both")
    ranges = sweep.latin.ranges if sweep.latin is not None else {}
    by_latin = dict.fromkeys(ranges, "latin or here, not both")
    _refuse("set", sweep.set, by_list | by_grid | by_latin | everywhere, path)
    _refuse("grid", sweep.grid, by_latin | everywhere, path)
    _refuse("latin.ranges", dict(ranges), everywhere, path)
    for number, changes in enumerate(sweep.list):
        _refuse(f"list.{number}", changes, by_grid | by_latin | everywhere, path)


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
            fixed = {**together, **dict(zip(sweep.grid, values, strict=True))}
            for drawn in sweep.latin.drawn() if sweep.latin is not None else ({},):
                yield {**fixed, **drawn}


def _shown(changes: Changes, seed: int) -> str:
    return ", ".join([*(f"{key}={value}" for key, value in changes.items()), f"seed {seed}"])
