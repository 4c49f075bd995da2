"""What an earlier recording shows of tolerances holds as far as the other cylinders show it to."""

from __future__ import annotations

import numpy as np
import pytest

from testbed.diagnosis.robot.evidence import RawGroup
from testbed.diagnosis.robot.prior_transfer import MOST_SAID, SHARES, shares
from testbed.machine.names import AXES

ROWS, NUMBERS = 60, 6
NAMES = [f"oil {axis}" for axis in AXES]


def group(numbers: np.ndarray, rng: np.random.Generator, more: float = 0.0) -> RawGroup:
    """A cylinder's oil that misses what these tolerances make, noise, and `more` all along."""
    tolerated = rng.normal(size=(ROWS, NUMBERS))
    return RawGroup(
        missing=tolerated @ numbers + rng.normal(size=ROWS) + more,
        time_s=np.arange(float(ROWS)),
        noise=np.eye(ROWS),
        tolerated=tolerated,
        rows_of=lambda change: np.zeros(ROWS),
    )


def two_recordings(
    kept: float, hidden: float = 0.0, seed: int = 0
) -> tuple[dict[str, RawGroup], dict[str, RawGroup]]:
    """A machine now and before, of whose numbers the share `kept` is the same in both; `hidden`:
    what the first cylinder misses now beside them.
    """
    rng = np.random.default_rng(seed)
    now, before = {}, {}
    for name in NAMES:
        old, new = rng.normal(size=(2, NUMBERS))
        before[name] = group(old, rng)
        numbers = kept * old + np.sqrt(1.0 - kept**2) * new
        now[name] = group(numbers, rng, hidden * (name == NAMES[0]))
    return now, before


@pytest.mark.parametrize("seed", range(3))
def test_numbers_that_are_as_they_were_are_recalled_and_others_are_not(seed: int) -> None:
    assert set(shares(*two_recordings(1.0, seed=seed)).values()) == {SHARES[0]}
    assert set(shares(*two_recordings(0.0, seed=seed)).values()) == {SHARES[-1]}


def test_what_is_hidden_in_one_cylinder_is_not_taken_for_something_forgotten() -> None:
    found = shares(*two_recordings(1.0, hidden=20.0))
    assert set(found.values()) == {SHARES[0]}
    assert MOST_SAID < 10.0


def test_what_one_cylinder_alone_could_show_is_left_to_all() -> None:
    now, before = two_recordings(1.0)
    assert shares({NAMES[0]: now[NAMES[0]]}, before) == {}
    assert shares(now, {}) == {}
