"""The contact state by any detector: what a scenario's `estimator.detector` names, sample by sample
on the running row.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.errors import InputError
from testbed.estimation.detectors.base import scores_over, start
from testbed.estimation.detectors.sample import Watch
from testbed.estimation.detectors.table import detector_of
from testbed.estimation.live.contact import ContactLimits, ContactState, step
from testbed.machine.names import LEGS

DWELL_ON_S = 0.02
"""For so long a score must be below the threshold before a lost foot counts as loaded again."""


class Judge:
    """A detector that fills the row's contact states; `belief`: the chain's, shape (1,).

    `field`: where the name stood. Raises InputError for a detector that is not there, or that has
    no threshold.
    """

    def __init__(self, name: str, belief: NDArray[Any], field: str = "estimator.detector") -> None:
        self._detector = detector_of(name, field)
        self._limits = limits_of(self._detector, field)
        self._dt_s, self._watch = float(belief["dt"][0]), Watch(belief)
        self._states = ContactState.zeros(len(LEGS))
        start(self._detector, self._dt_s)

    def judge(self, rows: NDArray[Any]) -> None:
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
    return limits_at(threshold, getattr(detector, "dwell_on_s", DWELL_ON_S))[0]


def limits_at(threshold: float, dwell_on_s: float = DWELL_ON_S) -> NDArray[Any]:
    """The hysteresis, ContactLimits (1,), of minus a score: lost from this threshold on, loaded
    again once the score has been below it for so long.
    """
    return ContactLimits.one(
        on=np.nextafter(-threshold, np.inf), off=-threshold, dwell_on=dwell_on_s, dwell_off=0.0
    )
