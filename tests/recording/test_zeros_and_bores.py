"""Zeros, bores, masses and clocks of single channels, of a piston whose every force is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from testbed.benchmarks.recording_mistakes.planting import clock_jitters, from_the_rod_end
from testbed.benchmarks.recording_mistakes.sample import load
from testbed.formats.arrays import Array
from testbed.recording.checker.balance import check_balance
from testbed.recording.checker.check import check_recording
from testbed.recording.checker.clock import check_clock
from testbed.recording.checker.flow import check_flow
from testbed.recording.checker.forces import Forces
from testbed.recording.checker.late import check_late
from testbed.recording.checker.motion import Even
from testbed.recording.checker.raw import Raw, read_raw
from testbed.recording.checker.zero import constant_force
from tests.recording.test_signs_and_scales import KNOWN, NAMES, RATE_HZ, changed, piston

LEG = Path(__file__).parents[1] / "data" / "first_version" / "leg" / "verify" / "press"


@pytest.mark.parametrize("zero_n", [1000.0, -1000.0])
def test_a_zero_is_told_in_the_unit_of_every_sensor_that_may_have_it(zero_n: float) -> None:
    (found,) = check_balance(changed(reference=piston().series["reference"] + zero_n), NAMES)
    assert found.severity == "warning" and f"load cell: by {zero_n:.3g} N" in found.what
    assert f"its zero is off by {-zero_n / KNOWN.area_a_m2:.3g} Pa" in found.what


def test_a_seal_that_holds_one_way_more_than_the_other_is_no_zero() -> None:
    """Three times as much out as back: half of that difference is missing both ways."""
    even = piston()
    more = np.where(even.speed_m_s > 0.0, 800.0, 0.0)
    pressure_a = even.series["pressure_a"] + more / KNOWN.area_a_m2
    assert constant_force(changed(pressure_a=pressure_a)) is None
    assert constant_force(changed()) is None


@pytest.mark.parametrize("factor", [0.8, 1.2])
def test_a_bore_that_is_a_fifth_off_is_named(factor: float) -> None:
    wrong = KNOWN.model_copy(update={"bore_m": factor * 0.08})
    found = list(check_balance(Forces(piston(), wrong), NAMES))
    assert "known.bore_m" in found[0].channel
    assert f"multiplied by {1.0 / factor:.3g}" in found[0].what


def test_a_bore_leaves_the_rod_as_it_is_and_a_unit_does_not() -> None:
    forces = Forces(piston(), KNOWN)
    rod = KNOWN.area_a_m2 - KNOWN.area_b_m2
    alone, whole = (forces.left_over({name: 2.0})[0] for name in ("bore_alone", "bore_m"))
    assert whole - alone == pytest.approx(3.0 * rod * piston().series["pressure_b"])


def test_a_mass_that_is_off_by_half_is_a_warning_and_one_in_another_unit_an_error() -> None:
    for factor, severity in ((1.6, "warning"), (1000.0, "error")):
        t = np.arange(0.0, 10.0, 1.0 / RATE_HZ)
        speed = 0.3 * np.sin(9.0 * t)
        acceleration = 2.7 * np.cos(9.0 * t)
        force = 80.0 * acceleration + 15.0 * np.sign(speed)
        even = Even(RATE_HZ, speed, acceleration, {"force": force})
        known = KNOWN.model_copy(update={"moving_mass_kg": factor * 80.0, "inclination_deg": 90.0})
        (found, *_) = check_balance(Forces(even, known), {"force": "actuator_force"})
        assert found.severity == severity and "known.moving_mass_kg" in found.channel + found.what


def test_all_counted_from_the_rod_end_is_told_from_exchanged_chambers(tmp_path: Path) -> None:
    sample = load(LEG)
    (found,) = [
        one
        for one in check_recording(sample.with_mistake(from_the_rod_end()).write(tmp_path)).findings
        if one.severity == "error"
    ]
    assert found.channel == "pressure_a, pressure_b" and "rod's end" in found.what


def late(values: Array, seconds: float) -> Array:
    return np.roll(values, round(seconds * RATE_HZ))


def test_one_pressure_that_comes_late_is_named_with_its_delay() -> None:
    pressure_b = piston().series["pressure_b"]
    (found,) = check_late(changed(pressure_b=late(pressure_b, 0.06)), NAMES)
    assert found.channel == "pressure_b" and found.what.startswith("comes late")
    assert check_late(changed(pressure_b=late(pressure_b, 0.02)), NAMES) == []


def times(jitter: float, sampled: bool) -> Raw:
    """A swing recorded at stamps that are off by a share of a step; `sampled`: when they say so."""
    even = np.arange(8000) / RATE_HZ
    stamps = even + jitter / RATE_HZ * np.random.default_rng(0).uniform(-1.0, 1.0, even.size)
    position = 0.2 + 0.1 * np.sin(2.0 * (stamps if sampled else even))
    position = np.round(position / 1e-4) * 1e-4
    header = read_raw(LEG).header.model_copy(update={"sample_rate_hz": RATE_HZ})
    return Raw("swing", "vertical-leg", header, stamps, {"position": position}, {}, {})


@pytest.mark.parametrize(
    ("jitter", "sampled", "told"), [(0.4, False, True), (0.4, True, False), (0.0, False, False)]
)
def test_stamps_jitter_where_the_motion_knows_nothing_of_it(
    jitter: float, sampled: bool, told: bool
) -> None:
    assert any("jitter" in found.what for found in check_clock(times(jitter, sampled))) == told


def test_jitter_is_planted_within_the_step(tmp_path: Path) -> None:
    sample = load(LEG)
    steps = np.diff(sample.with_mistake(clock_jitters(0.4))["time"])
    assert steps.min() > 0.0 and np.std(steps) > 0.2 * sample.step_s()


@pytest.mark.parametrize(("highest", "told"), [(0.02, True), (0.5, False)])
def test_a_piston_that_slides_within_the_dead_band_shows_another_scale(
    highest: float, told: bool
) -> None:
    even = piston()
    known = KNOWN.model_copy(update={"valve_deadband": 0.03})
    command = highest * np.sign(even.speed_m_s)
    found = check_flow(
        Even(RATE_HZ, even.speed_m_s, even.acceleration_m_s2, {"command": command}), known, "u"
    )
    assert any("dead band" in one.what for one in found) == told
