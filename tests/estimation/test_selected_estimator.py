"""The loads that control goes by are those of whichever estimator the scenario names: shipped, or
one's own.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from testbed.errors import InputError
from testbed.estimation.estimator import interval_of
from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation

MINE = """
import numpy as np

class Nothing:
    def update(self, row):
        return np.zeros(4)

class Broken:
    def update(self, row):
        return np.full(4, np.nan)
"""


def _columns(*changes: str) -> dict[str, np.ndarray]:
    world = Simulation(load_scenario("stand_slope_45", list(changes), duration=0.3))
    data, _ = world.run_block(300)
    world.close()
    return {name: data[:, k] for k, name in enumerate(world.data_columns)}


def test_a_shipped_method_by_name_is_what_control_sees() -> None:
    kbf, usual = _columns("estimator.method=kbf"), _columns()
    np.testing.assert_array_equal(kbf["estimate_own_fl"], kbf["estimate_kbf_fl"])
    assert not np.array_equal(usual["estimate_own_fl"], usual["estimate_kbf_fl"])
    assert np.all(kbf["contact_fl"][50:] == 1.0)


def test_detectors_see_the_estimator_that_is_named(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(MINE)
    changes = (f"estimator.method={file}:Nothing", "estimator.detector=threshold_own")
    found = _columns(*changes)
    assert np.all(found["estimate_own_rr"] == 0.0) and np.all(found["contact_rr"][50:] == 0.0)
    with pytest.raises(InputError, match="a load is no number"):
        _columns(f"estimator.method={file}:Broken")


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(InputError, match=r"estimator\.method = .kfb.: no such estimator"):
        _columns("estimator.method=kfb")
    with pytest.raises(InputError, match="contact_threshold_n"):
        load_scenario(
            "stand_slope_45", ["estimator.method=kbf", "estimator.contact_threshold_n=500"]
        )
    with pytest.raises(InputError, match=r"object = \(3,\): answered what are no loads"):
        interval_of(np.zeros(3), object())
