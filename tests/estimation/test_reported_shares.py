"""What an interval tells of friction: by what the piston has been through."""

from __future__ import annotations

import math
from typing import Any

import pytest

from testbed.estimation.live.axis import AxisState
from testbed.estimation.live.reported_shares import (
    ForceRange,
    ReportedShares,
    follow_force,
    share_of_constants,
    share_of_friction,
)

SHARES = ReportedShares.one(
    sliding=0.6,
    begun=1.4,
    begun_s=0.1,
    constants=0.8,
    resting=1.3,
    stopped=0.4,
    loaded=0.9,
    stuck=0.7,
    led=0.3,
    loaded_within=1.0,
    led_within=0.5,
)[0]
WIDTH_N, NOISE_N = 1000.0, 50.0


def told(gone_n: float, has_slid: float, slides: float = 0.0) -> float:
    axis, ends = AxisState.zeros()[0], ForceRange.zeros()[0]
    axis.low, axis.high = -0.5 * WIDTH_N, 0.5 * WIDTH_N
    axis.has_slid, axis.slides, axis.slid = has_slid, slides, 9.0
    ends.low, ends.high = -3000.0, -3000.0 + gone_n
    return share_of_friction(axis, ends, NOISE_N, SHARES)


def ends_after(*samples: tuple[float, float]) -> Any:
    ends = ForceRange.zeros()[0]
    for force, slides in samples:
        follow_force(force, slides, ends)
    return ends


@pytest.mark.parametrize(
    ("gone_n", "stuck", "stopped"),
    [
        (0.0, 0.7, 0.4),
        (NOISE_N, 0.7, 0.4),
        (NOISE_N + 250.0, 0.5, 0.525),
        (NOISE_N + 500.0, 0.3, 0.65),
        (NOISE_N + 1000.0, 0.3, 0.9),
        (9000.0, 0.3, 0.9),
    ],
)
def test_loads_lead_a_stuck_seal_and_stir_one_that_has_stopped(
    gone_n: float, stuck: float, stopped: float
) -> None:
    assert told(gone_n, has_slid=0.0) == pytest.approx(stuck)
    assert told(gone_n, has_slid=1.0) == pytest.approx(stopped)


def test_a_sliding_piston_has_its_own_share_whatever_its_force_did() -> None:
    assert told(0.0, 1.0, 0.2) == told(9000.0, 1.0, 1.0) == pytest.approx(0.6)


@pytest.mark.parametrize(
    ("slid_s", "left"), [(0.0, 1.0), (0.1, math.exp(-1.0)), (0.2, math.exp(-2.0)), (5.0, 0.0)]
)
def test_a_slide_that_has_just_begun_tells_more_than_one_that_lasts(
    slid_s: float, left: float
) -> None:
    axis, ends = AxisState.zeros()[0], ForceRange.zeros()[0]
    axis.slides, axis.has_slid, axis.slid = 1.0, 1.0, slid_s
    friction = share_of_friction(axis, ends, NOISE_N, SHARES)
    assert friction == pytest.approx(0.6 + 0.8 * left)
    assert share_of_constants(axis, SHARES) == pytest.approx(1.0 - 0.2 * (1.0 - left))


def test_of_constants_more_is_told_at_rest() -> None:
    axis = AxisState.zeros()[0]
    axis.slid = 5.0
    assert share_of_constants(axis, SHARES) == 1.3


def test_a_range_begins_with_the_first_force_and_anew_where_the_piston_slides() -> None:
    ends = ends_after((500.0, 0.0), (700.0, 0.0), (400.0, 0.0))
    assert (ends.low, ends.high) == (400.0, 700.0)
    ends = ends_after((500.0, 0.0), (9000.0, 0.4), (8800.0, 0.0))
    assert (ends.low, ends.high) == (8800.0, 9000.0)


def test_a_missing_force_teaches_nothing() -> None:
    ends = ends_after((float("nan"), 0.0), (500.0, 0.0), (float("nan"), 1.0))
    assert (ends.low, ends.high, ends.started) == (500.0, 500.0, 1.0)
