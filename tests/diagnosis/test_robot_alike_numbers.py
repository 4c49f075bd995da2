"""The oil is that of the whole machine: what a cylinder shows of it is held against the others, and
what no workshop leaves is not the machine's.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from testbed.diagnosis.robot.alike_numbers import APART, told_by_others
from testbed.diagnosis.robot.evidence import NO_TOLERANCE, RawGroup
from testbed.machine.names import AXES

ROWS = 80
AIR = 1
NAMES = [f"oil {axis}" for axis in AXES]


def cylinder(numbers: list[float], seed: int = 0, noise: float = 1.0) -> RawGroup:
    """A cylinder's oil that misses what these tolerances make, and noise; the second is its air."""
    rng = np.random.default_rng(seed)
    tolerated = rng.normal(size=(ROWS, len(numbers)))
    return RawGroup(
        missing=tolerated @ np.array(numbers) + noise * rng.normal(size=ROWS),
        time_s=np.arange(float(ROWS)),
        noise=noise**2 * np.eye(ROWS),
        tolerated=tolerated,
        rows_of=lambda change: np.zeros(ROWS),
        alike={"entrained_air": AIR},
    )


def machine(air: float, odd: float) -> dict[str, RawGroup]:
    """Twelve cylinders with the same air, as their balances show it; the first shows `odd`."""
    each = [cylinder([0.3, odd if k == 0 else air], seed=k) for k in range(len(NAMES))]
    return dict(zip(NAMES, each, strict=True))


@pytest.mark.parametrize("odd", [1.2, -2.0, 30.0])
def test_a_cylinder_is_told_the_air_of_the_others_whatever_it_shows_itself(odd: float) -> None:
    told = told_by_others(machine(1.2, odd))[NAMES[0]].told["entrained_air"]
    assert told[0] == pytest.approx(1.2, abs=0.1)
    assert told[1] == pytest.approx(APART, abs=0.1)


def test_one_that_contradicts_the_rest_tells_the_others_little() -> None:
    plain, odd = told_by_others(machine(1.2, 1.2)), told_by_others(machine(1.2, 30.0))
    assert odd[NAMES[1]].told["entrained_air"][0] == pytest.approx(
        plain[NAMES[1]].told["entrained_air"][0], abs=0.02
    )


def test_of_one_cylinder_alone_nothing_is_told() -> None:
    told = told_by_others({NAMES[0]: cylinder([0.3, 1.2])})[NAMES[0]].told["entrained_air"]
    assert told == (0.0, pytest.approx(np.hypot(APART, 1.0)))


def test_what_is_told_is_a_prior_like_any_other() -> None:
    """Exactly what the same rows say of numbers about those, in other units."""
    group = cylinder([0.3, 1.2])
    told = replace(group, told={"entrained_air": (0.8, 0.25)})
    mean, covariance = told.tolerances_shown()
    precision = np.diag([1.0, 0.25**-2]) + group.tolerated.T @ group.tolerated
    assert_allclose(covariance, np.linalg.inv(precision))
    rows = group.tolerated.T @ group.missing + np.array([0.0, 0.8 * 0.25**-2])
    assert_allclose(mean, np.linalg.solve(precision, rows))
    about = told.about_what_is_told()
    shifted, narrow = about.tolerances_shown()
    assert_allclose(0.8 + 0.25 * shifted[AIR], mean[AIR])
    assert_allclose(0.25 * np.sqrt(narrow[AIR, AIR]), np.sqrt(covariance[AIR, AIR]))


def test_air_that_one_chamber_shows_wrongly_before_is_no_air_afterwards() -> None:
    """The earlier recording of the first cylinder shows less air than there can be; alone it would
    be believed, and the air of a sound machine then seem to be a lot.
    """
    before, now = machine(0.1, -2.4), machine(0.1, 0.1)[NAMES[0]]
    believed = now.knowing(before[NAMES[0]], recalled=0.1)
    held_against = now.knowing(told_by_others(before)[NAMES[0]], recalled=0.1)
    off = [missed(group) for group in (believed, held_against)]
    assert off[0] > 50.0
    assert off[1] < 3.0 + 0.1 * off[0]


def test_air_that_two_recordings_show_of_one_cylinder_is_that_cylinders() -> None:
    """Nobody bled it: it has other air than the rest in both."""
    before, now = machine(0.1, 2.2), machine(0.1, 2.2)[NAMES[0]]
    told = told_by_others(before)[NAMES[0]]
    assert told.not_recalled == 1
    own, told_of, of_another = (
        missed(now.knowing(one, recalled=0.1)) for one in (before[NAMES[0]], told, before[NAMES[1]])
    )
    assert told_of < own + 5.0
    assert of_another > own + 100.0


def missed(group: RawGroup) -> float:
    """By how much more than its rows' noise a group misses, squared, in the noise's variances."""
    whole = group.noise + group.tolerated @ group.tolerated.T
    return float(group.missing @ np.linalg.solve(whole, group.missing)) - ROWS


@pytest.mark.parametrize(
    ("size", "kept"), [(0.9 * NO_TOLERANCE, True), (3.0 * NO_TOLERANCE, False)]
)
def test_what_no_workshop_leaves_is_not_recalled(size: float, kept: bool) -> None:
    mean, covariance = cylinder([size, 0.5]).tolerances_shown()
    assert mean[0] == pytest.approx(size if kept else 0.0, abs=0.3)
    assert (covariance[0, 0] < 0.1) == kept
    assert covariance[0, 0] == pytest.approx(1.0) or kept
    assert mean[1] == pytest.approx(0.5, abs=0.3)


def test_what_looks_like_a_number_is_not_taken_for_its_neighbours() -> None:
    """A number that is let go takes up what it will: the others come out as without it."""
    mean, _ = cylinder([10.0 * NO_TOLERANCE, 0.5]).tolerances_shown()
    without, _ = cylinder([0.0, 0.5]).tolerances_shown()
    assert mean[1] == pytest.approx(without[1], abs=0.1)
