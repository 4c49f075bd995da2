"""A tolerance's mean and standard deviation are those of its draws."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from testbed.machine.scale import ROBOCLIMBER
from testbed.scenario.machines import Tolerance


def tolerance(**more: Any) -> Tolerance:
    told = {"number": "x", "unit": "N", "spread": "uniform", "mark": "E", "source": "a test"}
    return Tolerance.model_validate(told | more)


def test_a_uniform_draw_spreads_by_a_twelfth_and_a_triangular_by_half_of_that() -> None:
    uniform = tolerance(by="offset", range=(-3.0, 5.0))
    assert uniform.moments() == pytest.approx((1.0, 8.0 / math.sqrt(12.0)))
    triangular = tolerance(by="offset", range=(-3.0, 5.0), spread="triangular")
    assert triangular.moments() == pytest.approx((1.0, 8.0 / math.sqrt(24.0)))


def test_machines_without_it_count_as_drawn_by_the_drawing() -> None:
    """Half of all have 2 to 4: mean 1.5, mean square (9 + 1/3) / 2."""
    found = tolerance(by="value", range=(2.0, 4.0), chance=0.5)
    assert found.moments() == pytest.approx((1.5, math.sqrt(0.5 * (9.0 + 1.0 / 3.0) - 2.25)))
    factor = tolerance(by="factor", range=(1.2, 1.2), chance=0.25)
    assert factor.moments() == pytest.approx((1.05, 0.2 * math.sqrt(0.25 * 0.75)))


@pytest.mark.parametrize("spread", ["uniform", "triangular"])
@pytest.mark.parametrize("chance", [1.0, 0.3])
def test_moments_are_those_of_many_draws(spread: str, chance: float) -> None:
    found = tolerance(by="value", range=(1.0, 3.0), spread=spread, chance=chance)
    drawn = np.array([found.draw("joint.play", seed) or 0.0 for seed in range(1500)])
    mean, sd = found.moments()
    assert drawn.mean() == pytest.approx(mean, abs=4.0 * sd / math.sqrt(1500))
    assert drawn.std() == pytest.approx(sd, rel=0.08)


def test_a_factor_spreads_with_the_number_and_an_offset_with_the_machines_size() -> None:
    share = tolerance(by="factor", range=(0.9, 1.1))
    assert share.standard_deviation("x", -50.0, ROBOCLIMBER) == pytest.approx(10 / math.sqrt(12))
    offset = tolerance(by="offset", range=(-1.0, 1.0))
    assert offset.standard_deviation("x", 50.0, ROBOCLIMBER) == pytest.approx(2 / math.sqrt(12))
