"""Samples that are missing: nothing is computed across a gap, and a gap is no frozen sensor."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from testbed.benchmarks.estimators.identification_trials import (
    KNOWN,
    air_recording,
    random_friction,
)
from testbed.estimation.friction.evidence import check_alive
from testbed.estimation.friction.identification import identify
from testbed.estimation.leg.force import estimate
from testbed.estimation.leg.gaps import stretches
from testbed.recording.axis import Recording
from testbed.recording.leg_model import EffectEntry, LegModel

FRICTION = random_friction(np.random.default_rng(3))


def swinging() -> Recording:
    """A foot in the air that swings at up to 0.2 m/s."""
    t = np.arange(30_000) * 1e-3
    return air_recording(FRICTION, 1, 0.15 * np.cos(2.0 * t) + 0.05 * np.cos(5.0 * t))


def missing(recording: Recording, gap_s: float) -> Recording:
    """The recording without `gap_s` of every five seconds."""
    kept = np.mod(recording.time_s - 2.3, 5.0) >= gap_s
    values = {field.name: getattr(recording, field.name) for field in fields(recording)}
    arrays = {key: value[kept] for key, value in values.items() if isinstance(value, np.ndarray)}
    return replace(recording, **arrays)


@pytest.fixture(scope="module")
def whole() -> Recording:
    return swinging()


def test_a_gap_is_no_frozen_sensor(whole: Recording) -> None:
    check_alive(missing(whole, 1.5))


def test_the_force_beside_a_gap_is_as_good_as_elsewhere(whole: Recording) -> None:
    model = LegModel(known=KNOWN, friction=FRICTION)
    cut = missing(whole, 0.4)
    assert len(stretches(cut)) == 7 and stretches(whole) == [whole]
    found, usual = estimate(cut, model), estimate(whole, model)
    assert np.array_equal(found.time_s, cut.time_s)
    least = np.interp(cut.time_s, usual.time_s, usual.force_n)
    moving = np.interp(cut.time_s, whole.time_s, np.abs(np.gradient(whole.position_m, 1e-3))) > 0.02
    assert np.abs(found.force_n - least)[moving].max() < 150.0


def test_what_lies_in_a_gap_identifies_nothing(whole: Recording) -> None:
    found = identify([missing(whole, 0.4)], KNOWN)
    assert max(found.residual_n) < 1.1 * max(identify([whole], KNOWN).residual_n)


def test_a_drift_goes_on_behind_a_gap(whole: Recording) -> None:
    drift = EffectEntry(name="sensor.drift_a", parameters={"rate": 1e4})
    plain = LegModel(known=KNOWN, friction=FRICTION)
    cut = missing(whole, 0.4)
    models = plain, plain.model_copy(update={"effects": (drift,)})
    without, having = (estimate(cut, model).force_n for model in models)
    since = cut.time_s - cut.time_s[0]
    moving = np.abs(np.gradient(cut.position_m, cut.time_s)) > 0.05
    drifted = without - having - 1e4 * since * KNOWN.area_a_m2
    assert np.median(np.abs(drifted[moving])) < 1.0
