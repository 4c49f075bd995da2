"""Friction that differs from run to run, no more than measured repeats do, is no missing law."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from testbed.benchmarks.diagnosis.bench_rigs import make_bench
from testbed.diagnosis.leg.base_models import declared, fit_base
from testbed.diagnosis.leg.diagnose import diagnose
from testbed.diagnosis.leg.evidence import Evidence, evidence
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.run_variation import WANDER, steady
from testbed.diagnosis.leg.series import series_of
from testbed.estimation.leg.motion import signals_of
from testbed.recording.axis import Recording, Rig

SOUND = 16
"""A drive that lacks nothing."""


def _with_more_friction(recording: Recording, more_n: float, along_time: bool = False) -> Recording:
    """The recording with this much more force while it goes one way; `along_time`: growing from
    none to twice as much.
    """
    signals = signals_of(recording)
    velocity = np.interp(recording.time_s, signals.time_s, signals.velocity_m_s)
    force_n = recording.actuator_force_n
    assert force_n is not None
    growth = np.linspace(0.0, 2.0, len(force_n)) if along_time else np.ones(len(force_n))
    return replace(recording, actuator_force_n=force_n + more_n * growth * (velocity > 0.0))


def _judged(share: float, along_time: bool = False) -> tuple[Evidence, Evidence]:
    """Evidence of the published model on a sound drive whose first run has this share more
    friction one way: (as it is, with friction of each run its own).
    """
    recordings = make_bench(SOUND)[0].identify
    base = declared(make_bench(SOUND)[0])
    level_n = fit_base(Problem(series_of(recordings, base.known), base, False))[1].friction
    more_n = share * level_n.coulomb_plus_n
    first, *others = recordings
    stuck = (_with_more_friction(first, more_n, along_time), *others)
    problem = Problem(series_of(stuck, base.known), base, False)
    fit, _ = fit_base(problem)
    plain = evidence(problem, fit)
    return plain, steady(problem, plain, fit)


def test_friction_that_one_run_has_more_of_leaves_what_a_sound_drive_leaves() -> None:
    plain, found = _judged(WANDER)
    sound, _ = _judged(0.0)
    assert _most(plain) > 2.0 * _most(sound)
    assert _most(found) == pytest.approx(_most(sound), rel=0.1)


def test_what_changes_within_a_run_is_left() -> None:
    sound, _ = _judged(0.0)
    _, found = _judged(WANDER, along_time=True)
    assert _most(found) > 2.0 * _most(sound)


def test_of_runs_of_a_few_seconds_the_rest_does_not_tell_their_own_friction() -> None:
    """Three seconds of a sound drive: what is kept back is foretold as without a friction for each
    run, and leaves no more than that.
    """
    rig, _ = make_bench(SOUND)
    base = declared(rig)
    short = tuple(
        whole.part(slice(0, round(3.0 * whole.header.sample_rate_hz)), whole.name)
        for whole in rig.identify
    )
    problem = Problem(series_of(short, base.known), base, False)
    fit, _ = fit_base(problem)
    plain = evidence(problem, fit)
    found = steady(problem, plain, fit)
    assert found.gain_over(plain, found) >= 0.0
    assert _most(found) < 1.1 * _most(plain)


def _most(found: Evidence) -> float:
    return max(found.scale.values())


@pytest.mark.slow
def test_a_sound_drive_is_sound_though_one_run_had_more_friction_one_way() -> None:
    rig = make_bench(SOUND)[0]
    first, *others = rig.identify
    force_n = first.actuator_force_n
    assert force_n is not None
    stuck = _with_more_friction(first, 0.05 * float(np.median(np.abs(force_n))))
    found = diagnose(Rig(rig.name, rig.folder, (stuck, *others), rig.verify))
    assert found.verdict.kind == "none"
