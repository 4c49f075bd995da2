"""Calibration (2): known a and b come back, regions hold what they promise, outliers and bad data
are handled.
"""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from testbed.benchmarks.estimators.identification_trials import (
    KNOWN,
    air_recording,
    inside,
    press_recording,
    random_friction,
    recording_of,
)
from testbed.errors import InputError
from testbed.estimation.calibration import B_SD_V, calibrate, volts
from testbed.recording.axis import read_recording

DATA = os.environ.get("TESTBED_DATA")


@pytest.fixture(scope="module")
def pressed():
    return press_recording(5)


def one_sensor(a=1.02, b=0.03, seconds=10.0):
    """The paper's figure 4: a leg pressed on the load cell at rest, no friction, chamber B without
    pressure.
    """
    t = np.arange(0, seconds, 1e-3)
    load = 7500.0 - 7000.0 * np.cos(2 * np.pi * 0.1 * t)
    pa = (load - 91.7 * 9.81) / KNOWN.area_a_m2
    measured = 2e6 * ((pa / 2e6 - b) / a)
    return recording_of(
        t, np.full_like(t, 0.2), measured, np.zeros_like(t), load, KNOWN, "load-cell"
    )


def test_straight_line_of_figure_4_gives_back_a():
    # V = (p / k - b) / a: the slope of F over V is A_A k a = 3.848e-3 * 2e6 * 1.02 = 7851 N/V
    found = calibrate([one_sensor()])
    assert not found.friction_fitted
    assert found.sensors["pressure_a"].a == pytest.approx(1.02, abs=1e-3)


def test_voltage_is_pressure_over_k_minus_b_over_a():
    r = one_sensor()
    assert volts(r, "pressure_a") == pytest.approx(r.pressure_a_pa / 2.0e6)


def test_gains_come_back_to_a_tenth_of_a_per_cent_from_a_moving_press(pressed):
    recording, true = pressed
    for sensor, (a, _) in zip(calibrate([recording]).sensors.values(), true, strict=True):
        assert sensor.a == pytest.approx(a, abs=1e-3)


def test_zeros_that_no_motion_tells_apart_keep_an_honest_uncertainty(pressed):
    for sensor in calibrate([pressed[0]]).sensors.values():
        assert 0.3 * B_SD_V < np.sqrt(sensor.covariance[1, 1]) <= 1.01 * B_SD_V


def test_gross_outliers_do_not_move_the_gain(pressed):
    recording, _ = pressed
    before = calibrate([recording]).sensors["pressure_a"]
    pa = recording.pressure_a_pa.copy()
    pa[np.random.default_rng(2).integers(0, pa.size, 60)] = 9.0e6
    after = calibrate([replace(recording, pressure_a_pa=pa)])
    assert after.sensors["pressure_a"].a == pytest.approx(before.a, abs=1e-3)
    assert after.outliers > 20


def test_air_recording_alone_cannot_calibrate_and_says_so():
    air = air_recording(random_friction(np.random.default_rng(0)), 0)
    with pytest.raises(InputError, match="load cell with a changing load"):
        calibrate([air])


def test_recording_in_pa_cannot_be_calibrated(pressed):
    recording, _ = pressed
    channels = dict(recording.header.channels)
    channels["pressure_a"] = channels["pressure_a"].model_copy(update={"calibration": None})
    plain = replace(recording, header=recording.header.model_copy(update={"channels": channels}))
    with pytest.raises(InputError, match=r"channels.pressure_a.*not recorded in V"):
        calibrate([plain])


def test_clipped_samples_are_left_out_and_counted(pressed):
    recording, true = pressed
    top = float(np.quantile(recording.pressure_a_pa, 0.9))
    clipped = recording.pressure_a_pa >= top
    pa = np.minimum(recording.pressure_a_pa, top)
    sensor = calibrate([replace(recording, pressure_a_pa=pa, saturated_a=clipped)]).sensors[
        "pressure_a"
    ]
    assert sensor.saturated == int(clipped.sum())
    assert "end of the range" in sensor.warning
    assert sensor.a == pytest.approx(true[0, 0], abs=2e-3)


