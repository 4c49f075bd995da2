"""Figure 5: leakage of shut edges to the tank, and nothing else, lets the one-chamber force
decay.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import pytest

from testbed.benchmarks.paper.decay import OVERLAPPED, raising_step
from testbed.benchmarks.paper.machine import of_set


@pytest.fixture(autouse=True)
def _on_the_original_circuit() -> Iterator[None]:
    with of_set("original"):
        yield


def test_one_chamber_force_decays_towards_the_weight_within_tens_of_seconds_while_the_position_holds() -> (
    None
):
    found = raising_step(OVERLAPPED)
    assert found.start_n > 5e3  # back pressure of chamber B: far above the weight of 9810 N
    assert found.gone > 0.6
    assert 2.0 < found.half_time_s < 20.0
    assert found.moved_m < 1e-3
    assert found.weight_n == pytest.approx(9810.0)


def test_edges_that_leak_alike_keep_the_back_pressure() -> None:
    found = raising_step({})
    assert found.gone < 0.1
    assert math.isnan(found.half_time_s)


def test_the_edges_leakage_is_what_makes_it() -> None:
    whole = raising_step(OVERLAPPED).gone
    assert raising_step(OVERLAPPED, ("edge_leakage",)).gone < 0.1 * whole
    for part in ("hose", "air", "dwell", "internal_leakage", "friction_pressure"):
        assert raising_step(OVERLAPPED, (part,)).gone > 0.8 * whole
