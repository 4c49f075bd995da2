"""The loads that control goes by are those of whichever estimator the scenario names: shipped, or
one's own.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from testbed.errors import InputError
from testbed.estimation.estimator import estimator_of, interval_of, intervals_over
from testbed.machine.names import LEGS
from testbed.recording.rows import DataRow
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

class Turned:
    def update(self, row):
        return np.zeros(4), np.ones(4), -np.ones(4)

class Keeps:
    before = None

    def update(self, row):
        # how much pressure came since the last row; what it was handed is used up on the way
        now = row.pressure_a
        came = np.zeros(4) if self.before is None else (now - self.before)[2::3]
        self.before = now
        row.pressure_b[:] = 0.0
        return came
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
    with pytest.raises(InputError, match="an interval ends below its beginning"):
        _columns(f"estimator.method={file}:Turned")


def test_what_an_estimator_keeps_stays_and_what_it_writes_to_is_its_own(tmp_path: Path) -> None:
    """It tells the next row from what it kept, live as over a recording; no reading changes."""
    file = tmp_path / "mine.py"
    file.write_text(MINE)
    found, usual = _columns(f"estimator.method={file}:Keeps"), _columns()
    for leg in LEGS:
        for chamber in "ab":
            name = f"pressure_{chamber}_{leg}_vertical"
            np.testing.assert_array_equal(found[name], usual[name])
        came = np.diff(usual[f"pressure_a_{leg}_vertical"], prepend=np.nan)[1:]
        assert np.abs(came).max() > 0.0
        np.testing.assert_allclose(found[f"estimate_own_{leg}"][1:], came, atol=1.0)


@pytest.mark.parametrize(
    ("name", "what"), [("Broken", "a load is no number"), ("Turned", "an interval ends below")]
)
def test_over_a_recording_the_same_answers_are_refused(
    name: str, what: str, tmp_path: Path
) -> None:
    file = tmp_path / "mine.py"
    file.write_text(MINE)
    with pytest.raises(InputError, match=what):
        intervals_over(estimator_of(f"{file}:{name}"), DataRow.zeros(3).view(np.recarray))


def test_where_a_recording_has_a_gap_no_load_need_be_told(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(MINE)
    rows = DataRow.zeros(2).view(np.recarray)
    rows["pressure_a"][:, 2] = np.nan
    told = intervals_over(estimator_of(f"{file}:Broken"), rows)
    assert told.shape == (2, 3, 4) and np.isnan(told).all()


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(InputError, match=r"estimator\.method = .kfb.: no such estimator"):
        _columns("estimator.method=kfb")
    with pytest.raises(InputError, match="contact_threshold_n"):
        load_scenario(
            "stand_slope_45", ["estimator.method=kbf", "estimator.contact_threshold_n=500"]
        )
    with pytest.raises(InputError, match=r"object = \(3,\): answered what are no loads"):
        interval_of(np.zeros(3), object())
