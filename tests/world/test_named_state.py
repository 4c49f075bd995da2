"""Everything is addressed by its name: a field that somebody puts into the middle of a record
breaks nothing.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

RUN = """
import json, sys
from testbed.formats import records

KEPT = ("SampleNoise", "AddedNoise")  # a further noise is drawn: what follows is another run
declare = records.Record.__init_subclass__.__func__


def with_a_spare_field(cls):
    if cls.__name__ not in KEPT:
        own = [name for name, item in vars(cls).items() if isinstance(item, records.Field)]
        later = [(name, vars(cls)[name]) for name in own[len(own) // 2 :]]
        for name, _ in later:
            delattr(cls, name)
        setattr(cls, "spare_" + cls.__name__.lower(), records.quantity("1", "put in between"))
        for name, item in later:
            setattr(cls, name, item)
    declare(cls)


if sys.argv[1] == "spare":
    records.Record.__init_subclass__ = classmethod(with_a_spare_field)
    one = records.Record.one.__func__
    records.Record.one = classmethod(  # asks for every field: the spare ones are given as zero
        lambda cls, **values: one(
            cls, **{name: 0.0 for name in cls.fields if name.startswith("spare_")}, **values
        )
    )

from testbed.control.gait import Measured
from testbed.envs.observations import TABLE, Observer
from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation

overrides = ["rates.record_hz=1000", "task.start_s=0.0"]
world = Simulation(load_scenario("drill_slope_45", overrides, duration=1.0))
data, truth = world.run_block(int(sys.argv[2]))
columns = {}
for series, names, table in (
    ("data", world.data_columns, data), ("truth", world.truth_columns, truth)
):
    assert table.shape[1] == len(names)
    columns |= {f"{series}/{name}": table[:, k].tolist() for k, name in enumerate(names)}
orders = {row.column: 0.0 for row in TABLE}
print(json.dumps({
    "columns": columns,
    "seen": Observer(world.data_columns, TABLE).observe(data[-1], orders).tolist(),
    "position": Measured(world._row).position.tolist(),
}))
"""


def _run(variant: str, rows: int, **environment: str) -> dict:
    out = subprocess.run(
        [sys.executable, "-c", RUN, variant, str(rows)],
        env=os.environ | environment,
        capture_output=True,
        text=True,
    )
    assert out.returncode == 0, out.stderr[-2000:]
    return json.loads(out.stdout.splitlines()[-1])


@pytest.mark.slow
def test_a_field_in_the_middle_of_every_record_changes_no_number_of_a_run() -> None:
    """The kernels as Python functions: the same columns, recorder, observations and readings by
    name.
    """
    plain, spare = (_run(variant, 3, NUMBA_DISABLE_JIT="1") for variant in ("plain", "spare"))
    added = {name for name in spare["columns"] if "spare_" in name}
    assert added and set(spare["columns"]) - added == set(plain["columns"])
    assert {name: spare["columns"][name] for name in plain["columns"]} == plain["columns"]
    assert spare["seen"] == plain["seen"] and spare["position"] == plain["position"]


@pytest.mark.long
def test_nor_does_it_where_the_kernels_are_compiled() -> None:
    plain, spare = (_run(variant, 20) for variant in ("plain", "spare"))
    assert set(plain["columns"]) < set(spare["columns"])
    for name, values in plain["columns"].items():
        assert spare["columns"][name] == pytest.approx(values, rel=1e-9, abs=1e-9), name
