"""A name that is there costs no recording anything; one that bends the model towards a recording
does, and what lands on a load cell has a floor of its own.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest

from testbed.diagnosis.leg.evidence import Evidence, Key
from testbed.diagnosis.leg.fit_cost import COSTLY, SHARE, cost, dearest
from testbed.diagnosis.leg.probabilities import (
    FORCE_LEFT,
    PRESSED_LEFT,
    calibration,
    distribution,
)
from testbed.diagnosis.leg.search import LEAST_GAIN
from testbed.diagnosis.leg.signs import SetSigns, Signs, by_contact
from testbed.diagnosis.leg.verdict import handed_on

AIR, PRESS, REST = ("force", "sine"), ("flow_a", "press"), ("flow_a_rest", "press")
SOUND = SetSigns((), 0.0, 0.0, 0.0, 0.0, 0.0, 1.2, 1.2)


def evidence(**scale: float) -> Evidence:
    """Evidence with these scales; only they count here."""
    keys: dict[str, Key] = {"air": AIR, "press": PRESS, "rest": REST}
    return Evidence({}, {keys[name]: value for name, value in scale.items()}, {}, {}, {})


def test_a_name_that_only_improves_costs_nothing_however_little_it_improves() -> None:
    before = evidence(air=10.0, press=2.0)
    assert cost(evidence(air=9.9, press=2.0), before) == 0.0
    assert cost(evidence(air=1.0, press=2.0 * (1.0 + 0.9 * COSTLY)), before) == 0.0


def test_the_cost_is_the_growth_over_the_fall_in_logarithms_whatever_the_units() -> None:
    before = evidence(air=10.0, press=2.0)
    now = evidence(air=10.0 * np.exp(-0.4), press=2.0 * np.exp(0.1))
    assert cost(now, before) == pytest.approx(0.25)
    in_newton = [
        Evidence({}, {k: 7.0 * v for k, v in e.scale.items()}, {}, {}, {}) for e in (now, before)
    ]
    assert cost(*in_newton) == pytest.approx(0.25)


def test_what_grows_and_nothing_falls_is_dear_without_end_and_rest_does_not_count() -> None:
    before = evidence(air=10.0, press=2.0, rest=1.0)
    assert cost(evidence(air=10.0, press=2.5, rest=0.1), before) == float("inf")
    assert cost(evidence(air=9.0, press=2.0, rest=5.0), before) == 0.0


@dataclass
class Tried:
    """A candidate, and a search that has only sets which were tried."""

    names: tuple[str, ...]
    evidence: Evidence
    tried: dict[frozenset[str], Any] = field(default_factory=dict)
    gained: float = 100.0

    @property
    def refit(self) -> Tried:
        """The set without a name."""
        found: Tried = self.tried[frozenset()]
        return found

    def gain(self, candidate: Tried) -> float:
        """What a set gained, as it says."""
        return candidate.gained

    def fall(self, candidate: Tried, other: Tried) -> float:
        """The largest fall of a group's noise."""
        return candidate.evidence.largest_fall(other.evidence)


def test_of_two_dear_names_the_dearer_is_taken_out_first_and_the_right_one_stays() -> None:
    """A wrong name beside a right one: the right one looks dear too, as it makes up for the wrong
    one."""
    sets = {
        (): evidence(air=10.0, press=10.0),
        ("right",): evidence(air=2.0, press=10.0),
        ("wrong",): evidence(air=12.0, press=9.0),
        ("right", "wrong"): evidence(air=5.0, press=9.9),
    }
    tried = {frozenset(names): Tried(names, found) for names, found in sets.items()}
    state: Any = Tried((), sets[()], tried)
    both: Any = tried[frozenset(("right", "wrong"))]
    assert cost(sets[("right", "wrong")], sets[("right",)]) > SHARE
    assert dearest(state, both, both.names) == "wrong"
    alone: Any = tried[frozenset(("right",))]
    assert dearest(state, alone, alone.names) is None


def test_groups_are_parted_by_contact_and_a_rig_without_air_is_judged_by_its_presses() -> None:
    excess = {AIR: 1.4, PRESS: 5.0}
    assert by_contact(excess, {"sine"}) == ({AIR: 1.4}, {PRESS: 5.0})
    assert by_contact(excess, set()) == (excess, {})
    assert by_contact({AIR: 1.4}, {"sine"}) == ({AIR: 1.4}, {})


def signs(left: SetSigns) -> Signs:
    """Signs of a leg on which no name gained anything and so much is left."""
    return Signs(left, (), None, (((), 0.0),), 1.0, 1e-3, 1.0)


def test_what_a_landing_leaves_says_nothing_where_the_same_in_the_air_has_no_name() -> None:
    sound = distribution(signs(SOUND), calibration())[("unnamed",)]
    landing = distribution(signs(replace(SOUND, pressed=6.5)), calibration())[("unnamed",)]
    in_air = distribution(signs(replace(SOUND, force=6.5)), calibration())[("unnamed",)]
    assert landing == pytest.approx(sound, abs=1e-12) and landing < 0.5 < 0.9 < in_air


def test_a_press_that_leaves_far_more_than_landings_do_has_no_name() -> None:
    assert PRESSED_LEFT[0] > FORCE_LEFT[0]
    shares = [
        distribution(signs(replace(SOUND, pressed=pressed)), calibration())[("unnamed",)]
        for pressed in (7.0, 10.0, 20.0, 60.0)
    ]
    assert np.all(np.diff(shares) > 0.0) and shares[-1] > 0.9


@pytest.mark.parametrize(("gained", "heir"), [(100.0, ("a",)), (LEAST_GAIN, ())])
def test_a_refused_name_leaves_its_share_to_what_improves_without_it_or_else_to_none(
    gained: float, heir: tuple[str, ...]
) -> None:
    """A name that only helps beside a refused one is no heir of the two."""
    sets = {(): 10.0, ("a",): 8.0, ("b",): 8.0, ("a", "b"): 3.0}
    tried = {
        frozenset(names): Tried(names, evidence(air=air, press=1.0), gained=100.0)
        for names, air in sets.items()
    }
    tried[frozenset(("a",))].gained = gained
    state: Any = Tried((), evidence(air=10.0, press=1.0), tried)
    weights = {("a", "b"): 0.8, ("b",): 0.1, ("unnamed",): 0.06, (): 0.04}
    found = handed_on(state, weights, frozenset(("b",)))
    assert sum(found.values()) == pytest.approx(1.0)
    assert found[("unnamed",)] == pytest.approx(0.06) and ("a", "b") not in found
    assert max(found, key=lambda names: found[names]) == heir
    assert found[()] == pytest.approx(0.14 if heir else 0.94)
