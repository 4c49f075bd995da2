"""Is there structure left in the flow balances? What linear terms without a name would explain of
them.

Only terms that hold none of the residual's own noise: metered flows, position and pressures, not
the velocity and not the pressures' rates (with those, residual and terms together would reproduce
the encoder's noise).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.leg.evidence import of_residual
from testbed.diagnosis.leg.fit import Fit
from testbed.diagnosis.leg.linear_terms import RIDGE, with_terms
from testbed.diagnosis.leg.prediction import held_out
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.series import Series
from testbed.estimation.leg.flow import edge_flow

Array = npt.NDArray[np.float64]
TERMS = ("in", "out", "in_2", "out_2", "position", "one", "pressure_a", "pressure_b", "late")
"""Of each chamber: metered in and out, their squares, along the stroke, constant, pressures, rate
of metered flow.
"""


def flow_structure(problem: Problem, fit: Fit) -> tuple[float, float]:
    """(held-out log-likelihood that linear terms in both flow balances add to a fit, largest
    relative fall of a moving group's noise); (0, 0) without flow balances.
    """
    if "flow" not in fit.residual:
        return 0.0, 0.0
    columns = np.concatenate([_columns(series) for series in problem.series])
    names = [f"{name}_{chamber}" for chamber in "ab" for name in TERMS]
    more = with_terms(problem, fit, "flow", names, columns)
    before = of_residual(problem, {"flow": held_out(problem, fit)["flow"]})
    after = of_residual(problem, {"flow": held_out(problem, more, RIDGE)["flow"]})
    return after.gain_over(before, after), after.largest_fall(before)


def _columns(series: Series) -> Array:
    """Binned terms of one recording, chamber A before B; shape (2 * bins, 2 * terms), m3/s and of
    order one.
    """
    known, signals, opening = series.signals.known, series.signals, series.opening
    pa, pb = signals.pressure_a_pa, signals.pressure_b_pa
    assert opening is not None and pa is not None and pb is not None
    assert (
        known.valve_rated_flow_m3_s
        and known.valve_rated_drop_per_edge_pa
        and known.supply_pressure_nominal_pa
        and known.stroke_m
    )
    tank = known.tank_pressure_pa or 0.0
    blocks = []
    for pressure, into in ((pa, opening > 0.0), (pb, opening < 0.0)):
        drop = np.where(into, known.supply_pressure_nominal_pa - pressure, pressure - tank)
        flow = edge_flow(
            opening, drop, known.valve_rated_flow_m3_s, known.valve_rated_drop_per_edge_pa
        )
        enters, leaves = np.where(into, flow, 0.0), np.where(into, 0.0, flow)
        along = (enters - leaves) * (signals.position_m / known.stroke_m - 0.5)
        rate = np.gradient(enters - leaves) * signals.rate_hz
        level = [np.ones(len(opening)), pa / 1e7 - 0.4, pb / 1e7 - 0.4]
        rows = (enters, leaves, enters**2, leaves**2, along, *level, rate)
        blocks.append(np.stack([series.binned(row, series.clear)[0] for row in rows], axis=1))
    block_a, block_b = blocks
    return np.block([[block_a, np.zeros_like(block_b)], [np.zeros_like(block_a), block_b]])
