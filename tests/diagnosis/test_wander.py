"""Friction that differs from run to run, no more than measured repeats do, is no missing law."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from testbed.benchmarks.diagnosis.bench_rigs import make_bench
from testbed.diagnosis.leg.diagnose import diagnose
from testbed.diagnosis.leg.series import Series, series_of
from testbed.diagnosis.leg.wander import WANDER, without_wander
from testbed.formats.arrays import Array
from testbed.recording.axis import Rig
from testbed.recording.leg_model import Friction

SOUND = 16
"""A drive that lacks nothing."""
LEVEL_N = 40.0
FRICTION = Friction(
    viscous_plus_n_s_m=10.0,
    coulomb_plus_n=LEVEL_N,
    stribeck_plus_n=0.0,
    stribeck_speed_plus_m_s=0.01,
    viscous_minus_n_s_m=10.0,
    coulomb_minus_n=LEVEL_N,
    stribeck_minus_n=0.0,
    stribeck_speed_minus_m_s=0.01,
)


def _run() -> tuple[Series, Array]:
    series = series_of(make_bench(SOUND)[0].identify)[0]
    everywhere = np.ones(len(series.signals.velocity_m_s), dtype=np.bool_)
    return series, series.binned(series.signals.velocity_m_s, everywhere)[0]


@pytest.mark.parametrize(("share", "left"), [(0.5 * WANDER, 0.0), (3.0 * WANDER, 2.0 * WANDER)])
def test_more_friction_in_one_run_is_left_as_far_as_no_repeat_explains_it(
    share: float, left: float
) -> None:
    series, velocity = _run()
    counted = np.ones(series.bins, dtype=np.bool_)
    forwards = velocity > 0.0
    found = without_wander(series, np.where(forwards, share * LEVEL_N, 0.0), counted, FRICTION)
    assert found == pytest.approx(left * LEVEL_N * forwards, abs=1e-9)


def test_what_changes_within_a_run_is_left_as_it_is() -> None:
    series, velocity = _run()
    counted = np.ones(series.bins, dtype=np.bool_)
    along = np.where(velocity > 0.0, velocity - np.median(velocity[velocity > 0.0]), 0.0)
    found = without_wander(series, along, counted, FRICTION)
    assert found == pytest.approx(along, abs=1e-9)


@pytest.mark.slow
def test_a_sound_drive_is_sound_though_one_run_had_a_twentieth_more_friction_one_way() -> None:
    rig = make_bench(SOUND)[0]
    first, *others = rig.identify
    signals = series_of((first,))[0].signals
    velocity = np.interp(first.time_s, signals.time_s, signals.velocity_m_s)
    force = first.actuator_force_n
    assert force is not None
    more = 0.05 * float(np.median(np.abs(force))) * (velocity > 0.0)
    stuck = replace(first, actuator_force_n=force + more)
    found = diagnose(Rig(rig.name, rig.folder, (stuck, *others), rig.verify))
    assert found.verdict.kind == "none"
