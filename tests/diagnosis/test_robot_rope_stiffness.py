"""Ropes that are held while the body moves show how stiff they are; ropes that are paid out do
not.
"""

from __future__ import annotations

import numpy as np
import pytest

from testbed.diagnosis.robot.rope_stiffness import (
    FEWEST,
    SEEMS,
    HeldRopes,
    _agreeing,
    _is_a_clamp,
    _stretches,
)
from testbed.effects import by_name
from testbed.effects.signature import Change
from testbed.machine.build import build_machine
from testbed.machine.scale import ROBOCLIMBER

STIFFNESS_N_M = 3.0e5


def pulled(held: slice, share: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Way of a body that goes down its ropes (n,) and the pull of one that is held for a while."""
    way = 0.002 * np.arange(60.0)
    pull = np.full(60, 9000.0)
    pull[held] += share * STIFFNESS_N_M * (way[held] - way[held][0])
    pull[held.stop :] = pull[held.stop - 1]
    return way, pull


@pytest.mark.parametrize("share", [0.3, 1.0, 2.0])
def test_a_held_rope_is_a_spring(share: float) -> None:
    way, pull = pulled(slice(20, 40), share)
    (found,) = _stretches(way, pull, ROBOCLIMBER)
    assert found[0] in range(15, 22)
    assert 15 < found[1] < 30
    assert found[2] == pytest.approx(share * STIFFNESS_N_M, rel=0.12)


def test_a_rope_that_is_paid_out_keeps_its_pull_and_says_nothing() -> None:
    way, pull = pulled(slice(20, 21))
    noise = np.random.default_rng(3).normal(0.0, 40.0, len(pull))
    assert _stretches(way, pull + noise, ROBOCLIMBER) == []


def test_a_pull_that_falls_says_nothing_for_a_device_may_haul() -> None:
    way, pull = pulled(slice(20, 40))
    assert _stretches(-way[::-1], pull[::-1], ROBOCLIMBER) == []


def test_ropes_as_declared_miss_nothing_and_half_as_stiff_ones_half() -> None:
    stiffness = np.full(FEWEST, SEEMS)
    for factor in (1.0, 0.5):
        lasts = np.ones(FEWEST, dtype=bool)
        held = HeldRopes(np.arange(float(FEWEST)), factor * stiffness, lasts)
        group = held.group()
        linear = by_name("rope.stiffness").to_linear({"factor": factor})
        made = group.rows_of(Change(ropes=linear["more"]))
        assert held.shown and group.missing == pytest.approx(made)


def test_a_single_stretch_may_be_a_device_that_is_too_slow() -> None:
    assert not HeldRopes(np.zeros(1), np.full(1, 0.4), np.ones(1, dtype=bool)).shown
    assert not HeldRopes.none().shown


@pytest.mark.parametrize("moved", [0.2, 4.5])
def test_what_a_device_pays_out_or_hauls_in_is_not_told_of_the_rope(moved: float) -> None:
    rope, device = [0.9, 1.0, 0.95], [moved, 1.4 * moved]
    lasts = np.ones(5, dtype=bool)
    assert _agreeing(np.array([*rope, *device]), lasts).tolist() == [True] * 3 + [False] * 2


@pytest.mark.parametrize("moved", [0.2, 4.5])
def test_two_devices_that_do_alike_for_moments_do_not_outvote_a_rope_that_is_held(
    moved: float,
) -> None:
    stiffness = np.array([1.0, moved, 1.1 * moved, 0.9 * moved])
    lasts = np.array([True, False, False, False])
    assert _agreeing(stiffness, lasts).tolist() == [True, False, False, False]


def test_stretches_that_end_too_soon_to_be_a_clamp_say_nothing_alone() -> None:
    time_s, stiffness = np.arange(3.0), np.array([2.1, 1.7, 1.3])
    assert not HeldRopes(time_s, stiffness, np.zeros(3, dtype=bool)).shown
    held = HeldRopes(time_s, stiffness, np.array([False, True, False]))
    noise = np.diag(held.group().noise)
    assert held.shown and noise[1] < 0.25 * noise[0]


def test_no_clamp_holds_a_rope_for_longer_than_its_device_needs_to_go_back() -> None:
    traction = build_machine().traction
    back_s = traction.stroke_m / traction.return_speed_m_s + 2.0 * traction.clamp_s
    assert _is_a_clamp(back_s, 1.0, traction) and _is_a_clamp(0.6, 1.0, traction)
    assert not _is_a_clamp(1.3 * back_s, 1.0, traction)


@pytest.mark.parametrize("share", [0.4, 1.0, 2.5])
def test_no_rope_is_so_soft_that_its_pull_hardly_rises(share: float) -> None:
    traction = build_machine().traction
    assert _is_a_clamp(1.5, share, traction)
    assert not _is_a_clamp(1.5, 0.05 * share, traction)


def test_of_two_that_disagree_the_stiffer_one_counts() -> None:
    lasts = np.ones(2, dtype=bool)
    assert _agreeing(np.array([0.9, 0.3]), lasts).tolist() == [True, False]
