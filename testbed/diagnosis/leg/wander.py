"""Friction that differs from run to run: no law is missing that a repeat of the same run would not
show either.
"""

from __future__ import annotations

import numpy as np

from testbed.diagnosis.leg.evidence import Evidence, judged, of_residual
from testbed.diagnosis.leg.fit import Fit
from testbed.diagnosis.leg.problem import Array, Problem
from testbed.diagnosis.leg.series import Mask, Series
from testbed.estimation.cylinder import friction_parts
from testbed.recording.leg_model import Friction

WANDER = 0.1
"""Share by which the dry friction of one machine differs from run to run. Half of the difference of
the forces, to and fro, of one measured seal run four times: standard deviations of 6, 9, 14 and
14 % at 1, 3, 5 and 7 bar."""


def steady(problem: Problem, fit: Fit) -> Evidence:
    """Evidence of a fit on a bench or a drive whose friction may differ a little from run to
    run.
    """
    residual = judged(problem, fit)
    force, first = residual["force"].copy(), 0
    counted = problem.layout["force"].count > 0
    for series in problem.series:
        rows = slice(first, first + series.bins)
        first += series.bins
        force[rows] = without_wander(series, force[rows], counted[rows], fit.at.friction)
    return of_residual(problem, residual | {"force": force})


def without_wander(series: Series, force_n: Array, counted: Mask, friction: Friction) -> Array:
    """A run's force residual (bins,), N, less the typical share of the dry friction, in either
    direction of motion, that it amounts to: as far as friction's wander explains that.
    """
    everywhere = np.ones(len(series.signals.velocity_m_s), dtype=np.bool_)
    velocity = series.binned(series.signals.velocity_m_s, everywhere)[0]
    as_declared = np.ones_like(velocity), np.zeros_like(velocity), np.ones_like(velocity)
    level_n = friction_parts(velocity, friction, *as_declared)[0]
    out = force_n.copy()
    for forwards in (True, False):
        here = counted & (velocity != 0.0) & ((velocity > 0.0) == forwards) & (level_n > 0.0)
        if here.any():
            share = np.clip(np.median(force_n[here] / level_n[here]), -WANDER, WANDER)
            out[here] -= share * level_n[here]
    return out
