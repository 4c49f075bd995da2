"""The causal force of a leg: nothing that comes later changes what was said, however the samples
come; a start in motion finds its speed from its first samples, and its interval holds the truth.
"""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from testbed.benchmarks.estimators.identification_trials import (
    KNOWN,
    air_recording,
    random_friction,
    recording_of,
)
from testbed.estimation.leg.force import ForceEstimate, estimate
from testbed.formats.arrays import Array
from testbed.laws.low_pass import low_passed, steps_of
from testbed.recording.axis import Recording
from testbed.recording.leg_model import EffectEntry, Friction, LegModel

FRICTION = random_friction(np.random.default_rng(3))
MODEL = LegModel(known=KNOWN, friction=FRICTION)


def of_rows(recording: Recording, rows: object) -> Recording:
    values = {field.name: getattr(recording, field.name) for field in fields(recording)}
    arrays = {key: value[rows] for key, value in values.items() if isinstance(value, np.ndarray)}
    return replace(recording, **arrays)


@pytest.fixture(scope="module")
def swinging() -> Recording:
    """A foot in the air that swings at up to 0.2 m/s, six seconds."""
    t = np.arange(6000) * 1e-3
    return air_recording(FRICTION, 1, 0.15 * np.cos(2.0 * t) + 0.05 * np.cos(5.0 * t))


@pytest.fixture(scope="module")
def ragged(swinging: Recording) -> Recording:
    """The same with times that jitter by 0.4 ms, every tenth sample missing, and gaps of 0.03 to
    0.1 s, two of them 10 ms apart; it warms up.
    """
    rng = np.random.default_rng(1)
    time = swinging.time_s + rng.uniform(-4e-4, 4e-4, len(swinging))
    kept = rng.random(len(swinging)) > 0.1
    for first, last in ((2000, 2100), (3000, 3030), (3040, 3080)):
        kept[first:last] = False
    return of_rows(replace(swinging, time_s=time, oil_temperature_degc=20.0 + time), kept)


EFFECTS = {
    "none": {},
    "sensor.delay": {"delay": 0.01, "lag_share": 0.4},
    "sensor.line_b": {"natural_frequency": 20.0, "damping": 0.8},
    "sensor.drift_a": {"rate": 100.0},
    "friction.presliding": {"stiffness": 2e6, "damping": 100.0},
    "friction.temperature": {"rate": 0.02},
    "unnamed": {"direction_rested": 100.0, "sliding_2_mm_s": 50.0, "stop_1_mm": 20.0},
}


def told(found: ForceEstimate) -> Array:
    return np.column_stack([found.force_n, found.force_low_n, found.force_high_n])


@pytest.mark.parametrize("effect", EFFECTS)
@pytest.mark.parametrize("declared", [True, False])
def test_what_comes_later_changes_nothing_that_was_said(
    ragged: Recording, effect: str, declared: bool
) -> None:
    """A recording that ends earlier, anywhere, and one whose last samples are others, have the same
    bits before: the last row of each is what a program says that gets sample by sample.
    """
    if not declared:  # the encoder's step then shows as the piston moves
        channels = dict(ragged.header.channels)
        channels["position"] = channels["position"].model_copy(update={"resolution": None})
        header = ragged.header.model_copy(update={"channels": channels})
        ragged = replace(ragged, header=header)
    entries = () if effect == "none" else (EffectEntry(name=effect, parameters=EFFECTS[effect]),)
    model = MODEL.model_copy(update={"effects": entries})
    whole = told(estimate(ragged, model, causal=True))
    for ends in (60, 1799, 1800, 1801, 2707, 2725, 4000):
        cut = of_rows(ragged, slice(0, ends))
        assert np.array_equal(told(estimate(cut, model, causal=True)), whole[:ends])
        other = replace(
            ragged,
            time_s=np.where(np.arange(len(ragged)) < ends, ragged.time_s, ragged.time_s + 3e-4),
            pressure_a_pa=np.where(np.arange(len(ragged)) < ends, ragged.pressure_a_pa, 9e6),
            position_m=np.where(np.arange(len(ragged)) < ends, ragged.position_m, 0.1),
        )
        assert np.array_equal(told(estimate(other, model, causal=True))[:ends], whole[:ends])


def test_the_law_can_fail(ragged: Recording) -> None:
    """The estimate that looks ahead breaks it."""
    whole = told(estimate(ragged, MODEL))
    cut = told(estimate(of_rows(ragged, slice(0, 1799)), MODEL))
    assert not np.array_equal(cut, whole[:1799])


def test_jitter_and_missing_samples_cost_little(swinging: Recording, ragged: Recording) -> None:
    for recording, most_n in ((swinging, 20.0), (ragged, 40.0)):
        found = estimate(recording, MODEL, causal=True)
        beside = [2.0, 2.1, 3.03, 3.08]
        far = np.min(np.abs(recording.time_s[:, None] - [0.0, *beside]), axis=1) > 0.1
        speed = np.interp(
            recording.time_s, swinging.time_s, np.abs(np.gradient(swinging.position_m, 1e-3))
        )
        error = found.force_n[far & (speed > 0.05)]
        assert np.sqrt(np.mean(error**2)) < most_n


def beside_n(found: ForceEstimate, truth_n: float) -> Array:
    """How far the truth lies outside of the interval, N, (n,)."""
    return np.maximum(np.maximum(found.force_low_n - truth_n, truth_n - found.force_high_n), 0.0)


