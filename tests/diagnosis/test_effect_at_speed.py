"""Sensors that are late are so at every speed; what is late in slow motion alone is no sensor's."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from testbed.benchmarks.reference_leg.rigs import make_rig
from testbed.diagnosis.leg.acceptance import Trial
from testbed.diagnosis.leg.base_models import declared, fit_base
from testbed.diagnosis.leg.effect_at_speed import share_at_speed
from testbed.diagnosis.leg.fit import Fit
from testbed.diagnosis.leg.hypotheses import fit_with
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.series import series_of
from testbed.effects import by_name
from testbed.estimation.friction.identification import identify_rig
from testbed.estimation.leg.motion import motion
from testbed.recording.axis import Recording, Rig

SOUND, LATE_S = 9635, 4e-3
DELAY = by_name("sensor.delay")
Read = Callable[[Recording], Recording]


def late(recording: Recording) -> Recording:
    """Both pressures read late, at every speed."""
    time_s, a, b = recording.time_s, recording.pressure_a_pa, recording.pressure_b_pa
    assert a is not None and b is not None
    return replace(
        recording,
        pressure_a_pa=np.interp(time_s - LATE_S, time_s, a),
        pressure_b_pa=np.interp(time_s - LATE_S, time_s, b),
    )


def late_while_slow(recording: Recording) -> Recording:
    """The same, and only while the piston is slower than 15 mm/s."""
    other, rate_hz = late(recording), 1.0 / float(np.median(np.diff(recording.time_s)))
    slow = np.abs(motion(recording.position_m, rate_hz, 0.01)[1]) < 0.015
    return replace(
        recording,
        pressure_a_pa=np.where(slow, other.pressure_a_pa, recording.pressure_a_pa),
        pressure_b_pa=np.where(slow, other.pressure_b_pa, recording.pressure_b_pa),
    )


def with_delay(read: Read) -> tuple[Problem, Fit]:
    """A sound leg as it is read, fitted with a delay by its forces."""
    sound, _ = make_rig(SOUND, "clean")
    rig = Rig(sound.name, sound.folder, tuple(map(read, sound.identify)), sound.verify)
    base = declared(rig, identify_rig(rig).model)
    problem = Problem(series_of(rig.identify, base.known), base, False)
    fit, _ = fit_base(problem)
    return problem, fit_with(problem, fit, DELAY)


def test_of_a_late_sensor_all_is_left_at_speed() -> None:
    share = share_at_speed(*with_delay(late), DELAY.name, "delay")
    assert share == pytest.approx(1.0, abs=0.2)
    assert Trial(True, 1.0, at_speed=share).failed is None


def test_of_what_is_late_in_slow_motion_alone_little_is() -> None:
    share = share_at_speed(*with_delay(late_while_slow), DELAY.name, "delay")
    assert share is not None and share < 0.4
    failed = Trial(True, 1.0, at_speed=share).failed
    assert failed is not None and "where the piston is fast" in failed


def test_forces_that_do_not_tell_refuse_nothing() -> None:
    assert Trial(True, 1.0, at_speed=None).failed is None
