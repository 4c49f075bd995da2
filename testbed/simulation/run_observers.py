"""Detectors and estimators that ride along: they get every recorded row, and the run does not heed
what they say.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.errors import InputError
from testbed.estimation.detectors.base import Detector, scores_over, start
from testbed.estimation.detectors.sample import Sampler
from testbed.estimation.detectors.table import detector_of
from testbed.estimation.estimator import Estimator, estimator_of, loads_over
from testbed.formats.arrays import Array
from testbed.formats.sockets import check_fits, user_code
from testbed.machine.names import LEGS


def by_name(
    chosen: Iterable[Any], shipped: Callable[[str, str], Any], socket: type, field: str
) -> dict[str, Any]:
    """Objects by name: `shipped` makes one of a name, a class is made, an object stays as it is.

    Raises InputError where two have the same name, or where one does not fit its socket.
    """
    found: dict[str, Any] = {}
    for one in chosen:
        if isinstance(one, str):
            name, made = one, shipped(one, field)
        else:
            kind = one if inspect.isclass(one) else type(one)
            check_fits(kind, socket, field)
            name, made = str(getattr(one, "name", kind.__name__)), one() if kind is one else one
        if name in found:
            raise InputError("is there twice", field=field, value=name, allowed="each name once")
        found[name] = made
    return found


class RunObservers:
    """What rides along in one run. `belief`: the run's ChainBelief, shape (1,); `dt_s` between two
    rows.

    Raises InputError for a name that is not shipped, or a class that does not fit its socket.
    """

    def __init__(
        self,
        detectors: Iterable[str | type[Any] | Detector],
        estimators: Iterable[str | type[Any] | Estimator],
        belief: NDArray[Any],
        dt_s: float,
    ) -> None:
        self._detectors = by_name(detectors, detector_of, Detector, "detectors")
        self._estimators = by_name(estimators, estimator_of, Estimator, "estimators")
        self._watch = Sampler(belief)
        for rider in (*self._detectors.values(), *self._estimators.values()):
            start(rider, dt_s)
        nothing = np.empty((0, len(LEGS)))
        self._scores = {name: [nothing] for name in self._detectors}
        self._loads = {name: [nothing] for name in self._estimators}

    def take(self, rows: NDArray[Any]) -> None:
        """The next rows (n,) of DataRow; each rider of one's own is handed copies."""
        with user_code():
            if self._detectors:
                samples = self._watch.samples(rows)
                for name, detector in self._detectors.items():
                    self._scores[name].append(scores_over(detector, samples))
            for name, estimator in self._estimators.items():
                self._loads[name].append(loads_over(estimator, rows))

    @property
    def scores(self) -> dict[str, Array]:
        """Scores (n, 4) by every detector so far: the higher, the surer that the foot has lost its
        load.
        """
        return {name: np.concatenate(parts) for name, parts in self._scores.items()}

    @property
    def loads(self) -> dict[str, Array]:
        """Loads (n, 4) by every estimator so far, N."""
        return {name: np.concatenate(parts) for name, parts in self._loads.items()}
