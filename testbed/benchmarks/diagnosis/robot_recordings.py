"""Simulated runs of the robot's blind test: what is diagnosed in them, and what they are judged by;
kept in a folder where one is given.

A kept run is taken again by the same sources of the simulation alone: the diagnosis may have
changed since.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from testbed.benchmarks.harness import digest, sources
from testbed.formats.arrays import Array
from testbed.scenario.scenario import Scenario

NO_SAY = ("diagnosis/*", "diagnosis/*/*")
"""Sources that have no say in what a run records."""
TRUTH = "foot_load_"
"""Of the truth these columns are kept."""
UNUSED = ("reference_", "estimate_")
"""Of the measurements all but these."""


@dataclass(frozen=True, eq=False)
class Run:
    """`data`: what the sensors read, column -> (n,); `truth`: the feet's loads, N; `surveyed`: what
    was known before it.
    """

    data: Mapping[str, Array]
    truth: Mapping[str, Array]
    surveyed: Any


def run_of(scenario: Scenario, folder: Path | None = None) -> Run:
    """The run of a scenario, from `folder` where it is there, and into it."""
    if folder is None:
        return simulated(scenario)
    said = json.dumps(scenario.model_dump(mode="json"), sort_keys=True)
    file = folder / f"{digest(said, sources((), NO_SAY))}.npz"
    if not file.is_file():
        _write(file, simulated(scenario))
    return _read(file)


def simulated(scenario: Scenario) -> Run:
    """Simulate it from its beginning to its end."""
    from testbed.world.simulation import Simulation
    from testbed.world.summary import surveyed

    world = Simulation(scenario)
    try:
        data, truth = [], []
        while not world.finished:
            measured, true = world.run_block(1000)[:2]
            data.append(measured)
            truth.append(true)
        kept = _columns(world.data_columns, data, lambda name: not name.startswith(UNUSED))
        loads = _columns(world.truth_columns, truth, lambda name: name.startswith(TRUTH))
        return Run(kept, loads, surveyed(world))
    finally:
        world.close()


def _columns(names: Any, blocks: list[Array], wanted: Any) -> dict[str, Array]:
    table = np.concatenate(blocks)
    return {n: np.ascontiguousarray(table[:, k]) for k, n in enumerate(names) if wanted(n)}


def _write(file: Path, run: Run) -> None:
    """Single precision but for time; written whole or not at all."""
    file.parent.mkdir(parents=True, exist_ok=True)
    columns = {f"data {name}": values.astype(np.float32) for name, values in run.data.items()}
    columns |= {f"truth {name}": values.astype(np.float32) for name, values in run.truth.items()}
    unfinished = file.with_suffix(".part.npz")
    np.savez(
        unfinished,
        time=run.data["t"],
        surveyed=np.array(json.dumps(run.surveyed)),
        **columns,  # type: ignore[arg-type]
    )
    unfinished.replace(file)


def _read(file: Path) -> Run:
    with np.load(file, allow_pickle=False) as kept:
        tables: dict[str, dict[str, Array]] = {"data": {}, "truth": {}}
        for key in kept.files:
            table, _, name = key.partition(" ")
            if name:
                tables[table][name] = kept[key].astype(float)
        tables["data"]["t"] = kept["time"]
        return Run(tables["data"], tables["truth"], json.loads(str(kept["surveyed"])))
