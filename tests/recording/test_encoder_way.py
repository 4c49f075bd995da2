"""A robot's encoder goes about as far as its valve lets oil in; a dead one and one of another unit
do not.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from testbed.recording.checker.encoder_way import check_encoder_way, check_held_valve
from testbed.recording.checker.raw import Raw, read_raw

SAMPLE = Path(__file__).parents[1] / "data" / "first_version" / "robot"
AXIS = "fl_vertical"
RATE_HZ, SECONDS = 250.0, 8.0
TIME_S = np.arange(0.0, SECONDS, 1.0 / RATE_HZ)
COMMAND = np.where(np.sin(math.pi * TIME_S / 2.0) > 0.0, 0.3, -0.3)
"""Two seconds out, two seconds in."""


def raw(command: np.ndarray = COMMAND, share: float = 1.0) -> Raw:
    """A vertical cylinder that goes as its valve lets oil in at a drop of half the supply."""
    sample = read_raw(SAMPLE)
    assert sample.machine is not None
    axis = sample.machine.axes[AXIS]
    opening = (np.abs(COMMAND) - axis.valve.deadband) / (1.0 - axis.valve.deadband)
    flow = axis.rated_flow_m3_s * opening * math.sqrt(4.5e6 / axis.valve.rated_drop_per_edge_pa)
    speed = share * np.sign(COMMAND) * flow / (math.pi / 4.0 * axis.cylinder.bore_m**2)
    series = {
        "supply_pressure": np.full(len(TIME_S), 9e6),
        f"pressure_a_{AXIS}": np.full(len(TIME_S), 4.5e6),
        f"valve_{AXIS}": command,
        f"position_{AXIS}": 0.2 + np.cumsum(speed) / RATE_HZ,
    }
    return replace(sample, time_s=TIME_S, series=series)


@pytest.mark.parametrize("share", [0.3, 1.0, 3.0])
def test_an_encoder_that_goes_roughly_as_its_valve_is_sound(share: float) -> None:
    assert list(check_encoder_way(raw(share=share), AXIS)) == []
    assert list(check_held_valve(raw(share=share), AXIS)) == []


def test_a_dead_encoder_is_told_from_a_piston_that_no_valve_moves() -> None:
    sound = raw()
    still = {f"position_{AXIS}": np.full(len(TIME_S), 0.2)}
    dead = replace(sound, series=sound.series | still)
    (finding,) = check_encoder_way(dead, AXIS)
    assert finding.channel == f"position_{AXIS}" and "never changes" in finding.what
    shut = {f"valve_{AXIS}": np.zeros(len(TIME_S))}
    assert list(check_encoder_way(replace(dead, series=dead.series | shut), AXIS)) == []


def test_a_position_that_is_read_in_mm_has_another_scale() -> None:
    sound = raw()
    small = {f"position_{AXIS}": 1e-3 * sound.series[f"position_{AXIS}"]}
    (finding,) = check_encoder_way(replace(sound, series=sound.series | small), AXIS)
    assert "another scale" in finding.what


@pytest.mark.parametrize(("held", "words"), [(0.0, "shuts the valve"), (-0.3, "against it")])
def test_a_command_that_was_not_recorded_is_told_by_where_the_piston_goes(
    held: float, words: str
) -> None:
    frozen = np.where((TIME_S > 4.5) & (TIME_S < 6.0), held, COMMAND)
    (finding,) = check_held_valve(raw(frozen), AXIS)
    assert finding.channel == f"valve_{AXIS}" and words in finding.evidence
    assert finding.from_s is not None and finding.from_s > 4.5
