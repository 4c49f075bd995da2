"""Fast changes of the foot loads from the body's acceleration: laws that need no machine."""

from __future__ import annotations

import numpy as np

from testbed.estimation.live.body_acceleration import TRUST, AccelerationMemory, add_fast_changes
from testbed.estimation.live.body_records import BodyBelief

DT, MASS, CARRIES = 1e-3, 3000.0, 300.0


def shaken(lift: np.ndarray, loads: np.ndarray) -> np.ndarray:
    """What is added to unchanging loads (4,), N, under specific forces (n,), m/s2: (n, 4)."""
    body, state, out = (
        BodyBelief.zeros()[0],
        AccelerationMemory.zeros()[0],
        np.tile(loads, (len(lift), 1)),
    )
    body["decisions"]["dt"], body["body_mass"], body["carries"] = DT, MASS, CARRIES
    for row, value in zip(out, lift, strict=True):
        add_fast_changes(value, row, body, state)
    return out - loads


def blows(hertz: float, seconds: float = 2.0) -> np.ndarray:
    return 9.81 + 0.5 * np.sin(2 * np.pi * hertz * np.arange(0.0, seconds, DT))


def test_a_shaken_body_shows_what_its_feet_feel() -> None:
    lift = blows(30.0)
    added = shaken(lift, np.full(4, 7000.0))[500:]
    wanted = TRUST * MASS * (lift - 9.81)[500:]
    assert np.sqrt(np.mean((added.sum(axis=1) - wanted) ** 2)) < 0.2 * wanted.std()
    np.testing.assert_allclose(added, added[:, :1].repeat(4, axis=1))


def test_a_body_that_stands_still_or_is_slowly_lifted_adds_nothing() -> None:
    assert np.abs(shaken(np.full(500, 9.81), np.full(4, 7000.0))).max() == 0.0
    slow = shaken(blows(0.2, 5.0), np.full(4, 7000.0)).sum(axis=1)
    assert np.abs(slow).max() < 0.06 * MASS * 0.5


def test_a_foot_in_the_air_takes_no_part_and_the_others_take_it_all() -> None:
    loads = np.array([7000.0, -200.0, 7000.0, 150.0])
    added = shaken(blows(30.0), loads)
    assert np.abs(added[:, 1]).max() == 0.0
    part = 150.0 / CARRIES * added[:, 0]
    np.testing.assert_allclose(added[:, 3], np.maximum(part, -150.0))  # no foot pulls by it
    assert part.min() < -150.0
    four = shaken(blows(30.0), np.full(4, 7000.0)).sum(axis=1)
    pushes = part > -150.0
    np.testing.assert_allclose(added.sum(axis=1)[pushes], four[pushes], atol=1e-6)


def test_a_missing_sample_adds_nothing_and_teaches_nothing() -> None:
    lift = blows(30.0)
    whole = shaken(lift, np.full(4, 7000.0))
    lift[1000] = np.nan
    gap = shaken(lift, np.full(4, 7000.0))
    assert not gap[1000].any()
    np.testing.assert_allclose(gap[1001:], whole[1001:], atol=40.0)
