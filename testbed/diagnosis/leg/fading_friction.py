"""Dry friction that vanishes with speed: where the published friction stands for another law.

A seal's or a guide's friction at rest is up to twice of what it is when it slides, and what slides
stays. The formula (5) knows no such bound, and its Stribeck part, given a few tenths of a metre per
second to fall over, bends like whatever grows faster than with the speed: of a drag that grows with
the square of the speed it leaves hardly more than the sensors do, and predicts every faster motion
wrongly.
"""

from __future__ import annotations

import numpy as np

from testbed.diagnosis.leg.evidence import FEWEST, Evidence
from testbed.diagnosis.leg.fit import Fit
from testbed.diagnosis.leg.problem import Problem
from testbed.estimation.leg.balance import MOVING_M_S

SLOW, FAST = 0.1, 0.9
"""Quantiles of the speeds of one way between which it is asked how much dry friction goes."""


def fading(problem: Problem, fit: Fit, left: Evidence) -> float:
    """Logarithm of the dry friction at slow speeds of the motion over that at fast ones, of the way
    in which it falls more, at least 0. What falls by no more than is left anyway is none.

    What is there at fast speeds is the mean of both ways: by how much they differ, a constant
    force, friction shares with a spring's rest, a mass or a gain.
    """
    friction = fit.at.friction
    noise_n = _rms_n(left)
    velocity = np.concatenate(
        [series.signals.velocity_m_s[series.trusted & series.clear] for series in problem.series]
    )
    ways = (
        (
            velocity,
            friction.coulomb_plus_n,
            friction.stribeck_plus_n,
            friction.stribeck_speed_plus_m_s,
        ),
        (
            -velocity,
            friction.coulomb_minus_n,
            friction.stribeck_minus_n,
            friction.stribeck_speed_minus_m_s,
        ),
    )
    falls_n, stay_n = [0.0], []
    for along, coulomb_n, stribeck_n, width_m_s in ways:
        speeds = along[along > MOVING_M_S]
        if len(speeds) < FEWEST:
            continue
        slow, fast = coulomb_n + stribeck_n * np.exp(-np.quantile(speeds, (SLOW, FAST)) / width_m_s)
        falls_n.append(float(slow - fast))
        stay_n.append(float(fast))
    stays_n = noise_n + (float(np.mean(stay_n)) if stay_n else 0.0)
    return float(np.log1p(max(falls_n) / stays_n)) if stays_n > 0.0 else 0.0


def _rms_n(left: Evidence) -> float:
    """What is left of the force, root mean square over the recordings, N."""
    squares = [value**2 for (channel, _), value in left.rms.items() if channel == "force"]
    return float(np.sqrt(np.mean(squares))) if squares else 0.0


def fading_signs(faded: float) -> dict[str, float]:
    """What tells that friction which fades so stands for a law without a name.

    Its weights are reckoned, not fitted: ln 0.03, the odds of what is without a name and grows
    faster than with the speed (E), and of two half-normal distributions the logarithmic probability
    if what fades is another law (standard deviation 1.5) less that if it is friction (0.3). It was
    at most 0.4 on a hundred simulated and measured benches and drives without a drag, and 0.6 to
    1.7 on ten with one, 0.1 to 0.2 on three that go no faster than some centimetres per second.
    """
    return {"one": 1.0, "square": faded**2}
