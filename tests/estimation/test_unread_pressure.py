"""A gauge reads nothing below the atmosphere: what is believed of a chamber whose reading has ended
at 0.
"""

import math

import numpy as np
import pytest

from testbed.estimation.cylinder import (
    VOID_PA,
    VOID_SD_PA,
    Cylinder,
    Sensor,
    chamber_pressure,
    clipped_reading_sd,
    replace_clipped,
)

LEAST_PA = -101_325.0


def cylinder(area_a: float, area_b: float) -> np.void:
    """Of these areas."""
    out = Cylinder.zeros(1)
    out["area_a"], out["area_b"] = area_a, area_b
    return out[0]


def test_the_belief_is_that_of_a_pressure_spread_evenly_between_void_and_atmosphere() -> None:
    even = np.linspace(LEAST_PA, 0.0, 10_001)
    assert pytest.approx(even.mean(), rel=0.02) == VOID_PA
    assert pytest.approx(even.std(), rel=0.02) == VOID_SD_PA


def test_only_what_has_ended_at_0_is_replaced() -> None:
    np.testing.assert_array_equal(
        replace_clipped(np.array([0.0, 1.0, 5.0e6])), [VOID_PA, 1.0, 5.0e6]
    )


def test_a_reading_above_0_is_corrected_as_before_and_a_missing_one_stays_missing() -> None:
    sensor = Sensor.zeros(1)
    sensor["zero"] = 2.0e4
    assert chamber_pressure(1.0e6, sensor[0], 0.0) == pytest.approx(9.8e5)
    assert chamber_pressure(0.0, sensor[0], 0.0) == VOID_PA
    assert math.isnan(chamber_pressure(math.nan, sensor[0], 0.0))


def test_what_it_leaves_open_is_a_force_of_its_own_area() -> None:
    c = cylinder(5.0e-3, 2.0e-3)
    assert clipped_reading_sd(1.0e6, 1.0e5, c) == 0.0
    assert clipped_reading_sd(1.0e6, 0.0, c) == pytest.approx(VOID_SD_PA * 2.0e-3)
    assert clipped_reading_sd(0.0, 0.0, c) == pytest.approx(VOID_SD_PA * math.hypot(5.0e-3, 2.0e-3))
