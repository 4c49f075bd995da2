"""What rides along in a run sees every row in its order, however many come at once."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
import pytest

from testbed.errors import InputError
from testbed.estimation.live.chain import ChainBelief
from testbed.machine.names import LEGS
from testbed.recording.rows import DataRow
from testbed.simulation.run_observers import RunObservers, by_name

DT_S = 1e-3


class Counting:
    """An estimator that says how many rows it has seen, and how far apart they are."""

    name = "counting"

    def start(self, dt: float) -> None:
        self.seen, self.dt = 0, dt

    def update(self, row: Any) -> np.ndarray:
        self.seen += 1
        return np.array([self.seen, row.t, self.dt, 0.0])


class Updated(Protocol):
    """A socket."""

    def update(self, row: Any) -> np.ndarray: ...


class Lighter:
    """A detector: the less the foot bears, the surer."""

    def update(self, sample: Any) -> np.ndarray:
        return -np.asarray(sample.row.estimate.own)


def rows(count: int) -> np.ndarray:
    made = DataRow.zeros(count)
    made["t"] = DT_S * np.arange(count)
    made["estimate"]["own"] = np.arange(count)[:, None] + np.arange(len(LEGS))
    return made


def riders(*, detectors: Any = (), estimators: Any = ()) -> RunObservers:
    return RunObservers(detectors, estimators, ChainBelief.zeros(1), DT_S)


def test_objects_classes_and_names_of_shipped_ones_are_taken() -> None:
    made = object()
    found = by_name([Counting, Lighter, "held"], lambda *_: made, Updated, "estimators")
    assert list(found) == ["counting", "Lighter", "held"]
    assert isinstance(found["counting"], Counting) and found["held"] is made
    one = Lighter()
    assert by_name([one], str, Updated, "detectors")["Lighter"] is one


def test_the_same_name_twice_is_refused() -> None:
    with pytest.raises(InputError, match="is there twice") as refused:
        by_name([Counting, Counting()], str, Updated, "estimators")
    assert "estimators = 'counting'" in str(refused.value)


def test_every_row_is_seen_once_in_order_however_they_come() -> None:
    whole, pieces = riders(estimators=[Counting]), riders(estimators=[Counting])
    whole.take(rows(100))
    for start in range(0, 100, 30):
        pieces.take(rows(100)[start : start + 30])
    assert np.array_equal(whole.loads["counting"], pieces.loads["counting"])
    seen = whole.loads["counting"]
    assert seen[:, 0].tolist() == list(range(1, 101))
    assert seen[:, 1] == pytest.approx(DT_S * np.arange(100)) and (seen[:, 2] == DT_S).all()


def test_a_detectors_scores_are_kept_by_its_name() -> None:
    along = riders(detectors=[Lighter])
    assert along.scores["Lighter"].shape == (0, len(LEGS))
    along.take(rows(5))
    assert along.scores["Lighter"].tolist() == (-rows(5)["estimate"]["own"]).tolist()


class Spoils(Lighter):
    """Uses up what it is handed."""

    def update(self, sample: Any) -> np.ndarray:
        scores = super().update(sample)
        sample.row.estimate.own[:] = 0.0
        return scores


class SpoilsRows:
    """Likewise, of rows."""

    def update(self, row: Any) -> np.ndarray:
        loads = np.array(row.estimate.own)
        row.estimate.own[:] = 0.0
        return loads


def test_what_one_rider_writes_to_no_other_sees() -> None:
    along = riders(detectors=[Spoils, Lighter], estimators=[SpoilsRows, "own"])
    recorded = rows(5)
    along.take(recorded)
    assert along.scores["Spoils"].tolist() == along.scores["Lighter"].tolist()
    assert along.loads["SpoilsRows"].tolist() == along.loads["own"].tolist()
    np.testing.assert_array_equal(recorded, rows(5))


class Blind:
    """A class whose `update` is not asked anything."""

    def update(self) -> np.ndarray:
        return np.zeros(4)


@pytest.mark.parametrize("socket", ["detectors", "estimators"])
@pytest.mark.parametrize(
    ("wrong", "said"), [(object(), "has no method update"), (Blind, "takes other arguments")]
)
def test_what_does_not_fit_its_socket_is_refused_before_the_run(
    socket: str, wrong: Any, said: str
) -> None:
    with pytest.raises(InputError, match=said) as refused:
        riders(**{socket: [wrong]})
    assert socket in str(refused.value)
