"""The contact state is whichever detector the scenario names: shipped, or a class of one's own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from testbed.errors import InputError
from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation

NEVER = """
import numpy as np

class Never:
    threshold = 1.0

    def update(self, sample):
        return np.zeros(4)

class Always(Never):
    def update(self, sample):
        return np.full(4, 2.0)
"""


def _contact(detector: str, since: int = 50) -> np.ndarray:
    changes = [f"estimator.detector={detector}"]
    world = Simulation(load_scenario("stand_slope_45", changes, duration=0.4))
    data, _ = world.run_block(400)
    world.close()
    first = world.data_columns.index("contact_fl")
    return data[since:, first : first + 4]


@pytest.mark.parametrize("name", ["held", "threshold_own", "cusum"])
def test_standing_feet_are_loaded_by_every_detector(name: str) -> None:
    assert np.all(_contact(name) == 1.0)


def test_no_foot_is_called_lost_before_anything_was_seen_of_it() -> None:
    assert np.all(_contact("learned", since=0) == 1.0)


def test_a_class_of_ones_own_decides(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(NEVER)
    assert np.all(_contact(f"{file}:Never") == 1.0)
    assert np.all(_contact(f"{file}:Always") == 0.0)


def test_a_threshold_of_the_shipped_detector_is_refused_with_another() -> None:
    changes = ["estimator.detector=cusum", "estimator.contact_threshold_n=500"]
    with pytest.raises(InputError, match="contact_threshold_n"):
        load_scenario("stand_slope_45", changes)


def test_an_unknown_detector_is_refused() -> None:
    with pytest.raises(InputError, match=r"estimator\.detector = .combinde.: no such detector"):
        _contact("combinde")
