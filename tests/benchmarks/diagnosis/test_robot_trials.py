"""What of the hidden effects counts as visible in a run of the robot's blind test."""

from __future__ import annotations

from typing import cast

import pytest

from testbed.benchmarks.diagnosis.robot_draws import Drawn
from testbed.benchmarks.diagnosis.robot_trials import VISIBLE, visible
from testbed.diagnosis.robot.hypotheses import Hypothesis, Ledger

AIR, MASS = "hydraulics.air@fl_radial", "inertia.mass@rr_vertical"


class OfWorth:
    """A ledger that has this evidence for each set of effects."""

    def __init__(self, air: float, mass: float, both: float) -> None:
        self.names = (AIR, MASS)
        self.worth = {(AIR,): air, (MASS,): mass, (AIR, MASS): both}

    def hypothesis(self, names: tuple[str, ...]) -> Hypothesis:
        """Of this set."""
        return cast(Hypothesis, type("Of", (), {"log_factor": self.worth[names]}))


@pytest.mark.parametrize(
    ("air", "mass", "both", "seen"),
    [
        (20.0, 20.0, 40.0, [AIR, MASS]),
        (20.0, 1.0, 21.0, [AIR]),
        (20.0, 20.0, 21.0, []),
        (-19.0, -7.0, -7.0, []),
        (VISIBLE - 0.1, 0.0, VISIBLE - 0.1, []),
        (-10.0, 8.0, -2.0, [MASS]),
    ],
    ids=["both", "one", "either-explains-both", "each-below-none", "hardly", "spoilt-by-the-other"],
)
def test_an_effect_shows_where_no_set_without_it_is_nearly_as_good(
    air: float, mass: float, both: float, seen: list[str]
) -> None:
    hidden = tuple({"effect": n.split("@")[0], "at": n.split("@")[1]} for n in (AIR, MASS))
    case = Drawn(1, "stand", "double", hidden, ())
    assert visible(cast(Ledger, OfWorth(air, mass, both)), case) == seen
