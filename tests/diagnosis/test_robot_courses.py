"""Of an effect that may go on in several ways the likeliest is taken, and costs its choice."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from testbed.diagnosis.robot.courses import with_likeliest_courses
from testbed.diagnosis.robot.evidence import RawGroup
from testbed.diagnosis.robot.groups import Balances, Candidate
from testbed.diagnosis.robot.hypotheses import Ledger
from testbed.effects import by_name
from testbed.effects.signature import Change, Course, Signature

NAME = "ground.friction@foot_fl"
USUAL_M = by_name("ground.friction").usual
ROWS, NOISE_M = 60, 1e-4
SIZES = (1.0, 0.1)
PRICE = 2.0


def slipping(first: int) -> Signature:
    """Six numbers: a way of its own in each of six stretches of five rows from `first` on."""
    stretches = (np.arange(ROWS) // 5 == first // 5 + k for k in range(6))
    return {f"0 {k}": Change(feet=1.0 * stretch) for k, stretch in enumerate(stretches)}


def balances(missing_m: np.ndarray) -> Balances:
    """A foot that may slip in the first half of a recording, or in the second, far or little."""
    raw = RawGroup(
        missing=missing_m,
        time_s=np.arange(1.0 * ROWS),
        noise=NOISE_M**2 * np.eye(ROWS),
        tolerated=np.zeros((ROWS, 1)),
        rows_of=lambda change: change.feet,
    )
    courses = (Course(slipping(0), SIZES), Course(slipping(30), SIZES, PRICE))
    effect = by_name("ground.friction")
    found = {NAME: Candidate(effect, "foot_fl", courses[0].signature, courses=courses)}
    groups = {"feet": raw.whitened({NAME: courses[0].signature})}
    body = None  # nothing here looks at a robot
    return Balances(body, body, {"feet": raw}, groups, found)  # type: ignore[arg-type]


@pytest.mark.parametrize("first", [0, 30])
@pytest.mark.parametrize("size", SIZES)
def test_the_course_and_size_that_are_there_are_taken_and_cost_their_choice(
    first: int, size: float
) -> None:
    ways = size * USUAL_M * np.array([1.5, -0.7, 0.9, 1.1, -1.2, 0.8])
    signature = slipping(first)
    missing = sum(way * change.feet for way, change in zip(ways, signature.values(), strict=True))
    taken = with_likeliest_courses(balances(missing))
    found = Ledger(taken).hypothesis((NAME,))
    width = size * USUAL_M / NOISE_M
    gain = 5.0 * width**2
    exact = sum(
        0.5 * (5.0 * width * way / NOISE_M) ** 2 / (1.0 + gain) - 0.5 * math.log1p(gain)
        for way in ways
    )
    price = math.log(4.0) + (PRICE if first else 0.0)
    assert found.log_factor == pytest.approx(exact - price, rel=1e-9)
    np.testing.assert_allclose(size * found.mean, ways, rtol=0.05)


def test_what_is_sound_has_no_course() -> None:
    rng = np.random.default_rng(1)
    taken = with_likeliest_courses(balances(NOISE_M * rng.normal(size=ROWS)))
    assert Ledger(taken).hypothesis((NAME,)).log_factor < 0.0


def test_an_effect_with_one_course_stays_as_it_is() -> None:
    whole = balances(np.full(ROWS, 1e-3))
    one = replace(whole.candidates[NAME], courses=whole.candidates[NAME].courses[:1])
    alone = replace(whole, candidates={NAME: one})
    assert with_likeliest_courses(alone).candidates[NAME] is one
