"""Does an effect of a sensor show at speed, too? A lateness does, and what smoothing makes of
friction does not.

Where friction falls steeply with the speed, a leg that rings on its own oil has the mean of a bent
law, and the estimate has the law of a mean: the rest goes with the ringing's acceleration rate, as
lateness does. Three Stribeck speeds on, the law is straight.
"""

from __future__ import annotations

import numpy as np

from testbed.diagnosis.leg.fit import Fit, weights
from testbed.diagnosis.leg.problem import Array, Problem
from testbed.diagnosis.leg.series import Series
from testbed.estimation.leg.balance import MOVING_M_S
from testbed.recording.leg_model import Friction

STRAIGHT = 3.0
"""Stribeck speeds from which on friction is a straight line: 5 % of the excess is left there."""
KNOWN = 0.2
"""Standard deviation of the share, at most, with which a share says anything."""


def share_at_speed(problem: Problem, fit: Fit, owner: str, size: str) -> float | None:
    """What share of an effect's size is left if only forces at speed are asked, all other numbers
    as they are; None where they do not say.

    One linear step: the residual's own part along the size's column.
    """
    place = next(
        index for index, one in enumerate(fit.coordinates) if (one.owner, one.name) == (owner, size)
    )
    value = float(fit.theta[place])
    column, residual = fit.jacobian["force"][:, place], fit.residual["force"]
    weight = weights(problem, {"force": residual}, {"force": fit.scale["force"]})["force"]
    weight = np.where(_at_speed(problem.series, fit.at.friction), weight, 0.0)
    information = float(np.sum((weight * column) ** 2))
    if value == 0.0 or information < 1.0 / (KNOWN * value) ** 2:
        return None
    return 1.0 - float(np.sum(weight**2 * column * residual)) / information / value


def _at_speed(series: tuple[Series, ...], friction: Friction) -> Array:
    """Bins (total,) in which the piston goes faster than friction's law is bent."""
    return np.concatenate([_fast(one, friction) for one in series])


def _fast(series: Series, friction: Friction) -> Array:
    everywhere = np.ones(len(series.signals.velocity_m_s), dtype=np.bool_)
    velocity = series.binned(series.signals.velocity_m_s, everywhere)[0]
    bend = np.where(
        velocity > 0.0, friction.stribeck_speed_plus_m_s, friction.stribeck_speed_minus_m_s
    )
    return np.asarray(np.abs(velocity) > np.maximum(STRAIGHT * bend, MOVING_M_S))
