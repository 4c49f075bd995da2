"""A correction without a cause, for what an identified bench shows beyond every name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from synthetic_bench import bench

from testbed.benchmarks.diagnosis.measured_rigs import estimate_error
from testbed.diagnosis.leg.base_models import declared
from testbed.diagnosis.leg.bench_correction import (
    _levels_n,
    bench_correction,
    foretells_every_run,
)
from testbed.diagnosis.leg.held_pressures import holds_pressures
from testbed.diagnosis.leg.left_over import LeftOver
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.series import series_of
from testbed.effects.terms import ForceTerms
from testbed.effects.unnamed import UNNAMED, edges_of, stop
from testbed.estimation.friction.identification import identify_rig
from testbed.recording.axis import Recording, Rig
from testbed.recording.leg_model import LegModel

ZEROS_N = (3.0, -4.0, 2.0)
"""A load cell's zero wanders from run to run."""


def _rig(added_n: Callable[[Recording], np.ndarray], seed: int = 0) -> Rig:
    recordings, _ = bench(np.geomspace(0.004, 0.04, 5), seed=seed, area=1.0)
    runs = []
    for recording, zero in zip(recordings, ZEROS_N, strict=True):
        assert recording.reference_force_n is not None
        load = recording.reference_force_n + added_n(recording) + zero
        runs.append(replace(recording, reference_force_n=load))
    return Rig("bench", runs[0].folder, tuple(runs), ())


def _without_stroke(rig: Rig) -> Rig:
    runs = []
    for run in rig.identify:
        known = run.known.model_copy(update={"stroke_m": None})
        runs.append(replace(run, header=run.header.model_copy(update={"known": known})))
    return replace(rig, identify=tuple(runs))


def _corrected(rig: Rig) -> tuple[LegModel | None, LegModel]:
    model, base = identify_rig(rig).model, declared(rig)
    problem = Problem(series_of(rig.identify, base.known), base, False)
    return bench_correction(problem, rig.identify, model), model


def _gradual_friction_n(recording: Recording) -> np.ndarray:
    return -30.0 * stop(recording.position_m, 2e-3)


@pytest.mark.slow
def test_friction_that_turns_over_gradually_is_corrected_on_runs_never_seen() -> None:
    better, model = _corrected(_rig(_gradual_friction_n))
    assert better is not None and [entry.name for entry in better.effects] == ["unnamed"]
    for recording in _rig(_gradual_friction_n, seed=5).identify:
        assert estimate_error(recording, better) < 0.9 * estimate_error(recording, model)


@pytest.mark.slow
def test_runs_that_only_their_zeros_tell_apart_are_left_to_identification() -> None:
    corrected, _ = _corrected(_rig(lambda recording: 0.0 * recording.position_m))
    assert corrected is None


@pytest.mark.slow
def test_a_correction_along_a_stroke_that_nobody_declares_is_used_as_it_was_fitted() -> None:
    def along(recording: Recording) -> np.ndarray:
        return -2e4 * (recording.position_m - np.mean(recording.position_m))

    better, model = _corrected(_without_stroke(_rig(along)))
    assert better is not None and model.known.stroke_m is None
    assert better.known.stroke_m == pytest.approx(0.02, abs=1e-3)  # the travel that was seen
    for recording in _without_stroke(_rig(along, seed=5)).identify:
        assert estimate_error(recording, better) < 0.6 * estimate_error(recording, model)


@pytest.mark.slow
def test_what_one_run_alone_shows_is_no_correction() -> None:
    def in_one(recording: Recording) -> np.ndarray:
        return (recording.name == "level2") * 40.0 * np.sign(np.gradient(recording.position_m))

    corrected, _ = _corrected(_rig(in_one))
    assert corrected is None


def test_an_elastic_stop_stretches_with_the_travel_and_no_further() -> None:
    there_and_back = np.concatenate([np.linspace(0.0, 4.0, 9), np.linspace(3.5, 0.0, 8)])
    assert stop(there_and_back, 1.0)[:4] == pytest.approx([0.0, 0.5, 1.0, 1.0])
    assert stop(there_and_back, 1.0)[9:14] == pytest.approx([0.5, 0.0, -0.5, -1.0, -1.0])


def test_beyond_what_it_was_fitted_on_a_correction_stays_as_at_the_edge() -> None:
    (signals,) = (one.signals for one in series_of(_rig(_gradual_friction_n).identify[:1]))
    assert signals.pressure_a_pa is not None
    edges = edges_of([signals])
    weights = {"direction_pressure_a": 7.0, "pressure_sliding_5_mm_s": -40.0, "velocity": 30.0}
    values = UNNAMED.complete(weights | edges)

    def force_n(pressure_pa: np.ndarray, speed: float) -> np.ndarray:
        terms = ForceTerms(mass_kg=0.0, weight_mass_kg=0.0)
        moved = signals.with_(
            pressure_a_pa=pressure_pa, velocity_m_s=speed * np.sign(signals.velocity_m_s)
        )
        UNNAMED.force(moved, terms, values)
        return np.asarray(terms.force_n)

    highest = np.full_like(signals.pressure_a_pa, edges["highest_pressure_a_pa"])
    fastest = min(edges["fastest_out_m_s"], -edges["fastest_back_m_s"])
    at_edge, inside = force_n(highest, fastest), force_n(0.9 * highest, 0.5 * fastest)
    both_ways = fastest * np.sign(signals.velocity_m_s)
    assert np.ptp(both_ways) > 0.0 and not np.allclose(at_edge, inside)
    assert force_n(3.0 * highest, fastest) == pytest.approx(at_edge)


