"""Gains of sensors, of a piston whose every force is known: a load cell that is off by some per
cent, a sensor whose gain jumps, and what a model lacks without any sensor's fault.
"""

from __future__ import annotations

import numpy as np
import pytest

from testbed.formats.arrays import Array
from testbed.recording.checker.forces import Forces
from testbed.recording.checker.gains import check_gains
from testbed.recording.checker.motion import Even
from testbed.recording.known import Known
from tests.recording.test_signs_and_scales import NAMES, changed, piston


def after(values: Array, share: float, factor: float) -> Array:
    """The series with its last part, from a share of it on, times a factor."""
    out = values.copy()
    out[round(share * len(values)) :] *= factor
    return out


def test_a_sound_piston_has_no_gain_that_is_off() -> None:
    assert list(check_gains(changed(), NAMES)) == []


@pytest.mark.parametrize("factor", [1.15, 0.85])
def test_a_load_cell_that_is_fifteen_per_cent_off_is_told_with_its_factor(factor: float) -> None:
    (finding,) = check_gains(changed(reference=factor * piston().series["reference"]), NAMES)
    assert (finding.severity, finding.channel) == ("warning", "load cell")
    assert finding.what.startswith(f"reads {factor:.3g} times the force that balances")


@pytest.mark.parametrize("channel", ["pressure_a", "pressure_b", "reference"])
@pytest.mark.parametrize(("share", "factor"), [(0.31, 1.1), (0.7, 0.9)])
def test_a_gain_that_jumps_is_told_with_its_channel_moment_and_factor(
    channel: str, share: float, factor: float
) -> None:
    spoilt = after(piston().series[channel], share, factor)
    (finding,) = check_gains(changed(**{channel: spoilt}), NAMES)
    assert (finding.severity, finding.channel) == ("error", NAMES[channel])
    assert finding.what == f"its gain jumps by a factor of {factor:.3g}"
    assert finding.from_s == pytest.approx(10.0 * share, abs=0.1)


def test_a_drift_a_spring_and_friction_that_warms_up_are_left_to_the_diagnosis() -> None:
    sound = piston()
    t = np.arange(len(sound.speed_m_s)) / sound.rate_hz
    load, pressure = sound.series["reference"], sound.series["pressure_a"]
    travel = np.cumsum(sound.speed_m_s) / sound.rate_hz
    cooling = 300.0 * np.exp(-t / 6.0) * np.sign(sound.speed_m_s)
    for spoilt in (
        {"pressure_a": pressure + 8e3 * t},
        {"reference": load + 4000.0 * travel},
        {"reference": load - cooling},
    ):
        assert list(check_gains(changed(**spoilt), NAMES)) == []


def held(factor: float = 1.0, from_share: float = 0.0) -> Forces:
    """A sealed piston moved to and fro at a held 4 bar, with 8 N of friction, and a load cell that
    reads `factor` times its force from a share of the time on.
    """
    rng, t = np.random.default_rng(3), np.arange(0.0, 30.0, 0.01)
    speed = 0.01 * np.sign(np.sin(2.0 * np.pi * 0.17 * t))
    known = Known(bore_m=0.025, inclination_deg=90.0)
    pressure = 4.0e5 + 200.0 * rng.standard_normal(t.size)
    cell = known.area_a_m2 * pressure - 8.0 * np.sign(speed) + 0.1 * rng.standard_normal(t.size)
    series = {"pressure_a": pressure, "reference": after(cell, from_share, factor)}
    return Forces(Even(100.0, speed, np.zeros_like(t), series), known)


def test_at_a_held_pressure_the_zero_tells_of_a_cell_that_is_off_and_of_no_sound_one() -> None:
    assert list(check_gains(held(), NAMES)) == []
    assert list(check_gains(held(0.96), NAMES)) == []  # as far off as a nominal bore may be
    (finding,) = check_gains(held(0.88), NAMES)
    assert (finding.severity, finding.channel) == ("warning", "load cell")
    assert finding.what.startswith("reads 0.88 times the force that balances")


@pytest.mark.parametrize("factor", [1.1, 0.9])
def test_a_jump_at_a_held_pressure_is_not_explained_by_a_gain_of_nought(factor: float) -> None:
    (finding,) = check_gains(held(factor, 0.5), NAMES)
    assert (finding.severity, finding.channel) == ("error", "load cell")
    assert finding.what.startswith(f"its gain jumps by a factor of {factor:.2g}")
    assert finding.from_s == pytest.approx(15.0, abs=0.5)
