"""A stride out of reach is refused with its cause and with what would fit, and that fits."""

from __future__ import annotations

import re

import pytest

from testbed.errors import InputError
from testbed.scenario.scenario import load_scenario
from testbed.world.simulation import Simulation

ASIDE = ("ropes.azimuth_deg=28",)


def _begin(*changes: str) -> None:
    Simulation(load_scenario("crawl_slope_60", list(changes), duration=0.1)).close()


def _refused(*changes: str) -> str:
    with pytest.raises(InputError) as refused:
        _begin(*changes)
    return str(refused.value)


@pytest.mark.slow
def test_a_stride_that_is_said_to_fit_does_and_a_longer_one_does_not() -> None:
    said = _refused("task.step_length_m=0.9")
    assert "takes " in said and "out of its range" in said
    longest = float(re.findall(r"a stride up to ([\d.]+) m", said)[0])
    _begin(f"task.step_length_m={longest - 0.01:g}")
    _refused(f"task.step_length_m={longest + 0.05:g}")


@pytest.mark.slow
def test_ropes_that_lead_aside_are_told_what_would_pull_straight_and_it_does() -> None:
    said = _refused(*ASIDE)
    assert "28 deg aside" in said and "mm off the middle of the feet" in said
    assert "ropes.pull: straight with anchors more than 28 m apart" in said
    straight = (*ASIDE, "ropes.pull=straight")
    said = _refused(*straight)
    assert "anchors more than 28 m apart" in said and "ropes.pull" not in said
    _begin(*straight, "ropes.anchor_spread_m=36")


@pytest.mark.slow
def test_the_azimuth_that_is_said_to_fit_is_the_same_however_far_aside_one_asks() -> None:
    """On 60 degrees 6 degrees fit and 7 do not; from 20 on the start leaves feet at their limit."""
    for asked in (8, 25):
        said = _refused(f"ropes.azimuth_deg={asked}")
        assert float(re.findall(r"up to about (\d+) deg aside", said)[0]) == pytest.approx(6, abs=1)
    _begin("ropes.azimuth_deg=6")
    _refused("ropes.azimuth_deg=7")
