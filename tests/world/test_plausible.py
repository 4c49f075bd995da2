"""Rows that no machine can give are a fault that names the column and the time."""

from __future__ import annotations

import numpy as np
import pytest

from testbed.errors import SimulationFault
from testbed.world.compiled_step import DATA_COLUMNS, TRUTH_COLUMNS, check_rows

WEIGHT_N = 40_000.0


def rows() -> tuple[np.ndarray, np.ndarray]:
    data, truth = np.zeros((3, len(DATA_COLUMNS))), np.zeros((3, len(TRUTH_COLUMNS)))
    data[:, 0] = truth[:, 0] = [0.0, 0.5, 1.0]
    return data, truth


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_the_first_number_that_is_not_finite_is_named(value: float) -> None:
    data, truth = rows()
    check_rows(data, truth, WEIGHT_N)
    data[1:, DATA_COLUMNS.index("valve_fl_vertical")] = value
    with pytest.raises(
        SimulationFault, match=r"data column valve_fl_vertical is not finite at t = 0\.500 s"
    ):
        check_rows(data, truth, WEIGHT_N)


def test_a_load_is_a_fault_beyond_a_thousand_weights_and_not_before() -> None:
    data, truth = rows()
    column = TRUTH_COLUMNS.index("foot_force_in_world_rl_z")
    truth[2, column] = -1000.0 * WEIGHT_N
    check_rows(data, truth, WEIGHT_N)
    truth[2, column] *= 1.001
    with pytest.raises(
        SimulationFault, match=r"foot_force_in_world_rl_z is -4e\+07 N at t = 1\.000"
    ):
        check_rows(data, truth, WEIGHT_N)


def test_what_is_no_load_may_be_large() -> None:
    data, truth = rows()
    data[:, DATA_COLUMNS.index("pressure_a_fl_vertical")] = 1e12
    check_rows(data, truth, WEIGHT_N)
