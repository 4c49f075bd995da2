"""A measured bench has zeros that nobody declares; and a parameter at its bound does not hold the others up."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from synthetic_bench import bench

from testbed.diagnosis.leg.diagnose import diagnose
from testbed.diagnosis.leg.fit import _step
from testbed.recording.axis import Rig


def test_a_step_leaves_out_what_stands_at_its_bound_and_finds_the_best_of_the_rest() -> None:
    # x1^2 + x1 x2 + x2^2 + x1 - 2 x2 from (0, 0): freely to (-4/3, 5/3), but with x1 >= 0 its least is at (0, 1).
    h, g, zero, wide = (
        np.array([[2.0, 1.0], [1.0, 2.0]]),
        np.array([1.0, -2.0]),
        np.zeros(2),
        np.full(2, 9.0),
    )
    assert _step(h, g, zero, -wide, wide) == pytest.approx([-4 / 3, 5 / 3])
    assert _step(h, g, zero, np.array([0.0, -9.0]), wide) == pytest.approx([0.0, 1.0])
    assert _step(h, np.array([1.0, 2.0]), zero, zero, wide) == pytest.approx([0.0, 0.0])


@pytest.mark.slow
@pytest.mark.parametrize("zero_n", [25.0, 140.0])
def test_an_area_that_is_larger_than_declared_is_named_beside_a_zero_of_any_size(
    zero_n: float,
) -> None:
    speeds = np.geomspace(0.004, 0.04, 5)
    recordings, _ = bench(speeds, zero_n=zero_n)
    held_out, _ = bench(speeds, seed=1, zero_n=zero_n)
    found = diagnose(Rig("bench", Path(), tuple(recordings), tuple(held_out)))
    assert [entry.name for entry in found.entries] == ["sensor.gain_a"]
    # 1.03 A p = A p / (1 + gain error)
    assert found.entries[0].parameters["gain_error"].value == pytest.approx(
        1 / 1.03 - 1.0, abs=2e-3
    )
    after = found.models["after"]
    friction = after.friction
    plus, minus = (getattr(friction, f"coulomb_{way}_n") for way in ("plus", "minus"))
    assert 0.5 * (plus + minus) == pytest.approx(80.0, rel=0.1)
    # A zero and half the difference of the Coulomb levels look alike: only their sum is to be had.
    assert after.force_offset_n + 0.5 * (minus - plus) == pytest.approx(zero_n, abs=2.0)
    assert found.errors.total("force_n")["after"] < 0.6 * found.errors.total("force_n")["refit"]
