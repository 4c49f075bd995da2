"""The floor of sensors and encoder: each gain against noise that is really smoothed, each floor
against its formula.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d
from synthetic_bench import bench

from testbed.diagnosis.leg.floor import (
    flow_floor_m3_s,
    force_floor_n,
    rate_gain,
    smoothing_gain,
)
from testbed.diagnosis.leg.noise import white_noise
from testbed.diagnosis.leg.series import series_of
from testbed.estimation.leg.motion import WIDTH_S
from testbed.recording.leg_model import Friction

RATE_HZ = 1000.0
FRICTION = Friction(
    viscous_plus_n_s_m=5000.0, coulomb_plus_n=80.0, viscous_minus_n_s_m=4000.0, coulomb_minus_n=80.0
)


def test_white_noise_is_told_from_whatever_is_slower() -> None:
    t = np.arange(20_000) / RATE_HZ
    slow = 1e6 + 3e5 * t + 2e5 * np.sin(2.0 * np.pi * 0.5 * t)
    noise = 250.0 * np.random.default_rng(3).standard_normal(len(t))
    assert white_noise(slow) < 1.0
    assert white_noise(slow + noise) == pytest.approx(250.0, rel=0.03)
    spiky = slow + noise
    spiky[::100] += 1e5
    assert white_noise(spiky) == pytest.approx(250.0, rel=0.1)


@pytest.mark.parametrize("width_s", [0.002, 0.005, 0.02])
def test_gains_are_those_of_gaussian_smoothing_and_its_derivative(width_s: float) -> None:
    noise = np.random.default_rng(4).standard_normal(400_000)
    smoothed = gaussian_filter1d(noise, width_s * RATE_HZ)
    rate = RATE_HZ * gaussian_filter1d(noise, width_s * RATE_HZ, order=1)
    assert smoothing_gain(RATE_HZ, width_s) == pytest.approx(smoothed.std(), rel=0.02)
    assert rate_gain(RATE_HZ, width_s) == pytest.approx(rate.std(), rel=0.03)


def test_the_force_floor_is_pressure_noise_through_the_area_and_the_smoothing() -> None:
    """An encoder without error leaves 200 Pa on the piston's area and the load cell's noise."""
    recordings, known = bench([0.01, 0.03])
    recording = recordings[0]
    (series,) = series_of([recording], known)
    still = np.zeros_like(series.velocity_noise_m_s)
    series = replace(series, velocity_noise_m_s=still, acceleration_noise_m_s2=still)
    floor = force_floor_n(series, recording, FRICTION, WIDTH_S)
    cell = 1.7  # nobody declares its noise: what is white in its column counts
    area = series.signals.known.area_a_m2
    expected = np.hypot(200.0 * area, cell) * smoothing_gain(series.full_rate_hz, WIDTH_S)
    assert floor.std() == pytest.approx(expected, rel=0.1)


def test_an_error_of_the_speed_leaves_viscous_friction_in_the_force_and_area_in_the_flow() -> None:
    recordings, known = bench([0.01, 0.03])
    recording = recordings[0]
    (series,) = series_of([recording], known)
    off = np.full_like(series.velocity_noise_m_s, 1.0)
    still = replace(series, velocity_noise_m_s=0.0 * off, acceleration_noise_m_s2=0.0 * off)
    moving = replace(still, velocity_noise_m_s=off)
    more = force_floor_n(moving, recording, FRICTION, WIDTH_S) - force_floor_n(
        still, recording, FRICTION, WIDTH_S
    )
    out = series.signals.velocity_m_s > 0.0
    np.testing.assert_allclose(more, np.where(out, -5000.0, -4000.0))
    flow = flow_floor_m3_s(moving, recording)[0] - flow_floor_m3_s(still, recording)[0]
    np.testing.assert_allclose(flow, series.signals.known.area_a_m2)
