"""What sound walking machines are known to miss is what a lighter body makes."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from testbed.diagnosis.robot.walking_bias import (
    SEEMS_KG,
    SEEMS_KG_M,
    SEEMS_KG_SD,
    hangs,
    lighter,
    lighter_yet,
)
from testbed.effects import by_name
from testbed.effects.signature import Change, RobotSeen
from testbed.machine.names import AXES
from testbed.machine.scale import ROBOCLIMBER, Scale


def measured(bins: int = 3) -> RobotSeen:
    """Bins of which masses and moments ask for any forces."""
    asked = np.random.default_rng(0).normal(size=(bins, 18, 4))
    seen = SimpleNamespace(asked_by_moment=asked, arm_m=np.ones((bins, len(AXES))))
    seen.weighs = lambda forces: RobotSeen.weighs(cast(Any, seen), forces)
    return cast(RobotSeen, seen)


def wrench(change: Change) -> np.ndarray:
    """(bins, 6) N and N m."""
    assert change.wrench is not None
    return change.wrench


def test_a_walk_seems_to_carry_a_payload_of_less_than_nothing() -> None:
    seen = measured()
    numbers = np.array([SEEMS_KG, *SEEMS_KG_M])
    made = by_name("robot.payload").signature(seen, "body").values()
    whole = sum(n * wrench(change) for n, change in zip(numbers, made, strict=True))
    assert wrench(lighter(seen, ROBOCLIMBER)) == pytest.approx(whole)


def test_a_machine_of_twice_the_length_misses_eight_times_the_mass() -> None:
    seen = measured()
    seen.asked_by_moment[:, :, 1:] = 0.0
    twice = wrench(lighter(seen, Scale(8.0, 2.0)))
    assert twice == pytest.approx(8.0 * wrench(lighter(seen, ROBOCLIMBER)))


def test_a_machine_whose_pins_read_next_to_nothing_hangs_on_no_rope() -> None:
    on_feet_n = np.zeros((3, 4, 3))
    on_feet_n[:, :, 2] = 1e4
    pulled, loose = (SimpleNamespace(tension_n=np.full((3, 2), n)) for n in (8e3, 25.0))
    assert hangs(cast(RobotSeen, pulled), on_feet_n)
    assert not hangs(cast(RobotSeen, loose), on_feet_n)


def test_a_walk_may_miss_more_or_less_than_that_by_what_single_walks_differ() -> None:
    seen = measured()
    yet = list(lighter_yet(seen, ROBOCLIMBER))
    payload = by_name("robot.payload").signature(seen, "body")
    assert len(yet) == 3
    assert wrench(yet[0]) == pytest.approx(SEEMS_KG_SD * wrench(next(iter(payload.values()))))
    small = list(lighter_yet(seen, Scale(1.0 / 64.0, 0.25)))
    assert wrench(small[0]) == pytest.approx(wrench(yet[0]) / 64.0)
    assert wrench(small[1]) == pytest.approx(wrench(yet[1]) / 256.0)
