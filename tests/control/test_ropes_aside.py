"""Ropes whose anchors lie to one side: how two of them pull as straight as they can, and what no
posture holds.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shipped import shipped_model
from walking_machine import believed_start, scenario

import testbed
from testbed.control.gaits.crawl.posture import friction_share, nearest_deg, widest_deg
from testbed.scenario.scenario import load_scenario
from testbed.world.start import TAUT_SHARE, straight_shares


def _ropes(*degrees: float) -> np.ndarray:
    aside = np.radians(degrees)
    return np.column_stack([np.cos(aside), np.sin(aside), np.zeros(2)])


def test_ropes_on_both_sides_share_so_that_nothing_pulls_aside() -> None:
    ropes = _ropes(14.5, -4.5)
    shares = straight_shares(ropes)
    assert shares.max() == 1.0
    assert shares @ ropes[:, 1] == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_array_equal(straight_shares(_ropes(9.5, -9.5)), [1.0, 1.0])


def test_of_ropes_on_one_side_the_nearer_one_pulls_and_the_other_stays_taut() -> None:
    np.testing.assert_array_equal(straight_shares(_ropes(24.0, 5.0)), [TAUT_SHARE, 1.0])
    np.testing.assert_array_equal(straight_shares(_ropes(-5.0, -24.0)), [1.0, TAUT_SHARE])


@pytest.mark.parametrize(("left", "right", "nearest"), [(24.0, 5.0, 5.0), (9.0, -9.0, 0.0)])
def test_the_least_friction_of_any_posture_by_hand(
    left: float, right: float, nearest: float
) -> None:
    """60 degrees and 0.65: sin(a) tan 60 > 0.65 from 22 degrees on."""
    weight = shipped_model().total_mass_kg * 9.81
    start = replace(
        believed_start(scenario()),
        load_n=np.full(4, weight / 8),
        rope_directions_in_body=_ropes(left, right),
    )
    assert nearest_deg(start) == pytest.approx(nearest)
    by_hand = np.sin(np.radians(nearest)) * np.tan(np.radians(60.0)) / 0.65
    assert friction_share(start) == pytest.approx(by_hand, abs=1e-9)
    assert widest_deg(start) == pytest.approx(22.04, abs=0.01)


@pytest.mark.slow
def test_a_crawl_sets_off_where_a_program_shares_out_ropes_that_pull_from_one_side() -> None:
    changes = ["ropes.azimuth_deg=30", "ropes.anchor_spread_m=40", "ropes.pull=straight"]
    changes += ["terrain.slope_deg=60", "robot.rotation_deg=[12,-12,-12,12]", "robot.radial_m=0.19"]
    changes += ["control.distribution=qp", "duration_s=12"]
    with testbed.simulate(load_scenario("crawl_slope_45", changes)) as run:
        while not run.finished:
            run.step(1000)
        assert run.summary()["climbed_m"] > 0.12
