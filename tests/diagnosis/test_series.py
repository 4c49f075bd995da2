"""What the fit sees of a recording: gaps are left out, and every rate is smoothed alike."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from testbed.benchmarks.reference_leg.rigs import make_rig
from testbed.diagnosis.leg.base_models import declared
from testbed.diagnosis.leg.diagnose import diagnose
from testbed.diagnosis.leg.hypotheses import available
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.series import series_of, smoothing_s
from testbed.estimation.leg import force as leg_force
from testbed.estimation.leg.force import estimate
from testbed.estimation.leg.gaps import in_gaps
from testbed.recording.axis import Recording, Rig


@pytest.fixture(scope="module")
def rig() -> Rig:
    return make_rig(12, "clean")[0]


def taken(recording: Recording, rows: slice | np.ndarray) -> Recording:
    """Some rows of a recording."""
    arrays = {f.name: getattr(recording, f.name) for f in fields(recording)}
    return replace(
        recording, **{name: v[rows] for name, v in arrays.items() if isinstance(v, np.ndarray)}
    )


def test_a_gap_and_what_smoothing_carries_there_are_left_out() -> None:
    sampled = np.concatenate([np.arange(0.0, 1.0, 0.01), np.arange(1.5, 2.0, 0.01)])
    grid = np.arange(0.0, 2.0, 0.005)
    left_out = grid[in_gaps(sampled, grid)]
    assert (left_out.min(), left_out.max()) == pytest.approx((0.99 - 0.06, 1.5 + 0.06), abs=0.006)
    assert not in_gaps(
        np.arange(0.0, 2.0, 0.01) + 1e-3 * np.sin(np.arange(200)), grid
    ).any()  # jitter is no gap


def test_beyond_its_ends_nobody_saw_a_recording_either(rig: Rig) -> None:
    cut = taken(rig.identify[0], slice(2000, 6000))
    (series,) = series_of([cut])
    t = series.signals.time_s
    beside_an_end = (t < t[0] + 0.06) | (t > t[-1] - 0.06)
    assert not series.clear[beside_an_end].any()
    assert series.clear[~beside_an_end].mean() > 0.9


def test_a_second_that_was_not_recorded_is_no_motion_at_one_speed(rig: Rig) -> None:
    whole = rig.identify[0]
    seconds = whole.time_s - whole.time_s[0]
    (series,) = series_of([taken(whole, (seconds < 3.0) | (seconds > 4.0))])
    t = series.signals.time_s - whole.time_s[0]
    assert (
        not series.clear[(t > 3.0) & (t < 4.0)].any()
        and series.clear[(t > 1.0) & (t < 2.5)].mean() > 0.9
    )


@pytest.mark.parametrize("every", [1, 5, 10])
def test_a_declared_dead_band_is_the_same_as_hypothesis_at_any_rate(rig: Rig, every: int) -> None:
    (series,) = series_of([taken(rig.identify[0], slice(None, None, every))])
    declared_band = series.signals.known.valve_deadband
    assert declared_band is not None and series.opening is not None
    assert series.opening_for(declared_band) == pytest.approx(series.opening, abs=1e-12)
    assert series.width_s == smoothing_s(series.full_rate_hz) >= 1.2 / series.full_rate_hz


def test_a_force_that_nobody_knows_is_not_taken_for_none(rig: Rig) -> None:
    from testbed.errors import InputError

    blind = replace(
        rig, identify=(*rig.identify[:-1], replace(rig.identify[-1], reference_force_n=None))
    )
    with pytest.raises(InputError, match=r"the external force is not known \(allowed: kind"):
        diagnose(blind)


def test_an_effect_that_one_recording_cannot_show_is_left_out_by_name(rig: Rig) -> None:
    cold = replace(rig.identify[-1], oil_temperature_degc=None)
    base = declared(rig)
    problem = Problem(series_of([*rig.identify[:-1], cold], base.known), base, True)
    _, left_out = available(problem)
    assert {x.name: x.reason for x in left_out}[
        "friction.temperature"
    ] == "needs the channel oil_temperature"


def test_where_the_oil_does_not_agree_the_estimate_is_as_if_nobody_had_asked_it(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    model, recording = declared(rig), rig.verify[0]
    with monkeypatch.context() as without:
        without.setattr(leg_force, "can_fuse", lambda recording, model: False)
        plain = estimate(recording, model).force_n
    assert not np.allclose(estimate(recording, model).force_n, plain, atol=0.1)
    known = model.known.model_copy(
        update={"valve_rated_flow_m3_s": 0.4 * (model.known.valve_rated_flow_m3_s or 0.0)}
    )
    wrong = estimate(recording, model.model_copy(update={"known": known})).force_n
    assert wrong == pytest.approx(plain, abs=1e-9)