def test_sensor_clipped_most_of_the_time_is_refused(pressed):
    full = np.ones(len(pressed[0]), dtype=bool)
    with pytest.raises(InputError, match="end of its range in 100 %"):
        calibrate([replace(pressed[0], saturated_a=full)])


def test_recordings_of_two_rigs_are_refused(pressed):
    header = pressed[0].header.model_copy(
        update={"known": KNOWN.model_copy(update={"bore_m": 0.08})}
    )
    with pytest.raises(InputError, match=r"known.bore_m"):
        calibrate([pressed[0], replace(pressed[0], header=header)])


def declaring(recording, **numbers):
    """The recording, with other numbers declared of its machine."""
    known = recording.known.model_copy(update=numbers)
    return replace(recording, header=recording.header.model_copy(update={"known": known}))


def test_a_mass_that_nobody_declares_is_an_unknown_and_no_zero(pressed):
    recording, _ = pressed
    declared = calibrate([recording])
    found = calibrate([declaring(recording, moving_mass_kg=None)])
    assert found.residual_n < 1.05 * declared.residual_n
    for name, sensor in declared.sensors.items():
        other = found.sensors[name]
        assert other.a == pytest.approx(sensor.a, abs=5e-4)
        assert abs(other.b - sensor.b) < np.sqrt(other.covariance[1, 1])


def test_a_leg_that_only_presses_tells_less_of_its_zero_where_nobody_declares_its_mass():
    quiet = one_sensor()
    noise = np.random.default_rng(0).normal(0.0, 2e3, len(quiet))
    pressed = replace(quiet, pressure_a_pa=quiet.pressure_a_pa + noise)
    declared = calibrate([pressed]).sensors["pressure_a"]
    found = calibrate([declaring(pressed, moving_mass_kg=None)]).sensors["pressure_a"]
    assert found.a == pytest.approx(1.02, abs=1e-3)
    assert abs(found.b - 0.03) < 2.0 * np.sqrt(found.covariance[1, 1])
    assert found.covariance[1, 1] > declared.covariance[1, 1]


def test_a_rod_that_nobody_declares_is_one_line(pressed):
    with pytest.raises(InputError, match=r"known.rod_m: is missing"):
        calibrate([declaring(pressed[0], rod_m=None)])


@pytest.mark.slow
def test_ninety_five_per_cent_regions_hold_the_truth_as_often_as_they_say_in_200_trials():
    from scipy.stats import binomtest

    held = [inside(calibrate([r]), true) for r, true in map(press_recording, range(200))]
    for count in np.sum(held, axis=0):
        assert binomtest(int(count), 200, 0.95).pvalue > 0.01 / 2


def test_regions_of_a_few_trials_hold_the_truth_mostly():
    held = [inside(calibrate([r]), true) for r, true in map(press_recording, range(20))]
    assert np.sum(held) >= 33  # of 40; less has a probability of 0.1 %


@pytest.mark.skipif(DATA is None, reason="TESTBED_DATA (a folder with recordings/) is not set")
def test_declared_calibration_of_a_rig_without_sensor_fault_is_found_again():
    folder = Path(DATA) / "recordings" / "rig-01" / "identify"
    result = calibrate([read_recording(folder / name) for name in ("press", "ramps")])
    for sensor in result.sensors.values():
        assert sensor.a == pytest.approx(sensor.declared[0], abs=1e-3)
        d = np.array([sensor.a, sensor.b]) - sensor.declared
        assert d @ np.linalg.solve(sensor.covariance, d) < 9.21  # 99 % of chi-square, two degrees


@pytest.mark.skipif(DATA is None, reason="TESTBED_DATA (a folder with recordings/) is not set")
def test_gain_error_of_a_rig_is_seen_as_its_gain():
    result = calibrate(
        [read_recording(Path(DATA) / "recordings" / "rig-07" / "identify" / "press")]
    )
    b = result.sensors["pressure_b"]
    assert b.declared[0] / b.a - 1.0 == pytest.approx(0.0406, abs=0.003)
