"""A leg's verdict: names are tried before those at their bounds are doubted, and again after; only
what the search tried is an heir or a witness.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import pytest

from testbed.diagnosis.leg import verdict
from testbed.diagnosis.leg.verdict import Verdict, decide

Names = tuple[str, ...]
ENDS = {"bent": ("exponent",)}
"""The one name of these legs whose numbers end at a bound."""


@dataclass
class Leg:
    """A finished search, and what the trials of its names say."""

    weights: Mapping[Names, float]
    refused: frozenset[str] = frozenset()
    lines: frozenset[Names] = frozenset()
    """Sets that leave a line along the stroke."""
    other_laws: frozenset[str] = frozenset()
    """Names whose shapes stand for a law without a name."""
    dear_alone: frozenset[str] = frozenset()
    """Names that look dear without any other."""
    beyond: float = 0.0
    """Probability that something is there if no name is."""
    tried: dict[frozenset[str], Any] = field(default_factory=dict)
    witnesses: set[frozenset[str]] = field(default_factory=set)

    def __post_init__(self) -> None:
        for names in self.weights:
            if names != ("unnamed",):
                self.fit(names)

    refit = None
    problem = SimpleNamespace(kind="vertical-leg")

    def fit(self, names: Names) -> None:
        """A set as it was fitted."""
        ends = {name: ENDS[name] for name in names if name in ENDS}
        self.tried[frozenset(names)] = SimpleNamespace(names=names, fit=ends)

    def gain(self, candidate: Any) -> float:
        """Every set gains alike."""
        return 100.0 * len(candidate.names)

    def fall(self, candidate: Any, other: Any) -> float:
        """Every set improves."""
        return 0.5


@pytest.fixture
def decided(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The verdict on a leg, whose trials fit every set with one name less, as real ones may."""

    def of(leg: Leg) -> Verdict:
        def trial(state: Leg, chosen: Any, name: str, won: Any) -> Any:
            state.fit(tuple(other for other in chosen.names if other != name))
            return SimpleNamespace(failed="refused" if name in state.refused else None)

        def wins(state: Leg, recordings_too: bool) -> dict[frozenset[str], float]:
            state.witnesses |= set(state.tried)
            return {}

        for name, fake in {
            "signs": lambda state, found: SimpleNamespace(best=SimpleNamespace(names=("any",))),
            "beyond_none": lambda signs, numbers: leg.beyond,
            "distribution": lambda signs, numbers: dict(leg.weights),
            "wins": wins,
            "trial": trial,
            "dearest": lambda state, chosen, names: next(
                (name for name in names if len(names) == 1 and name in state.dear_alone), None
            ),
            "worse_than": lambda *_: False,
            "at_bounds": lambda fit: fit,
            "_leaves_a_line": lambda state, chosen: chosen.names in leg.lines,
            "other_laws": lambda state, chosen: leg.other_laws & set(chosen.names),
            "_with_alike": lambda state, found: found.ambiguous,
        }.items():
            monkeypatch.setattr(verdict, name, fake)
        return decide(leg, None, None)  # type: ignore[arg-type]

    return of


def test_what_a_refused_name_was_given_does_not_speak_for_a_law_without_a_name(
    decided: Any,
) -> None:
    """Doubted first, half of it would be *unnamed*'s, and the verdict with it."""
    weights = {("bent",): 0.8, (): 0.1, ("unnamed",): 0.1}
    found = decided(Leg(weights, frozenset(("bent",))))
    assert found.kind == "none"
    assert dict(found.hypotheses) == pytest.approx({(): 0.9, ("unnamed",): 0.1})
    passed = decided(Leg(weights))
    assert passed.kind == "unnamed"
    assert dict(passed.hypotheses)[("unnamed",)] == pytest.approx(0.5)


def test_where_much_is_left_without_a_name_a_refused_name_leaves_no_sound_leg(
    decided: Any,
) -> None:
    weights = {("wrong",): 0.8, (): 0.1, ("unnamed",): 0.1}
    found = decided(Leg(weights, frozenset(("wrong",)), beyond=0.9))
    assert found.kind == "unnamed"
    assert dict(found.hypotheses) == pytest.approx({(): 0.1, ("unnamed",): 0.9})


