"""The foot loads by any estimator: what a scenario's `estimator.method` names, row by row on the
running row.

Its loads take the place of the whole-body estimate in the row (`estimate.own` and its interval):
control, supervisor, detectors and the recording's columns `estimate_own_<leg>` see them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.errors import InputError
from testbed.estimation.detectors.base import start
from testbed.estimation.estimator import estimator_of, interval_of
from testbed.formats.intervals import sd_of


class ChosenEstimator:
    """An estimator that fills the row's loads; `dt_s` lies between two rows. Raises InputError as
    estimator_of.
    """

    def __init__(self, name: str, dt_s: float) -> None:
        self._name, self._estimator = name, estimator_of(name, "estimator.method")
        start(self._estimator, dt_s)

    def estimate(self, rows: NDArray[Any]) -> None:
        """Put the loads, low and high of DataRow `rows` (1,) in the place of the whole-body
        estimate.

        Raises InputError for a load that is no number: nothing could stand on it.
        """
        answer = self._estimator.update(rows.view(np.recarray)[0])
        loads, low, high = interval_of(answer, self._estimator)
        if not np.isfinite([loads, low, high]).all():
            raise InputError(
                f"a load is no number at t = {rows['t'][0]:.3f} s",
                field="estimator.method",
                value=self._name,
                allowed="finite loads, N",
            )
        rows["estimate"]["own"], interval = loads, rows["estimate_own"]
        interval["low"], interval["high"] = low, high
        interval["sd"] = sd_of((low, high))
