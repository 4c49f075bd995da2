"""Friction that differs from run to run: no law is missing that a repeat of the same run would not
show either.
"""

from __future__ import annotations

import numpy as np

from testbed.diagnosis.leg.entries import memory_of
from testbed.diagnosis.leg.evidence import Evidence, evidence
from testbed.diagnosis.leg.fit import Fit
from testbed.diagnosis.leg.linear_terms import with_terms
from testbed.diagnosis.leg.problem import Array, Problem
from testbed.diagnosis.leg.series import Series
from testbed.estimation.cylinder import friction_parts
from testbed.recording.leg_model import Friction

WANDER = 0.1
"""Share by which the dry friction of one machine differs from run to run, standard deviation. Half
of the difference of the forces, to and fro, of one measured seal run four times: standard
deviations of 6, 9, 14 and 14 % at 1, 3, 5 and 7 bar."""


def steady(problem: Problem, found: Evidence, fit: Fit) -> Evidence:
    """Evidence of a fit on a bench or a drive whose dry friction may differ from run to run, where
    that predicts what is kept back better: of a run of a few seconds the rest is too short to say.

    `found`: that of the fit as it is. Correlated samples would outweigh what is known of friction's
    wander: that is held to as independent ones would.
    """
    first = 0
    columns = np.zeros((sum(series.bins for series in problem.series), 2 * len(problem.series)))
    for run, series in enumerate(problem.series):
        rows = slice(first, first + series.bins)
        first += series.bins
        columns[rows, 2 * run : 2 * run + 2] = dry_friction_n(series, fit.at.friction)
    columns *= (problem.layout["force"].count > 0)[:, None]
    names = [f"{way} in {series.name}" for series in problem.series for way in ("out", "back")]
    known = np.full(len(names), WANDER / np.sqrt(max(memory_of(found), 1.0)))
    own = evidence(problem, with_terms(problem, fit, "force", names, columns, known))
    return own if own.gain_over(found, own) > 0.0 else found


def dry_friction_n(series: Series, friction: Friction) -> Array:
    """Dry friction of a run as its force balance sees it, N, (bins, 2): extending, retracting."""
    everywhere = np.ones(len(series.signals.velocity_m_s), dtype=np.bool_)
    velocity = series.binned(series.signals.velocity_m_s, everywhere)[0]
    as_declared = np.ones_like(velocity), np.zeros_like(velocity), np.ones_like(velocity)
    level_n = friction_parts(velocity, friction, *as_declared)[0]
    return np.stack([-level_n * (velocity > 0.0), level_n * (velocity < 0.0)], axis=1)