def going(speed_m_s: float, force_n: float) -> Recording:
    """A piston that goes on at one speed against one force, from before the first sample."""
    t = np.arange(400) * 1e-3
    known = KNOWN.model_copy(update={"moving_mass_kg": 91.7})
    weight_n = 91.7 * known.gravity_along_axis_m_s2
    friction_n = np.sign(speed_m_s) * 300.0 + 2000.0 * speed_m_s
    pressure_b = np.full(t.size, 3e6)
    pressure_a = (force_n + friction_n - weight_n + 3e6 * known.area_b_m2) / known.area_a_m2
    return recording_of(
        t,
        0.25 + speed_m_s * t,
        np.full(t.size, pressure_a),
        pressure_b,
        np.full(t.size, force_n),
        known,
        "load-cell",
    )


@pytest.mark.parametrize("speed_m_s", [0.3, 0.1, 0.03, -0.3, -0.1, -0.03])
def test_a_start_in_motion_finds_its_speed_and_its_interval_holds_the_truth(
    speed_m_s: float,
) -> None:
    """0.3 m/s taken for a start from rest would be 80 m/s2 of the moving mass, 7 kN."""
    recording = going(speed_m_s, 4000.0)
    friction = Friction(
        viscous_plus_n_s_m=2000.0,
        coulomb_plus_n=300.0,
        viscous_minus_n_s_m=2000.0,
        coulomb_minus_n=300.0,
    )
    found = estimate(recording, LegModel(known=recording.known, friction=friction), causal=True)
    beside = beside_n(found, 4000.0)[:20]
    assert beside[:5].max() == 0.0 and beside.max() < 200.0
    assert np.abs(found.force_n[20:] - 4000.0).max() < 120.0
    assert found.force_high_n[300] - found.force_low_n[300] == 0.0


def test_behind_a_gap_the_interval_holds_what_changed_meanwhile(swinging: Recording) -> None:
    """A swing that is cut out around its reversal: the speed behind the gap is the other way."""
    speed = np.gradient(swinging.position_m, 1e-3)
    turn = int(np.flatnonzero((speed[:-1] > 0.0) & (speed[1:] <= 0.0) & (np.arange(5999) > 500))[0])
    kept = np.r_[0 : turn - 150, turn + 200 : 6000]
    found = estimate(of_rows(swinging, kept), MODEL, causal=True)
    beside = beside_n(found, 0.0)[turn - 150 : turn - 130]
    assert beside[:5].max() == 0.0 and beside.max() < 300.0
    settled = slice(turn - 110, turn - 50)
    assert np.abs(found.force_n[settled]).max() < 100.0


def test_a_known_delay_makes_the_force_that_late_and_no_other() -> None:
    """Friction of 300 N turns over with the motion; pressures 20 ms late, a motion 20 ms late with
    them: the force of 20 ms ago.
    """
    n, late = 4000, 20
    t = np.arange(n) * 1e-3
    v = 0.1 * np.sin(2.0 * t)
    force_n = 3000.0 + 1000.0 * np.sin(3.0 * t)
    friction = Friction(coulomb_plus_n=300.0, coulomb_minus_n=300.0)
    weightless = KNOWN.model_copy(update={"moving_mass_kg": 0.0})
    total_n = force_n + 300.0 * np.sign(v)
    pressure_a = (total_n + 3e6 * weightless.area_b_m2) / weightless.area_a_m2
    told_a = np.concatenate([np.full(late, pressure_a[0]), pressure_a[:-late]])
    x = 0.25 + np.cumsum(v) * 1e-3
    recording = recording_of(t, x, told_a, np.full(n, 3e6), force_n, weightless, "load-cell")
    entry = EffectEntry(name="sensor.delay", parameters={"delay": late * 1e-3})
    model = LegModel(known=weightless, friction=friction, effects=(entry,))
    found = estimate(recording, model, causal=True).force_n
    fast = np.abs(np.concatenate([np.zeros(late + 25), v[: -late - 25]])) > 0.03
    ago = np.interp(t - 0.02, t, force_n)
    # a low-pass of channels and one of the force: another 15 ms of 3 kN/s
    assert np.abs(found - ago)[500:][fast[500:]].max() < 60.0


def test_a_low_pass_keeps_what_stays_and_has_the_width_that_is_asked_for() -> None:
    rng = np.random.default_rng(4)
    steps = rng.uniform(2e-4, 2e-3, 400)
    assert low_passed(np.full(400, 7.0), steps, 1e-3, 0.005) == pytest.approx(7.0, abs=1e-12)
    impulse = low_passed(
        np.eye(1, 2000)[0] * 0.0 + (np.arange(2000) == 5), np.full(2000, 1e-4), 1e-4, 0.005
    )
    t = np.arange(2000) * 1e-4
    mean = np.sum(t * impulse) / np.sum(impulse)
    width = np.sqrt(np.sum((t - mean) ** 2 * impulse) / np.sum(impulse))
    assert np.sum(impulse) == pytest.approx(1.0, abs=1e-9) and width == pytest.approx(
        0.005, rel=0.02
    )


def test_a_motion_that_went_straight_on_before_the_start_goes_on_straight() -> None:
    ramp = 0.3 * np.arange(200) * 1e-3
    steps = steps_of(np.arange(200) * 1e-3, 1e-3)
    late = ramp - low_passed(ramp, steps, 1e-3, 0.005, slope=0.3)
    assert late == pytest.approx(late[-1], abs=1e-12) and late[-1] > 0.3 * 0.005
