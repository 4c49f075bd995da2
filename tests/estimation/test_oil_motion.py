"""The motion of a leg as its oil shows it: what rings between two counts of the encoder."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from testbed.benchmarks.reference_leg.rigs import make_rig
from testbed.diagnosis.leg.series import series_of
from testbed.estimation.leg.motion import WIDTH_S, signals_of
from testbed.estimation.leg.oil_motion import MOST_LATE, _late_samples, position_by_oil
from testbed.recording.axis import Recording
from testbed.recording.leg_model import LegModel

RATE = 1000.0
COUNT_M, HERTZ, PLACE_M = 1e-4, 25.0, 0.2


def ringing(swing_m: float) -> Recording:
    """A leg whose valve is shut and whose encoder stands still, while a swing of this amplitude
    presses the oil in both chambers: p = p0 - beta ln(V(x) / V(x0)).
    """
    whole = make_rig(2, "clean")[0].identify[0]
    known = whole.known
    t = np.arange(3000) / RATE
    wave = np.sin(2.0 * np.pi * HERTZ * t)
    x = PLACE_M + swing_m * wave
    volume_a = known.dead_volume_a_m3 + known.area_a_m2 * x
    volume_b = known.dead_volume_b_m3 + known.area_b_m2 * (known.stroke_m - x)
    header = whole.header.model_copy(update={"sample_rate_hz": RATE})
    return replace(
        whole.part(slice(0, t.size), "ringing"),
        header=header,
        began_s=None,
        time_s=t,
        position_m=np.full_like(t, PLACE_M),
        valve_command=np.zeros_like(t),
        pressure_a_pa=3e6 - known.bulk_modulus_pa * np.log(volume_a / volume_a.mean()),
        pressure_b_pa=3e6 - known.bulk_modulus_pa * np.log(volume_b / volume_b.mean()),
    )


def test_what_rings_within_a_count_is_seen_by_the_oil() -> None:
    swing = 0.4 * COUNT_M
    recording = ringing(swing)
    by_oil = position_by_oil(recording, LegModel(known=recording.known))
    inside = slice(200, -200)
    assert np.ptp(signals_of(recording).position_m) < 1e-12
    assert np.ptp(by_oil[inside]) == pytest.approx(2.0 * swing, rel=0.15)


def test_the_oil_is_believed_by_no_more_than_the_encoder_hides() -> None:
    recording = ringing(5.0 * COUNT_M)
    by_oil = position_by_oil(recording, LegModel(known=recording.known))
    assert np.abs(by_oil - PLACE_M).max() == pytest.approx(COUNT_M)


def test_a_motion_that_no_count_shows_is_an_error_of_the_speed() -> None:
    swing, turns = 0.4 * COUNT_M, 2.0 * np.pi * HERTZ
    (series,) = series_of([ringing(swing)])
    left = np.exp(-0.5 * (turns * WIDTH_S) ** 2)  # of a wave by the smoothing that all goes through
    missed = swing * turns * left / np.sqrt(2.0)
    assert series.velocity_noise_m_s[50:-50].std() == pytest.approx(missed, rel=0.15)
    (blind,) = series_of([replace(ringing(swing), valve_command=None)])
    assert np.abs(blind.velocity_noise_m_s).max() < 1e-12


@pytest.mark.parametrize(
    ("late", "seen"), [(0.0, 0.0), (0.75, 0.75), (-1.0, -1.0), (5.0, MOST_LATE)]
)
def test_a_valve_that_acts_later_than_its_row_says_is_seen_by_its_oil(
    late: float, seen: float
) -> None:
    t = np.arange(4000) / RATE
    noise = 1e-4 * np.random.default_rng(5).standard_normal(t.size)
    speed = 0.1 * np.sin(6.0 * t + 3.0 * np.sin(t))
    one_sample = np.gradient(speed)  # by so much does a valve of one sample less lead the piston
    as_usual = late * one_sample + noise
    assert _late_samples(as_usual, as_usual - one_sample) == pytest.approx(seen, abs=0.15)
