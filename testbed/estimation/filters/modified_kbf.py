"""The paper's modified KBF (6, Fig. 10): the state update is skipped while |z_k - x_(k-1)| > e_max.

P goes on being propagated, P = P + Q. As published the gate is constant: after a true step of the
force above e_max every later sample is rejected too, for ever (lock-out). Kept as it is, to be
shown.
"""

from __future__ import annotations

from testbed.compiled import njit
from testbed.estimation.filters import kbf
from testbed.estimation.filters.base import over
from testbed.estimation.filters.kbf import KalmanState, only_predict, predict_and_update, start
from testbed.formats.records import quantity


class Numbers(kbf.Numbers):
    """The filter's constants."""

    innovation_limit = quantity("N", "e_max: a sample farther off is not used")


@njit
def step(state: KalmanState, z: float, numbers: Numbers) -> float:
    """One sample; one that is not a number is rejected."""
    if state.started == 0.0:
        return start(state, z, numbers.measurement_variance)
    if not abs(z - state.value) <= numbers.innovation_limit:
        return only_predict(state, numbers.process_variance)
    return predict_and_update(state, z, numbers.process_variance, numbers.measurement_variance)


run = over(step, KalmanState, Numbers)
