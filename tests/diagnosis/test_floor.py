"""The floor of sensors and encoder, against noise that is really smoothed and against formulas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic_bench import bench

from testbed.benchmarks.diagnosis.bench_rigs import make_bench
from testbed.diagnosis.leg.floor import flow_floor_m3_s, force_floor_n
from testbed.diagnosis.leg.noise import white_noise
from testbed.diagnosis.leg.series import BIN, Series, series_of
from testbed.recording.axis import Recording
from testbed.recording.leg_model import Friction

RATE_HZ = 1000.0
SOUND = 16
"""A drive that lacks nothing."""
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


def _one_channel(rate_hz: float, force_n: np.ndarray) -> tuple[Recording, Series]:
    """(recording, series) of a drive that goes to and fro with this force, its encoder perfect."""
    rig, _ = make_bench(SOUND)
    first = rig.identify[0]
    t = np.arange(len(force_n)) / rate_hz
    channels = dict(first.header.channels)
    channels["position"] = channels["position"].model_copy(update={"resolution": None})
    recording = replace(
        first,
        header=first.header.model_copy(
            update={"sample_rate_hz": rate_hz, "channels": channels},
        ),
        time_s=t,
        position_m=0.1 + 0.05 * np.sin(t),
        actuator_force_n=force_n,
        reference_force_n=np.zeros_like(t),
        saturated_a=np.zeros(len(t), dtype=np.bool_),
        saturated_b=np.zeros(len(t), dtype=np.bool_),
        extra={},
    )
    (series,) = series_of([recording])
    return recording, series


@pytest.mark.parametrize("rate_hz", [100.0, 250.0, 1000.0, 4000.0])
@pytest.mark.slow
def test_the_floor_of_a_bin_is_what_really_smoothed_white_noise_leaves_there(
    rate_hz: float,
) -> None:
    """Gaussian smoothing of width w correlates samples that lie apart by d by exp(-d^2 / 4 w^2): a
    bin's mean over three of them is hardly smaller than each.
    """
    noise = np.random.default_rng(4).standard_normal(round(200.0 * rate_hz))
    recording, series = _one_channel(rate_hz, 7.0 * noise)
    everywhere = np.ones(len(series.signals.time_s), dtype=np.bool_)
    floor = series.binned(force_floor_n(series, recording, FRICTION), everywhere)[0]
    force_n = series.signals.actuator_force_n
    assert force_n is not None
    left = series.binned(force_n, everywhere)[0]
    width, apart = series.width_s, 1.0 / series.signals.rate_hz
    alike = [np.exp(-((k * apart / width) ** 2) / 4.0) for k in range(BIN)]
    bin_mean = np.sqrt(sum((BIN - abs(k)) * alike[abs(k)] for k in range(1 - BIN, BIN))) / BIN
    expected = 7.0 * bin_mean / np.sqrt(2.0 * np.sqrt(np.pi) * width * rate_hz)
    assert left.std() == pytest.approx(expected, rel=0.03)
    assert floor.std() == pytest.approx(expected, rel=0.03)


def test_the_force_floor_is_pressure_noise_through_the_area_and_the_load_cells_own() -> None:
    """An encoder without error leaves 200 Pa on the piston's area and the load cell's noise."""
    recordings, known = bench([0.01, 0.03])
    recording = recordings[0]
    (series,) = series_of([recording], known)
    still = np.zeros_like(series.velocity_noise_m_s)
    series = replace(series, velocity_noise_m_s=still, acceleration_noise_m_s2=still)
    floor = force_floor_n(series, recording, FRICTION)
    cell = 1.7  # nobody declares its noise: what is white in its column counts
    area = series.signals.known.area_a_m2
    smoothed = 1.0 / np.sqrt(2.0 * np.sqrt(np.pi) * series.width_s * series.full_rate_hz)
    assert floor.std() == pytest.approx(np.hypot(200.0 * area, cell) * smoothed, rel=0.1)


def test_what_a_flow_needs_for_a_pressures_noise_is_the_oils_share_of_its_slope() -> None:
    """1e6 Pa at 1 Hz into a litre of oil of 1e9 Pa takes 2 pi 1e-6 m3/s, a quarter turn ahead."""
    recordings, known = bench([0.01, 0.03])
    known = known.model_copy(
        update={"dead_volume_a_m3": 1e-3, "bulk_modulus_pa": 1e9, "bore_m": 1e-4}
    )
    (series,) = series_of(recordings[:1], known)
    turns = 2.0 * np.pi * series.signals.time_s
    still = np.zeros_like(turns)
    series = replace(
        series, velocity_noise_m_s=still, pressure_noise_pa=(1e6 * np.sin(turns), None)
    )
    flow_a, flow_b = flow_floor_m3_s(series)
    inside = slice(5, -5)
    expected = 2.0 * np.pi * 1e-6 * np.cos(turns)
    np.testing.assert_allclose(flow_a[inside], expected[inside], rtol=1e-3, atol=1e-8)
    assert not flow_b.any()


def test_an_error_of_the_speed_leaves_viscous_friction_in_the_force_and_area_in_the_flow() -> None:
    recordings, known = bench([0.01, 0.03])
    recording = recordings[0]
    (series,) = series_of([recording], known)
    off = np.full_like(series.velocity_noise_m_s, 1.0)
    still = replace(series, velocity_noise_m_s=0.0 * off, acceleration_noise_m_s2=0.0 * off)
    moving = replace(still, velocity_noise_m_s=off)
    more = force_floor_n(moving, recording, FRICTION) - force_floor_n(still, recording, FRICTION)
    out = series.signals.velocity_m_s > 0.0
    np.testing.assert_allclose(more, np.where(out, -5000.0, -4000.0))
    flow = flow_floor_m3_s(moving)[0] - flow_floor_m3_s(still)[0]
    np.testing.assert_allclose(flow, series.signals.known.area_a_m2)
