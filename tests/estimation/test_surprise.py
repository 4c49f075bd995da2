"""Intervals widen where the machine is further from its belief than was told, and only there."""

from __future__ import annotations

import numpy as np
import pytest
from test_doubt import HEAVIER, standing

from testbed.estimation.live import surprise, unknowns
from testbed.estimation.live.fusion import Fusion, start
from testbed.estimation.live.own_tuning import OwnTuning
from testbed.estimation.live.unknowns import VERTICAL_EQUATIONS
from testbed.machine.names import VERTICAL

ALL = (
    *range(len(unknowns.CONSTANTS)),
    *(unknowns.DEVIATION + cylinder for cylinder in VERTICAL),
    *(unknowns.BALANCE + equation for equation in VERTICAL_EQUATIONS),
)
"""Unknowns that surprise is reckoned from."""
WORTH = 2.0


def believed(sd: float = 3.0) -> np.void:
    """A filter in which everything is known to `sd` beforehand, and nothing has been found."""
    filter_ = Fusion.zeros()[0]
    sizes = filter_["sizes"]
    sizes["zero_sd"] = sizes["spread"] = sizes["doubted_sd"] = sizes["balance_sd"] = sd
    sizes["dt"] = 0.005
    start(filter_, np.full(len(unknowns.CONSTANTS), sd))
    return filter_


def followed(filter_: np.void, balances: int = 1, worth: float = WORTH) -> np.void:
    """The state after so many balances that all left the filter so."""
    numbers = surprise.SurpriseNumbers.one(worth=worth, memory=8.0)[0]
    state = surprise.SurpriseState.zeros()[0]
    for _ in range(balances):
        surprise.follow_surprise(filter_, numbers, state)
    return state


def found(filter_: np.void, rng: np.random.Generator, left: float, times: float) -> None:
    """Let every unknown be found, `left` of its variance left, `times` as far off as told."""
    known = filter_["p"].diagonal().copy()
    for k in ALL:
        filter_["p"][k, k] = left * known[k]
        filter_["x"][k] = times * np.sqrt((1.0 - left) * known[k]) * rng.standard_normal()


def test_the_surprise_is_what_its_formula_says() -> None:
    filter_ = believed()
    found(filter_, np.random.default_rng(1), 0.4, 2.0)
    squares = (filter_["x"][list(ALL)] ** 2).sum() / 9.0
    expected = (WORTH + squares) / (WORTH + 0.6 * len(ALL))
    assert followed(filter_).level == pytest.approx(expected)


@pytest.mark.parametrize(("times", "square"), [(1.0, 1.0), (2.0, 4.0), (3.0, 9.0)])
def test_it_is_the_square_of_how_much_further_off_all_is_than_told(
    times: float, square: float
) -> None:
    """In the mean over 300 machines, but for what the belief is worth."""
    rng, levels = np.random.default_rng(2), []
    for _ in range(300):
        filter_ = believed()
        found(filter_, rng, 0.2, times)
        levels.append(followed(filter_).level)
    counted = 0.8 * len(ALL)
    expected = (WORTH + square * counted) / (WORTH + counted)
    assert np.mean(levels) == pytest.approx(expected, rel=0.1)


def test_where_nothing_was_found_nothing_surprises() -> None:
    assert followed(believed(), 100).level == surprise.NONE


def test_what_the_machine_knows_beforehand_cannot_surprise() -> None:
    filter_ = believed(0.0)
    filter_["x"][:] = 1.0
    assert followed(filter_).level == surprise.NONE


def test_a_zero_that_is_set_free_is_explained() -> None:
    filter_ = believed()
    filter_["x"][unknowns.ZERO + 2], filter_["p"][unknowns.ZERO + 2, unknowns.ZERO + 2] = 90.0, 0.1
    assert followed(filter_).level > 100.0
    filter_["blamed"][2] = 90.0
    assert followed(filter_).level == surprise.NONE


def test_what_the_moment_shows_is_a_mean_over_the_memory() -> None:
    """One balance that errs by ten standard deviations among a hundred that do not."""
    calm, upset = believed(), believed()
    upset["x"][unknowns.BALANCE + VERTICAL_EQUATIONS[0]] = 30.0
    numbers = surprise.SurpriseNumbers.one(worth=WORTH, memory=8.0)[0]
    state = surprise.SurpriseState.zeros()[0]
    for filter_ in (*[calm] * 99, upset):
        surprise.follow_surprise(filter_, numbers, state)
    assert state.found == pytest.approx(1.0)
    assert state.level == pytest.approx((WORTH + 1.0) / WORTH)


def test_nothing_surprises_a_belief_that_is_worth_nothing_to_doubt() -> None:
    filter_ = believed()
    found(filter_, np.random.default_rng(1), 0.2, 5.0)
    assert followed(filter_, worth=0.0).level == surprise.NONE


def test_intervals_are_wider_by_its_root_and_the_estimate_is_the_same() -> None:
    """Of a machine that stands and is half as heavy again as believed, its balance kept."""
    wide, _ = standing(OwnTuning(doubt_cost=0.0), (HEAVIER, 3000))
    narrow, _ = standing(OwnTuning(doubt_cost=0.0, surprise_worth=0.0), (HEAVIER, 3000))
    assert wide["own_surprise"] > 2.0 and narrow["own_surprise"] == surprise.NONE
    ratio = wide["estimate_own"]["sd"] / narrow["estimate_own"]["sd"]
    np.testing.assert_allclose(ratio, np.sqrt(wide["own_surprise"]))
    assert all(wide["estimate"]["own"] == narrow["estimate"]["own"])
    assert all(wide["estimate_own"]["spread"] == narrow["estimate_own"]["spread"])
