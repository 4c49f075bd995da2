"""The inferred circuit lies in the ranges searched, and figures 4, 6 and 9 hold together with it
and not without.
"""

from __future__ import annotations

import numpy as np
import pytest

from testbed.benchmarks.paper.leg import of_set
from testbed.benchmarks.paper.sensitivity import KINDS, RANGES, bench, draw, inferred
from testbed.machine.build import build_machine


def test_the_inferred_circuit_and_every_draw_lie_within_the_ranges() -> None:
    rng = np.random.default_rng(0)
    for circuit in (inferred(), *(draw(rng) for _ in range(20))):
        machine = build_machine(circuit)
        for path, (low, high) in RANGES.items():
            assert low <= machine.quantity(path).value <= high, path


def test_draws_take_both_kinds_of_supply_and_of_holding() -> None:
    rng = np.random.default_rng(0)
    drawn = [draw(rng) for _ in range(30)]
    for path in KINDS:
        assert {circuit[path] for circuit in drawn} == set(RANGES[path])
    for circuit in drawn:
        sensing = circuit["power_unit.supply_kind"] == 1.0
        assert (circuit["power_unit.accumulator_volume_m3"] == 0.0) == sensing


@pytest.mark.long
def test_figures_4_6_and_9_hold_together_on_the_inferred_circuit_alone() -> None:
    assert bench({}).holds == (True, True, True)
    with of_set("original"):
        assert bench({}).holds == (False, False, False)


@pytest.mark.long
def test_figure_6_fixes_the_edge_through_which_chamber_a_drains() -> None:
    half = bench({"valve.edge_at": 1.0})
    assert half.holds[0] and not half.holds[1]
