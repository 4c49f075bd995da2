"""What a scenario selects by name: the detector of `estimator.detector`, the estimator of
`estimator.method`, sample by sample on the running row.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.errors import InputError
from testbed.estimation.detectors.base import DROP, Hold, scaled, scores_over, start
from testbed.estimation.detectors.combined import Held
from testbed.estimation.detectors.sample import Sampler
from testbed.estimation.detectors.table import detector_of
from testbed.estimation.estimator import answer_of, estimator_of
from testbed.estimation.live.contact import ContactState, limits_at, step
from testbed.formats.intervals import sd_of
from testbed.machine.names import LEGS


class SelectedDetector:
    """A detector that fills the row's contact states; `belief`: the chain's, shape (1,).

    `field`: where the name stood. Raises InputError for a detector that is not there, or that has
    no threshold.
    """

    def __init__(self, name: str, belief: NDArray[Any], field: str = "estimator.detector") -> None:
        force = float(belief["combined"]["break_away"][0]) / Held.numbers["break_away"]
        self._detector = scaled(detector_of(name, field), force)
        self._limits = limits_of(self._detector, field)
        self._dt_s, self._watch = float(belief["dt"][0]), Sampler(belief)
        self._states = ContactState.zeros(len(LEGS))
        self._states["contact"] = 1.0  # no foot is lost before anything was seen of it
        start(self._detector, self._dt_s)

    def fill(self, rows: NDArray[Any]) -> None:
        """Put the contact states of the next DataRow `rows` (n,) into their `contact`.

        Raises InputError for a score that is no number: no state could be told by it.
        """
        scores = scores_over(self._detector, self._watch.samples(rows))
        if np.isnan(scores).any():
            raise InputError(
                f"a score is no number at t = {rows['t'][0]:.3f} s",
                field="estimator.detector",
                value=type(self._detector).__name__,
                allowed="numbers",
            )
        for row, score in zip(rows, scores, strict=True):
            for foot in range(len(LEGS)):
                state = step(self._states[foot], -float(score[foot]), self._dt_s, self._limits)
                row["contact"][foot] = state


def limits_of(detector: Any, field: str) -> Any:
    """The hysteresis of a contact state on minus a detector's score. Raises InputError where it has
    no threshold.
    """
    threshold = getattr(detector, "threshold", None)
    if not isinstance(threshold, int | float):
        raise InputError(
            "has no threshold to tell a lost foot by",
            field=field,
            value=type(detector).__name__,
            allowed="a class with `threshold`, a score; `testbed contact-loss` finds one",
        )
    return limits_at(threshold, hold_of(detector))[0]


def hold_of(detector: Any) -> Hold:
    """How long a foot that a detector calls lost is held to be: its `hold`, else DROP."""
    found = getattr(detector, "hold", DROP)
    return found if isinstance(found, Hold) else DROP


class SelectedEstimator:
    """The foot loads by any estimator: what a scenario's `estimator.method` names, row by row
    on the running row.

    Its loads take the place of the whole-body estimate in the row (`estimate.own` and its
    interval): control, supervisor, detectors and the recording's columns `estimate_own_<leg>`
    see them.

    `dt_s` lies between two rows. Raises InputError as estimator_of.
    """

    def __init__(self, name: str, dt_s: float) -> None:
        self._name, self._estimator = name, estimator_of(name, "estimator.method")
        start(self._estimator, dt_s)

    def fill(self, rows: NDArray[Any]) -> None:
        """Put the loads, low and high of DataRow `rows` (1,) in the place of the whole-body
        estimate.

        The estimator is handed a copy: what it keeps stays as it was, and what it writes to is
        its own. Raises InputError as answer_of: nothing could stand on such a load.
        """
        row = rows.copy()[0]
        loads, low, high = answer_of(self._estimator, row, "estimator.method", self._name)
        rows["estimate"]["own"], interval = loads, rows["estimate_own"]
        interval["low"], interval["high"] = low, high
        interval["sd"] = interval["spread"] = sd_of((low, high))
