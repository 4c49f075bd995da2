"""The external force of one leg: known motions, known forces."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from testbed.benchmarks.estimators.identification_trials import KNOWN, recording_of
from testbed.benchmarks.reference_leg.rigs import make_rig
from testbed.effects.base import ForceTerms
from testbed.effects.hydraulics_hose import hose_flow_m3_s
from testbed.estimation.leg.balance import external_n
from testbed.estimation.leg.flow import edge_flow
from testbed.estimation.leg.force import estimate
from testbed.estimation.leg.motion import encoder_noise, motion, slope, smooth, through_steps
from testbed.estimation.leg.spool import spool
from testbed.recording.axis import Rig
from testbed.recording.leg_model import EffectEntry, Friction, LegModel

RATE = 1000.0


def test_velocity_of_a_ramp_is_its_slope_through_a_coarse_encoder() -> None:
    t = np.arange(4000) / RATE
    read = np.floor((0.1 + 0.007 * t) / 1e-4) * 1e-4
    _, v, a = motion(through_steps(t, read, 1e-4), RATE, 0.005)
    inside = slice(200, -200)
    assert np.abs(v[inside] - 0.007).max() < 4e-4
    assert np.sqrt(np.mean(a[inside] ** 2)) < 0.05


def test_drawing_through_the_steps_beats_the_raw_counts_tenfold_at_low_speed() -> None:
    t = np.arange(6000) / RATE
    x = 0.2 + 0.004 * t
    read = np.floor(x / 1e-4) * 1e-4
    drawn = through_steps(t, read, 1e-4)
    inside = slice(100, -100)
    rough, fine = (np.std((y - x)[inside]) for y in (read, drawn))
    assert fine < 0.1 * rough


def test_smoothing_leaves_a_ramp_a_ramp_up_to_its_ends() -> None:
    ramp = 3.0 + 0.5 * np.arange(300)
    assert np.abs(smooth(ramp, 6.0) - ramp).max() < 1e-9
    assert np.abs(smooth(ramp, 6.0, 1) - 0.5)[30:-30].max() < 1e-9


def test_encoder_noise_vanishes_for_a_continuous_position() -> None:
    v, a = encoder_noise(np.linspace(0.1, 0.2, 500), RATE, 0.0, 0.005)
    assert not v.any() and not a.any()


def test_load_dependent_friction_is_taken_off_both_ways() -> None:
    terms = ForceTerms(1.0, 1.0, load_coefficient=0.05)
    assert external_n(np.array([1050.0]), 1.0, terms)[0] == pytest.approx(1000.0)
    assert external_n(np.array([950.0]), -1.0, terms)[0] == pytest.approx(1000.0)
    bent = replace(terms, load_exponent=2.0)
    friction = 0.05 * 1e4 * (8000.0 / 1e4) ** 2  # 320 N at 8 kN
    assert external_n(np.array([8320.0]), 1.0, bent)[0] == pytest.approx(8000.0, rel=1e-4)
    assert friction == pytest.approx(320.0)


@pytest.mark.parametrize("hertz", [2.0, 16.0, 31.25])
def test_the_slope_of_a_pressure_is_true_up_to_an_eighth_of_the_rate(hertz: float) -> None:
    turns, t = 2.0 * np.pi * hertz, np.arange(500) / 250.0
    found = slope(np.sin(turns * t), 250.0)[10:-10]
    assert found == pytest.approx(turns * np.cos(turns * t)[10:-10], abs=2e-3 * turns)


def test_the_slope_of_a_ramp_is_its_own_to_both_ends() -> None:
    assert slope(3.0 * np.arange(20.0), 10.0) == pytest.approx(np.full(20, 30.0))


def test_a_hose_takes_what_its_pressure_gains_and_lags_behind_a_ramp() -> None:
    rate, capacity, time, gains = 250.0, 2e-12, 0.05, 1e6
    t = np.arange(500) / rate
    flow = hose_flow_m3_s(gains * t, capacity, time, 1.0 / rate)
    assert flow == pytest.approx(capacity * gains * (1.0 - np.exp(-t / time)), rel=1e-9)


def test_an_edge_passes_its_rated_flow_at_its_rated_drop() -> None:
    flow = edge_flow(np.array([1.0, -0.5]), np.array([3.5e6, 3.5e6]), 4e-4, 3.5e6, 0.0)
    assert flow == pytest.approx([4e-4, 2e-4])


def test_the_spool_settles_on_its_command() -> None:
    s = spool(np.concatenate([np.zeros(10), np.ones(500)]), RATE, 20.0, 0.9)
    assert s[-1] == pytest.approx(1.0, abs=1e-6) and s[9] == pytest.approx(0.0, abs=1e-9)


@pytest.fixture(scope="module")
def declared_leg() -> tuple[Rig, LegModel]:
    """A leg as its rig declares it, with some friction: nothing is fitted."""
    rig, _ = make_rig(2, "clean")
    friction = Friction(viscous_plus_n_s_m=2000.0, coulomb_plus_n=300.0)
    return rig, LegModel(known=rig.verify[0].known, friction=friction)


@pytest.fixture(scope="module")
def clean() -> tuple[object, LegModel]:
    from testbed.diagnosis.leg.base_models import declared, fit_base
    from testbed.diagnosis.leg.problem import Problem
    from testbed.diagnosis.leg.series import series_of

    rig, _ = make_rig(2, "clean")
    base = declared(rig)
    return rig, fit_base(Problem(series_of(rig.identify, base.known), base, True))[1]


@pytest.mark.slow
def test_in_the_air_the_force_is_nothing_and_on_the_cell_it_is_the_cells(
    clean: tuple[object, LegModel],
) -> None:
    rig, model = clean
    for recording in rig.verify:  # type: ignore[attr-defined]
        found = estimate(recording, model)
        from testbed.diagnosis.leg.verification import moving

        error = (found.force_n - recording.reference_force_n)[moving(recording, model)]
        limit = 120.0 if recording.name.startswith("press") else 25.0
        assert np.sqrt(np.mean(error**2)) < limit


@pytest.mark.slow
def test_at_rest_the_set_holds_the_truth_and_the_value_lies_in_it(
    clean: tuple[object, LegModel],
) -> None:
    rig, model = clean
    recording = next(r for r in rig.verify if r.name == "press_sine")  # type: ignore[attr-defined]
    found = estimate(recording, model)
    assert (found.force_low_n <= found.force_n + 1e-6).all() and (
        found.force_high_n >= found.force_n - 1e-6
    ).all()
    from testbed.diagnosis.leg.verification import moving

    rest = ~moving(recording, model)
    truth = recording.reference_force_n
    outside = np.maximum(np.maximum(found.force_low_n - truth, truth - found.force_high_n), 0.0)[
        rest
    ]
    assert np.sqrt(np.mean(outside**2)) < 40.0


def test_causal_estimates_use_nothing_that_comes_later(declared_leg: tuple[Rig, LegModel]) -> None:
    rig, model = declared_leg
    recording = rig.verify[2]
    whole = estimate(recording, model, causal=True).force_n
    half = len(recording) // 2
    cut = {
        name: getattr(recording, name)[:half]
        for name in (
            "time_s",
            "position_m",
            "valve_command",
            "pressure_a_pa",
            "pressure_b_pa",
            "supply_pressure_pa",
            "oil_temperature_degc",
            "reference_force_n",
            "saturated_a",
            "saturated_b",
        )
    }
    part = estimate(replace(recording, **cut), model, causal=True).force_n
    assert np.abs(whole[: half - 1] - part[: half - 1]).max() < 1e-6


def test_a_gain_in_the_model_scales_the_pressure_back(declared_leg: tuple[Rig, LegModel]) -> None:
    rig, model = declared_leg
    recording = rig.verify[2]
    wrong = replace(recording, pressure_a_pa=1.05 * recording.pressure_a_pa)
    gain = EffectEntry(name="sensor.gain_a", parameters={"gain_error": 0.05})
    repaired = estimate(wrong, model.model_copy(update={"effects": (gain,)})).force_n
    assert np.abs(repaired - estimate(recording, model).force_n).max() < 1e-3


def test_one_leg_is_estimated_fifty_times_faster_than_it_was_recorded(
    declared_leg: tuple[Rig, LegModel],
) -> None:
    rig, model = declared_leg
    recording = rig.identify[0]
    estimate(recording, model)
    began = time.process_time()
    estimate(recording, model)
    assert time.process_time() - began < (recording.time_s[-1] - recording.time_s[0]) / 50.0


def test_friction_of_a_model_is_what_the_estimate_takes_off() -> None:
    t = np.arange(3000) / RATE
    rig, _ = make_rig(2, "clean")
    template = rig.verify[2]
    known = template.known
    x = 0.1 + 0.05 * t
    n = len(t)
    friction = Friction(viscous_plus_n_s_m=2000.0, coulomb_plus_n=300.0)
    needed = (
        300.0
        + 2000.0 * 0.05
        - (known.moving_mass_kg or 0.0) * known.gravity_along_axis_m_s2
        + 1000.0
    )
    recording = replace(
        template,
        time_s=t,
        position_m=x,
        valve_command=None,
        supply_pressure_pa=None,
        oil_temperature_degc=None,
        pressure_a_pa=np.full(n, (needed + 3e6 * known.area_b_m2) / known.area_a_m2),
        pressure_b_pa=np.full(n, 3e6),
        reference_force_n=np.full(n, 1000.0),
        saturated_a=np.zeros(n, bool),
        saturated_b=np.zeros(n, bool),
    )
    found = estimate(recording, LegModel(known=known, friction=friction)).force_n
    assert found[200:-200] == pytest.approx(1000.0, abs=1.0)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_at_rest_the_set_has_the_friction_that_the_load_presses_on(way: float) -> None:
    """A foot holds 10 kN, slides, stops, and its seals go over to hold the other way: break-away
    300 N and a tenth of the load, either way.
    """
    coefficient, breakaway_n, load_n, n = 0.1, 300.0, 10_000.0, 8000
    t = np.arange(n) / RATE
    x = 0.25 + way * 0.02 * np.minimum(t, 3.0)
    turned = np.clip(1.0 - 2.0 * (t - 4.0), -1.0, 1.0) * np.where(t < 3.0, 1.0, 0.99)
    total_n = load_n + way * turned * (breakaway_n + coefficient * load_n)
    weight_n = 91.7 * KNOWN.gravity_along_axis_m_s2
    pressure_b = np.full(n, 2e6) + np.random.default_rng(0).normal(0.0, 10.0, n)
    pressure_a = (total_n - weight_n + pressure_b * KNOWN.area_b_m2) / KNOWN.area_a_m2
    recording = recording_of(t, x, pressure_a, pressure_b, np.full(n, load_n), KNOWN, "load-cell")
    friction = Friction(coulomb_plus_n=breakaway_n, coulomb_minus_n=breakaway_n)
    grows = EffectEntry(name="friction.load", parameters={"coefficient": coefficient})
    model = LegModel(
        known=KNOWN.model_copy(update={"moving_mass_kg": 91.7}), friction=friction, effects=(grows,)
    )
    found = estimate(recording, model)
    resting = slice(3200, -200)
    assert np.all(found.force_low_n[resting] < load_n + 5.0)
    assert np.all(found.force_high_n[resting] > load_n - 5.0)
    assert found.force_n[resting] == pytest.approx(load_n, abs=150.0)  # it stops in one sample
    at, total = 7000, total_n[7000]
    assert found.force_low_n[at] == pytest.approx((total - 300.0) / 1.1, abs=5.0)
    assert found.force_high_n[at] == pytest.approx((total + 300.0) / 0.9, abs=5.0)
