"""The bow that a commissioning weighs along is the one by which the world's transducers err."""

from __future__ import annotations

import numpy as np
import pytest

from testbed.effects.sensor_linearity import bowed
from testbed.machine.build import build_machine
from testbed.world.sensing import Transducer, transduce

RANGE_PA, BOW_PA = 1.0e7, 1.5e4


@pytest.mark.parametrize("pressure_pa", [0.0, 1.0e6, 4.0e6, 5.0e6, 9.0e6, RANGE_PA])
def test_a_transducer_reads_too_much_by_its_bow(pressure_pa: float) -> None:
    sensor = Transducer.zeros()[0]
    sensor["gain"], sensor["range"], sensor["bow"] = 1.0, RANGE_PA, BOW_PA
    reading = transduce(pressure_pa, 0.0, 0.0, 0.0, sensor)
    assert reading - pressure_pa == pytest.approx(BOW_PA * bowed(pressure_pa, RANGE_PA), abs=1e-6)


def test_a_bow_is_as_wide_as_transducers_of_a_kind_are_drawn() -> None:
    sensor = build_machine().axes["fl_vertical"].sensor
    drawn = sensor.pressure_linearity_pa * np.random.default_rng(1).uniform(-1.0, 1.0, 100_000)
    assert sensor.bow_sd_pa == pytest.approx(drawn.std(), rel=0.01)
