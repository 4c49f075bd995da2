"""How large a valve's metering edges are against its plate, as they are fitted beside friction and
effects: a nuisance that is reported, and no finding.
"""

from __future__ import annotations

import numpy as np

from testbed.diagnosis.leg.fit import Fit
from testbed.diagnosis.leg.points import NUISANCE, Array
from testbed.diagnosis.leg.prediction import block_covariance
from testbed.diagnosis.leg.problem import Problem
from testbed.estimation.leg.flow import EDGES
from testbed.formats.intervals import interval90
from testbed.recording.leg_model import Parameter

CAUTION, OTHER_FORM = 2.0, 0.003
"""Intervals are wider than the data alone say, by this factor and by this share, as an orifice is
never exactly its formula. Set on legs of two other simulators (E)."""


def edges_of(problem: Problem, fit: Fit, memory: float) -> dict[str, Parameter]:
    """Edge (`pa`: supply to A, and so on) -> its flow over the plate's, with its 90 % interval;
    empty without flow balances. `memory`: correlation time of the residual, bins.
    """
    place = {
        coordinate.name: index
        for index, coordinate in enumerate(fit.coordinates)
        if coordinate.owner == NUISANCE
    }
    if not place:
        return {}
    by_bins, by_blocks = fit.covariance * max(memory, 1.0), block_covariance(problem, fit)
    out = {}
    for edge in EDGES:
        pair = [place["gain"], place[edge]]
        variance = max(_of_sum(by_bins, pair), _of_sum(by_blocks, pair))
        size = fit.at.edges.gain * getattr(fit.at.edges, edge)
        sd = float(np.hypot(CAUTION * np.sqrt(variance), OTHER_FORM))
        out[edge] = Parameter(value=size, unit="1", interval90=interval90(size, sd))
    return out


def _of_sum(covariance: Array, places: list[int]) -> float:
    """Variance of the sum of some coordinates: of a product of numbers near 1."""
    return float(np.sum(covariance[np.ix_(places, places)]))
