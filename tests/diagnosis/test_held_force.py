"""A drive's force that is a command, held until the next: half a sample late, and no finding."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from testbed.benchmarks.diagnosis.bench_rigs import make_bench
from testbed.diagnosis.leg.acceptance import _excludes_zero, told_as_late
from testbed.diagnosis.leg.base_models import fit_base
from testbed.diagnosis.leg.fit import solve
from testbed.diagnosis.leg.points import restarted
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.series import series_of
from testbed.effects import by_name
from testbed.effects.active import Active
from testbed.estimation.leg.balance import acting
from testbed.recording.axis import Recording
from testbed.recording.leg_model import EffectEntry, LegModel, Parameter


def clean_drive() -> tuple[Recording, ...]:
    """The first simulated drive that hides nothing, as it was recorded to be fitted."""
    rigs = (make_bench(seed) for seed in range(0, 24, 2))
    return next(rig.identify for rig, hidden in rigs if hidden.kind == "clean")


def held_s(recordings: tuple[Recording, ...]) -> float:
    """What a fit of the published model finds."""
    base = LegModel(rig="drive", known=recordings[0].known)
    return fit_base(Problem(series_of(recordings, base.known), base, False))[1].force_held_s


def earlier(recording: Recording, samples: float) -> Recording:
    """The recording with its force written so many samples before it acts."""
    assert recording.actuator_force_n is not None
    at = np.arange(len(recording)) + samples
    force = np.interp(at, np.arange(len(recording)), recording.actuator_force_n)
    return replace(recording, actuator_force_n=force)


@pytest.mark.parametrize("samples", [0.0, 0.5, 1.0])
def test_a_force_that_is_written_before_it_acts_is_found_to_be_held(samples: float) -> None:
    recordings = clean_drive()
    rate_hz = series_of(recordings)[0].full_rate_hz
    found = held_s(tuple(earlier(recording, samples) for recording in recordings))
    assert found * rate_hz == pytest.approx(samples, abs=0.25)


def test_what_acts_is_what_was_given_half_a_sample_before() -> None:
    signals = series_of(clean_drive())[0].signals
    ramp = signals.with_(actuator_force_n=100.0 * signals.time_s)
    acts = acting(ramp, 2e-3).actuator_force_n
    assert acts is not None
    assert acts[5:] == pytest.approx(100.0 * (signals.time_s[5:] - 2e-3))


def test_only_a_drive_is_commanded() -> None:
    known = clean_drive()[0].known
    with pytest.raises(ValueError, match="force_held_s would have no effect on a cylinder"):
        LegModel(rig="cylinder", known=known, force_held_s=1e-3)


@pytest.mark.parametrize(
    ("rig", "interval_s", "told"),
    [
        ("drive", (-1.5e-3, -0.5e-3), False),
        ("drive", (3e-3, 5e-3), True),
        ("vertical-leg", (0.5e-3, 1.4e-3), False),
        ("vertical-leg", (2.0e-3, 3.0e-3), True),
        ("cylinder", (1.0e-3, 1.9e-3), False),
        ("cylinder", (2.1e-3, 3.0e-3), True),
    ],
)
def test_a_delay_is_told_beyond_a_sample_and_what_a_leg_s_transducers_take(
    rig: str, interval_s: tuple[float, float], told: bool
) -> None:
    state: Any = SimpleNamespace(
        problem=SimpleNamespace(kind=rig, base=SimpleNamespace(known=None), sample_s=2e-3)
    )
    size = Parameter(value=sum(interval_s) / 2.0, unit="s", interval90=interval_s)
    entry = EffectEntry(name="sensor.delay", parameters={"delay": size})
    nothing: Any = None
    assert _excludes_zero(state, nothing, entry, 1.0) is told


@pytest.mark.slow
def test_a_delay_beside_a_force_that_is_held_is_known_as_what_both_come_to() -> None:
    recordings = clean_drive()
    rate_hz = series_of(recordings)[0].full_rate_hz
    late = tuple(earlier(recording, -3.0) for recording in recordings)
    base = LegModel(rig="drive", known=recordings[0].known)
    problem = Problem(series_of(late, base.known), base, False)
    plain, _ = fit_base(problem)
    delay = by_name("sensor.delay")
    coordinates = [restarted(one, plain.at) for one in plain.coordinates]
    coordinates += delay.coordinates()
    start = Active(delay, delay.complete({"delay": 2.0 / rate_hz}))
    both = solve(problem, coordinates, replace(plain.at, effects=(start,)))
    told = told_as_late(problem, both)
    names = [coordinate.name for coordinate in told.coordinates]
    assert told.at.held_s == 0.0
    assert "held_s" not in names
    assert told.at.effects[0].values["delay"] * rate_hz == pytest.approx(3.0, abs=0.3)
    place, was = names.index("delay"), [one.name for one in both.coordinates].index("delay")
    assert told.covariance[place, place] < 0.1 * both.covariance[was, was]
