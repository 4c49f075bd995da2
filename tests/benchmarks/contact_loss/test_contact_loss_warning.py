"""A warning is right only if its foot is lost within two seconds; every other case counts as it
must.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from testbed.benchmarks.contact_loss.score import Reference
from testbed.benchmarks.contact_loss.warning import (
    added_up,
    judged,
    looked_at,
    means,
    outcome,
    raised,
)
from testbed.benchmarks.contact_loss.warning_numbers import neighbours, report
from testbed.benchmarks.contact_loss.warning_rule import NUMBERS, STEP_S
from testbed.benchmarks.contact_loss.warning_rule import raised as _rule_raised
from testbed.errors import InputError
from testbed.estimation.contact_losses import LossRule

DT = 1e-3
RULE, NEAR_N = LossRule(10_000.0), 600.0


def _loads(*parts: tuple[float, float, float]) -> np.ndarray:
    """Foot 0 goes through (seconds, from N, to N) in turn at 1 kHz, the others bear 5 kN."""
    foot = np.concatenate([np.linspace(a, b, round(s / DT)) for s, a, b in parts])
    out = np.full((len(foot), 4), 5000.0)
    out[:, 0] = foot
    return out


def _off(normal: np.ndarray) -> Reference:
    meant = np.ones(normal.shape, dtype=bool)
    return Reference.of(normal, meant, np.arange(len(normal)) * DT, RULE)


def _kept(normal: np.ndarray) -> np.ndarray:
    return means(normal, DT)


def _judged(t: float, *parts: tuple[float, float, float]) -> tuple[bool, str] | None:
    normal = _loads(*parts)
    return judged(0, t, _off(normal), _kept(normal), NEAR_N)


@pytest.mark.parametrize(
    ("parts", "word"),
    [
        (((5, 4000, 4000), (1, 0, 0), (4, 4000, 4000)), "early"),
        (((4.11, 4000, 4000), (1, 0, 0), (4, 4000, 4000)), "early"),
        (((4.09, 4000, 4000), (1, 0, 0), (4, 4000, 4000)), "lost"),
        (((6.1, 4000, 4000), (1, 0, 0), (4, 4000, 4000)), "false"),
        (((5, 4000, 4000), (0.019, 0, 0), (5, 4000, 4000)), "near"),
        (((5, 4000, 4000), (1, 301, 301), (4, 4000, 4000)), "near"),
        (((5, 4000, 4000), (1, 601, 601), (4, 4000, 4000)), "false"),
        (((3.6, 4000, 4000), (0.1, 0, 0), (1, 4000, 4000), (1, 0, 0), (4, 4000, 4000)), "late"),
    ],
)
def test_what_becomes_of_a_warning_at_four_seconds(
    parts: tuple[tuple[float, float, float], ...], word: str
) -> None:
    assert _judged(4.0, *parts) == (True, word)


def test_a_light_foot_is_told_apart() -> None:
    assert _judged(4.0, (5, 1500, 1500), (1, 0, 0), (4, 1500, 1500)) == (False, "early")


def test_two_seconds_that_the_scene_cuts_off_judge_nothing() -> None:
    assert _judged(4.0, (5.9, 4000, 4000)) is None


def test_a_slow_fall_is_warned_of_in_time_and_one_that_the_foot_across_ends_is_not() -> None:
    """5 kN at 3 kN/s. Where the foot across falls ahead of it, its fall ends."""
    alone = _loads((5, 5000, 5000), (1.6, 5000, 200), (2.5, 0, 0))
    kept = _kept(alone)
    found = outcome(_off(alone), looked_at(kept), kept, NEAR_N, NUMBERS)
    assert (found["early"], found["lost"], found["near"], found["false"]) == (1, 1, 0, 0)
    assert 0.1 <= found["leads_s"][0] <= 0.6
    together = alone.copy()
    together[:, 3] = np.maximum(alone[:, 0] - 600.0, -50.0)
    together[:, 0] = np.maximum(alone[:, 0], 1500.0)  # three feet bear the rest
    kept = _kept(together)
    assert [foot for foot, _ in raised(looked_at(kept), NUMBERS)] == [3]


def _thrust(*parts: tuple[float, float, float], rising_until_s: float) -> np.ndarray:
    """A plan (m, 2) of 5 ms that goes through (seconds, from N, to N), known to rise until a
    time.
    """
    thrust = np.concatenate([np.linspace(a, b, round(s / STEP_S)) for s, a, b in parts])
    end = (np.arange(len(thrust)) + 1) * STEP_S
    rising = np.where(np.gradient(thrust) > 0.0, np.maximum(rising_until_s - end, 0.0), 0.0)
    return np.stack([thrust, rising], axis=1)


def test_a_fall_by_the_thrust_ends_where_the_thrust_stops_rising() -> None:
    """5 kN at 3 kN/s while the thrust rises by 12 kN/s: it ends 1.4 s after it began, at 800 N. So
    it is planned.

    One who does not know that foresees 300 N at 1100 N; nor does a thrust of 1 kN/s explain such a
    fall.
    """
    normal = _kept(_loads((5, 5000, 5000), (1.4, 5000, 800), (3, 800, 800)))
    strong = _thrust((5, 0, 0), (1.4, 0, 16800), (3, 16800, 16800), rising_until_s=6.4)
    weak = _thrust((5, 0, 0), (1.4, 0, 1400), (3, 1400, 1400), rising_until_s=6.4)
    numbers = {**NUMBERS, "warn_at": 600.0}
    assert raised(looked_at(normal, strong), numbers) == []
    for plan in (weak, None):
        ((foot, t),) = raised(looked_at(normal, plan), numbers)
        assert foot == 0 and 6.0 < t < 6.4


def test_a_planned_thrust_that_goes_on_is_warned_of_and_once_only() -> None:
    normal = _kept(_loads((5, 5000, 5000), (1.7, 5000, 0), (4, 0, 0)))
    plan = _thrust((5, 0, 0), (1.7, 0, 20400), (4, 20400, 20400), rising_until_s=6.7)
    ((foot, t),) = raised(looked_at(normal, plan), NUMBERS)
    assert foot == 0 and 6.0 < t < 6.5  # 300 N at 6.6 s


def test_a_lift_that_is_ordered_is_warned_of_before_the_foot_unloads() -> None:
    """The order comes at 5 s, the foot is off from 5.5 s to 7 s and down again."""
    normal = _loads((5.5, 5000, 5000), (1.5, 0, 0), (5, 5000, 5000))
    kept, time_s = _kept(normal), (np.arange(len(normal) // 5) + 1) * STEP_S
    carrying = np.ones(kept.shape)
    carrying[:, 0] = (time_s < 5.0) | (time_s > 7.0)
    seen = looked_at(kept, None, carrying)
    assert raised(seen, NUMBERS) == [(0, 5.0)]
    found = outcome(_off(normal), seen, kept, NEAR_N, NUMBERS)
    assert (found["early"], found["false"], found["late"]) == (1, 0, 0)
    assert _rule_raised(seen, NUMBERS)[time_s > 9.5, 0].max() == 0.0


def test_each_number_is_tried_lower_and_higher() -> None:
    tried = neighbours()
    assert len(tried) == 2 * (len(NUMBERS) - 1)
    assert all(sum(numbers[k] != NUMBERS[k] for k in NUMBERS) <= 1 for _, numbers in tried)


def test_numbers_cannot_be_tried_without_scenes(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no scenes"):
        list(report(tmp_path, "tuning"))


def test_marks_add_up_what_the_scenes_say() -> None:
    one = {
        "lost": 3,
        "early": 1,
        "near": 1,
        "false": 0,
        "late": 2,
        "light": 1,
        "light_lost": 1,
        "leads_s": [0.1, 0.05],
    }
    two = {
        "lost": 0,
        "early": 0,
        "near": 0,
        "false": 1,
        "late": 0,
        "light": 0,
        "light_lost": 0,
        "leads_s": [0.3],
    }
    found = added_up([one, two])
    assert found["warnings"] == 5 and found["precision"] == pytest.approx(0.6)
    assert found["warned_100_ms_ahead"] == pytest.approx(2 / 3) and found[
        "lead_median_s"
    ] == pytest.approx(0.1)
    assert found["early"] == 1 and found["precision_of_early"] == pytest.approx(1 / 3)


def test_loads_are_means_of_five_milliseconds() -> None:
    normal = _loads((0.012, 0.0, 11.0))
    np.testing.assert_allclose(_kept(normal)[:, 0], [2.0, 7.0])