def test_a_name_that_leads_once_another_is_doubted_is_tried_too(decided: Any) -> None:
    weights = {("bent",): 0.5, ("wrong",): 0.4, (): 0.06, ("unnamed",): 0.04}
    found = decided(Leg(weights, frozenset(("wrong",))))
    assert found.kind == "none" and found.probability("wrong") == 0.0
    assert dict(found.hypotheses)[()] == pytest.approx(0.46)


def test_a_set_that_only_a_trial_fitted_is_no_heir_of_what_is_doubted(decided: Any) -> None:
    weights = {("right", "bent"): 0.6, ("bent",): 0.1, (): 0.1, ("unnamed",): 0.2}
    leg = Leg(weights)
    found = decided(leg)
    assert frozenset(("right",)) in leg.tried  # a trial fitted it
    assert found.kind == "unnamed"
    expected = {("right", "bent"): 0.3, ("bent",): 0.05, (): 0.1, ("unnamed",): 0.55}
    assert dict(found.hypotheses) == pytest.approx(expected)


def test_a_set_that_the_search_tried_is_one(decided: Any) -> None:
    weights = {("right", "bent"): 0.6, ("right",): 0.1, (): 0.1, ("unnamed",): 0.2}
    found = decided(Leg(weights))
    assert found.chosen.names == ("right",)
    assert dict(found.hypotheses)[("right",)] == pytest.approx(0.4)


def test_a_doubted_second_effect_does_not_speak_against_another_second_one(decided: Any) -> None:
    pair, single = ("right", "other"), ("right",)
    weights = {pair: 0.36, single: 0.33, ("right", "bent"): 0.2, (): 0.06, ("unnamed",): 0.05}
    found = decided(Leg(weights))
    assert found.chosen.names == pair
    given = 0.5 * 0.2 / (0.36 + 0.33)
    after = dict(found.hypotheses)
    assert after[pair] == pytest.approx(0.36 * (1.0 + given))
    assert after[single] == pytest.approx(0.33 * (1.0 + given))
    assert after[("right", "bent")] == pytest.approx(0.1)


def test_a_name_that_passed_beside_a_doubted_one_is_not_tried_again_without_it(
    decided: Any,
) -> None:
    """What the doubted one explained would look like the cost of the other."""
    weights = {("right", "bent"): 0.9, ("right",): 0.04, (): 0.03, ("unnamed",): 0.03}
    found = decided(Leg(weights, dear_alone=frozenset(("right",))))
    assert found.chosen.names == ("right",)
    assert dict(found.hypotheses)[("right",)] == pytest.approx(0.49)


def test_draws_are_won_by_sets_of_the_search_alone(decided: Any) -> None:
    weights = {("right", "bent"): 0.6, ("bent",): 0.1, (): 0.1, ("unnamed",): 0.2}
    leg = Leg(weights)
    decided(leg)
    assert leg.witnesses == {frozenset(names) for names in weights if names != ("unnamed",)}
    assert leg.witnesses < set(leg.tried)


def test_a_line_along_the_stroke_that_is_left_speaks_for_what_no_name_covers(decided: Any) -> None:
    weights = {("right",): 0.7, (): 0.2, ("unnamed",): 0.1}
    assert decided(Leg(weights, lines=frozenset({()}))).kind == "effect"  # the name explains it
    found = decided(Leg(weights, lines=frozenset({("right",)})))
    assert found.kind == "unnamed"
    expected = {("right",): 0.14, (): 0.04, ("unnamed",): 0.82}
    assert dict(found.hypotheses) == pytest.approx(expected)


def test_a_name_whose_shapes_stand_for_another_law_gives_four_fifths_away(decided: Any) -> None:
    """In every set that holds it, and in no other."""
    weights = {("bow",): 0.7, ("bow", "other"): 0.1, ("other",): 0.1, (): 0.05, ("unnamed",): 0.05}
    found = decided(Leg(weights, other_laws=frozenset(("bow",))))
    assert found.kind == "unnamed"
    expected = {
        ("bow",): 0.14,
        ("bow", "other"): 0.02,
        ("other",): 0.1,
        (): 0.05,
        ("unnamed",): 0.69,
    }
    assert dict(found.hypotheses) == pytest.approx(expected)
