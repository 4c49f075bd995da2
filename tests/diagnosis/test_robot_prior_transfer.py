"""What an earlier recording shows of tolerances holds as far as the other cylinders show it to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from testbed.diagnosis.robot.evidence import NO_TOLERANCE, RawGroup
from testbed.diagnosis.robot.prior_transfer import MOST_SAID, SHARES, shares
from testbed.diagnosis.robot.tolerances import LATE_S
from testbed.effects import by_name
from testbed.machine.names import AXES
from testbed.scenario.machines import tolerances

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


def test_a_number_that_changes_from_day_to_day_is_recalled_no_better_than_that() -> None:
    rng = np.random.default_rng(5)
    before, now = (group(np.zeros(NUMBERS), rng) for _ in range(2))
    sure = replace(before, noise=1e-9 * before.noise)
    changing = replace(now, changing={2: 0.5}).knowing(sure, recalled=0.0).tolerated
    kept = 0.5**2 * np.outer(now.tolerated[:, 2], now.tolerated[:, 2])
    assert changing @ changing.T == pytest.approx(kept, abs=1e-5)


def test_a_line_that_a_workshop_leaves_air_in_is_recalled_and_one_to_be_found_is_not() -> None:
    """However late it is, of the sound ones; of those that are looked for none is as quick."""
    ranges = {
        one.number.rpartition(".")[2]: one.range
        for one in tolerances("workshop")
        if one.number.startswith("sensor.line_b@")
    }
    line = by_name("sensor.line_b")
    slowest = {"natural_frequency": ranges["natural_frequency"][0], "damping": ranges["damping"][1]}
    assert line.to_linear(slowest)["lag"] < NO_TOLERANCE * LATE_S
    assert line.to_linear({"natural_frequency": 6.0, "damping": 0.5})["lag"] > NO_TOLERANCE * LATE_S
