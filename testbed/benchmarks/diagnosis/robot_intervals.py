"""How much intervals are to be doubted, from what was named rightly of hidden effects: a factor of
all of them, and of numbers whose law is wrong by more a share of the number.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from testbed.benchmarks.diagnosis.robot_scores import told_numbers
from testbed.benchmarks.diagnosis.scores import Trial
from testbed.diagnosis.robot.parameters import Doubt

WANTED = 0.9
"""Share of intervals that are to hold the truth."""
CHANCE = 0.05
"""A law is wrong where so few intervals hold the truth that chance would do so more seldom."""
BIASED = 5.0
"""What lies so many stated half widths off shows a law that fails, which no width helps."""
START_WIDTH, WIDEST = 2.0, 4.0
"""Where no run shows it, and at most (E)."""
SHARES = np.arange(0.0, 1.01, 0.01)
WIDTHS = np.arange(1.0, WIDEST + 0.01, 0.02)


@dataclass(frozen=True)
class Miss:
    """One number of an effect that was named rightly in the run of a seed. `number`:
    `effect.parameter`; `off`: how far the truth lies from the value; `half`: of the linear model's
    interval, on that side; `value`.
    """

    seed: int
    number: str
    off: float
    half: float
    value: float

    def held(self, width: float, share: float) -> bool:
        """Whether an interval of this width, with a law that may be wrong by a share, holds it."""
        return self.off <= math.hypot(width * self.half, share * self.value)

    @property
    def fails(self) -> bool:
        """Whether it lies so far off that no width helps."""
        return self.off > BIASED * START_WIDTH * self.half


def fitted_doubt(trials: Sequence[Trial]) -> Doubt:
    """The doubt by which WANTED of the intervals hold the truth: first one width of all; then of
    each number that surely fewer hold the share by which its law is wrong; then
    the width that is needed beside these.
    """
    found = [miss for miss in misses(trials) if not miss.fails]
    if not found:
        return Doubt(START_WIDTH)
    by_number: dict[str, list[Miss]] = defaultdict(list)
    for miss in found:
        by_number[miss.number].append(miss)
    width = _width(found, {})
    law = {
        number: share
        for number, ones in sorted(by_number.items())
        if _is_wrong(ones, width) and (share := _share(ones, width)) > 0.0
    }
    return Doubt(_width(found, law), law)


def misses(trials: Sequence[Trial]) -> Iterator[Miss]:
    """Every number of every effect that was named rightly, by what the linear model said of it."""
    for trial in trials:
        law = trial.get("law", {})
        for number, truth, said in told_numbers(trial):
            value = float(said["value"])
            stated = abs(said["interval90"][int(truth > value)] - value)
            wrong = law.get(number, 0.0) * value
            half = math.sqrt(max(stated**2 - wrong**2, 0.0)) / float(trial["width"])
            if half > 0.0:
                yield Miss(trial["seed"], number, abs(truth - value), half, abs(value))


def _width(found: Sequence[Miss], law: dict[str, float]) -> float:
    """The least width by which WANTED of these are held."""
    shares = [law.get(miss.number, 0.0) for miss in found]
    for width in WIDTHS:
        held = [miss.held(float(width), s) for miss, s in zip(found, shares, strict=True)]
        if np.mean(held) >= WANTED:
            return float(width)
    return WIDEST


def _is_wrong(found: Sequence[Miss], width: float) -> bool:
    """Whether fewer of these are held than WANTED, and surely; of a run that is diagnosed with and
    without an earlier recording one counts.
    """
    from scipy.stats import binom

    runs = {miss.seed: miss for miss in found}.values()
    held = sum(miss.held(width, 0.0) for miss in runs)
    return float(binom.cdf(held, len(runs), WANTED)) < CHANCE


def _share(found: Sequence[Miss], width: float) -> float:
    """The least share by which WANTED of these are held."""
    for share in SHARES:
        if np.mean([miss.held(width, float(share)) for miss in found]) >= WANTED:
            return float(share)
    return float(SHARES[-1])