@pytest.mark.slow
@pytest.mark.parametrize("size_n", [30.0, 1.0])
def test_other_runs_foretell_what_is_left_only_where_a_law_is_missing(size_n: float) -> None:
    def added_n(recording: Recording) -> np.ndarray:
        return -size_n * stop(recording.position_m, 2e-3)

    rig = _rig(added_n)
    model, base = identify_rig(rig).model, declared(rig)
    problem = Problem(series_of(rig.identify, base.known), base, False)
    assert foretells_every_run(problem, rig.identify, model) == (size_n > 10.0)


@pytest.mark.slow
def test_friction_that_grows_with_the_pressure_is_followed_between_the_runs_pressures() -> None:
    def pressed_on(recording: Recording) -> np.ndarray:
        assert recording.pressure_a_pa is not None
        return -2e-4 * recording.pressure_a_pa * np.tanh(np.gradient(recording.position_m) / 1e-7)

    better, model = _corrected(_rig(pressed_on))
    assert better is not None
    assert better.effects[0].parameters["friction_at_highest"].value > 10.0
    again = _rig(pressed_on, seed=5).identify
    lowest, middle, highest = (
        estimate_error(recording, better) / estimate_error(recording, model) for recording in again
    )
    assert lowest < 0.9 and middle < 1.0 and highest < 0.9


def test_a_rig_whose_pressures_differ_within_a_run_as_much_as_between_runs_holds_none() -> None:
    run = LeftOver("run", np.ones(2), np.ones((2, 1)), np.array([True, False]), 1.0, (0,))
    held = [replace(run, pressure_pa=pa, pressure_sd_pa=5e3) for pa in (1e5, 3e5)]
    assert holds_pressures(held)
    assert not holds_pressures([replace(one, pressure_sd_pa=1e5) for one in held])
    assert not holds_pressures([replace(one, extends=np.array([True, True])) for one in held])


def test_friction_at_pressures_is_straight_between_them_and_held_beyond() -> None:
    (signals,) = (one.signals for one in series_of(_rig(_gradual_friction_n).identify[:1]))
    edges = {"lowest_pressure_a_pa": 1e5, "highest_pressure_a_pa": 5e5}
    weights = {"friction_at_lowest": 4.0, "friction_at_quarter": 8.0, "friction_above": 2.0}

    def friction_n(pressure_pa: float) -> float:
        moved = signals.with_(
            pressure_a_pa=np.full_like(signals.velocity_m_s, pressure_pa),
            velocity_m_s=np.full_like(signals.velocity_m_s, 1.0),
        )
        terms = ForceTerms(mass_kg=0.0, weight_mass_kg=0.0)
        UNNAMED.force(moved, terms, UNNAMED.complete(weights | edges))
        return -float(np.asarray(terms.force_n)[0])

    found = [friction_n(pa) for pa in (1e5, 1.5e5, 2e5, 5e5, 6e5, 7e5, 9e5)]
    assert found == pytest.approx([4.0, 6.0, 8.0, 0.0, 1.0, 2.0, 2.0])


def test_a_trend_of_friction_with_the_pressure_counts_beyond_what_repeats_differ_by() -> None:
    pressure = np.array([0.1, 0.3, 0.7])
    of_terms = np.column_stack([np.ones(3), pressure])

    def levels(trend_n: float) -> np.ndarray:
        runs = [_run_of_level(trend_n * (value - pressure.mean())) for value in pressure]
        return _levels_n(runs, of_terms)

    assert levels(10.0) == pytest.approx(0.0, abs=1e-9)  # 4 N between runs of 50 N of friction
    assert levels(200.0) == pytest.approx(200.0 * (pressure - pressure.mean()), rel=0.02)


def _run_of_level(level_n: float) -> LeftOver:
    extends = np.arange(10) < 5
    residual = level_n * np.where(extends, 1.0, -1.0)
    return LeftOver("run", residual, np.zeros((10, 2)), extends, 50.0, (0, 1))


@pytest.mark.slow
def test_a_channel_that_one_run_lacks_is_left_out() -> None:
    first, *rest = _rig(_gradual_friction_n).identify
    warm = replace(first, oil_temperature_degc=np.full(len(first), 30.0))
    corrected, _ = _corrected(Rig("bench", first.folder, (warm, *rest), ()))
    assert corrected is not None
    assert not {"warmth", "direction_warmth"} & set(corrected.effects[0].parameters)
