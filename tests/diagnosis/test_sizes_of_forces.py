"""How large a bench's forces are is told by what is known of them, a mass or a load cell, and not
by which size leaves least: a smaller piston, or sensors that read too much, make every error less.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from testbed.benchmarks.estimators.identification_trials import (
    KNOWN,
    friction_force,
    recording_of,
    speed_profile,
)
from testbed.diagnosis.leg import acceptance
from testbed.diagnosis.leg.acceptance import Trial, repeated
from testbed.diagnosis.leg.base_models import declared, fit_base, usual_effects, within_tolerance
from testbed.diagnosis.leg.evidence import Evidence, evidence
from testbed.diagnosis.leg.hypotheses import fit_with, promise
from testbed.diagnosis.leg.indistinguishable import _numbers_for
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.search import Candidate
from testbed.diagnosis.leg.series import series_of
from testbed.diagnosis.leg.unexplained import excess_over, is_as_sound
from testbed.effects import by_name
from testbed.effects.active import Active
from testbed.effects.base import Effect
from testbed.effects.sensor_delay import TRANSDUCER_S
from testbed.recording.axis import Recording, Rig
from testbed.recording.known import Known
from testbed.recording.leg_model import Friction, LegModel

SPEEDS = (0.01, 0.03, 0.09)
LYING = KNOWN.model_copy(update={"inclination_deg": 90.0})
DRY = Friction(coulomb_plus_n=300.0, coulomb_minus_n=300.0, viscous_plus_n_s_m=900.0)
LEVELS_PA = (1e6, 2e6, 4e6)


def lying(by_pressure: float = 0.0, late_s: float = 0.0) -> list[Recording]:
    """A bench that lies and moves freely at three levels of pressure; its friction grows with them
    by a coefficient, m2. Pressures come late.
    """
    out = []
    for number, level_pa in enumerate(LEVELS_PA):
        rng = np.random.default_rng(number)
        v = speed_profile(SPEEDS, longest_s=1.0, travel_m=0.03)
        t = np.arange(v.size) * 1e-3
        in_b = level_pa + 2e5 * np.sin(0.7 * t)
        a = np.gradient(v, t)
        mass = LYING.moving_mass_kg or 0.0
        force = friction_force(DRY, v) + mass * a + by_pressure * 2.0 * level_pa * np.sign(v)
        in_a = (force + LYING.area_b_m2 * in_b) / LYING.area_a_m2
        read_a, read_b = (np.interp(t - late_s, t, p) for p in (in_a, in_b))
        noise = rng.normal(0.0, 200.0, (2, t.size))
        x = 0.2 + (np.cumsum(v) - 0.5 * v) * 1e-3
        made = recording_of(t, x, read_a + noise[0], read_b + noise[1], 0.0 * t, LYING, "free")
        header = made.header.model_copy(update={"rig": "cylinder"})
        out.append(replace(made, name=f"level{number}", header=header))
    return out


def problem_of(recordings: list[Recording], known: Known = LYING) -> Problem:
    """The balances of a bench with these declared numbers."""
    base = declared(Rig("bench", Path(), tuple(recordings), ()))
    base = base.model_copy(update={"known": known})
    return Problem(series_of(recordings, known), base, False)


def smaller(model: LegModel, share: float) -> LegModel:
    """A piston and a rod whose areas are this share, with as much less friction and no mass."""
    assert model.known.bore_m is not None and model.known.rod_m is not None
    known = model.known.model_copy(
        update={
            "bore_m": model.known.bore_m * np.sqrt(share),
            "rod_m": model.known.rod_m * np.sqrt(share),
        }
    )
    return model.model_copy(update={"known": known, "friction": scaled(model.friction, share)})


def scaled(friction: Friction, share: float) -> Friction:
    """The same friction with all its forces multiplied."""
    forces = {
        name: share * value
        for name, value in friction.model_dump().items()
        if not name.startswith("stribeck_speed")
    }
    return friction.model_copy(update=forces)


@pytest.mark.parametrize("share", [0.7, 0.88])
def test_a_smaller_piston_leaves_the_same_where_no_force_is_known(share: float) -> None:
    problem = problem_of(lying(), LYING.model_copy(update={"moving_mass_kg": 0.0}))
    model = problem.base.model_copy(update={"friction": scaled(DRY, 0.9)})  # which misses a tenth
    other = problem.force(smaller(model, share), ())
    np.testing.assert_allclose(other, problem.force(model, ()), rtol=5e-3, atol=1e-9)


def test_sensors_that_both_read_too_much_leave_the_same_where_no_force_is_known() -> None:
    problem = problem_of(lying(), LYING.model_copy(update={"moving_mass_kg": 0.0}))
    model = problem.base.model_copy(update={"friction": scaled(DRY, 0.9)})
    gains = [
        Active(effect, effect.complete({"gain_error": 0.25}))
        for effect in (by_name("sensor.gain_a"), by_name("sensor.gain_b"))
    ]
    less = model.model_copy(update={"friction": scaled(model.friction, 1.0 / 1.25)})
    np.testing.assert_allclose(problem.force(less, gains), problem.force(model, ()), rtol=5e-3)


def test_a_larger_piston_leaves_no_less_either() -> None:
    """What does not grow with it, a mass's, stays as it is; what does is the larger."""
    problem = problem_of(lying())
    model = problem.base.model_copy(update={"friction": DRY})
    for share in (1.02, 1.2):
        assert problem.as_read(smaller(model, share), ()) == pytest.approx(1.0, abs=5e-3)


def test_a_rod_alone_moves_the_balance() -> None:
    problem = problem_of(lying())
    model = problem.base.model_copy(update={"friction": DRY})
    before = problem.force(model, ())
    assert model.known.rod_m is not None
    thicker = model.known.model_copy(update={"rod_m": 1.02 * model.known.rod_m})
    assert np.ptp(problem.force(model.model_copy(update={"known": thicker}), ()) - before) > 10.0


def test_a_mass_that_is_declared_too_small_is_not_hidden_by_a_smaller_bore() -> None:
    """Inertia of a quarter more mass than declared; a bore 6 % smaller would hide half of it."""
    assert LYING.moving_mass_kg is not None
    known = LYING.model_copy(update={"moving_mass_kg": 0.97 * LYING.moving_mass_kg})
    problem = problem_of(lying(by_pressure=2e-5), known)  # and something that is missed as well
    fit, _ = fit_base(problem)
    assert abs(fit.at.off["bore_m"]) < 0.02
    assert "moving_mass_kg" in {one.name for one in within_tolerance(problem)}


def test_what_a_straight_effect_promises_does_not_depend_on_where_it_starts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Friction that grows with the pressure, of which one quiet recording has least: however large
    the coefficient that is tried first, the fall that it promises is the same.
    """
    problem = problem_of(lying(by_pressure=3e-5))
    fit, _ = fit_base(problem)
    effect = by_name("friction.pressure")
    told = []
    for start in (1e-6, 3e-5, 3e-4):
        monkeypatch.setattr(type(effect), "starts", _started_at(start))
        told.append(promise(problem, fit, effect))
    assert told == pytest.approx([told[0]] * 3, rel=0.02) and told[0] > 0.0


def _started_at(start: float) -> object:
    return lambda self, observed: [{"coefficient": start}]


def test_pressures_as_late_as_a_converters_filter_makes_them_are_the_benches_own() -> None:
    found = []
    for late_s in (0.2e-3, 0.9e-3):
        fit, _ = fit_base(problem_of(lying(late_s=late_s)))
        (active,) = fit.at.effects
        found.append(active.values[active.effect.required[0]])
    assert usual_effects(problem_of(lying())) != ()
    assert found[1] - found[0] == pytest.approx(0.7e-3, abs=1e-4)


def test_a_slow_recorder_makes_no_bench_later_than_the_effect_may_be() -> None:
    """At 100 Hz a fifth of a sample ahead is as far as a delay may be ahead at all."""
    sparse = [one.part(slice(None, None, 12), one.name) for one in lying()]
    problem = problem_of(sparse)
    (usual,) = usual_effects(problem)
    spec = usual.effect.spec(usual.effect.required[0])
    assert usual.effect.usual_on("cylinder", problem.sample_s)[0] < spec.low  # type: ignore[index]
    fit, _ = fit_base(problem)
    (found,) = (one for one in fit.coordinates if one.owner == usual.effect.name)
    assert spec.low <= found.low < found.high <= spec.high


@pytest.mark.parametrize(("sample_s", "latest_s"), [(2e-4, TRANSDUCER_S), (5e-3, 5e-3)])
def test_a_bench_is_late_by_a_transducer_or_a_sample(sample_s: float, latest_s: float) -> None:
    delay = by_name("sensor.delay")
    assert delay.usual_on("cylinder", sample_s) == pytest.approx((-0.2 * latest_s, latest_s))
    assert delay.usual_on("vertical-leg", sample_s) == delay.usual_on_legs
    assert delay.usual_on("drive", sample_s) is None  # its force's lateness is fitted as such
    assert Effect.usual_on(by_name("inertia.mass"), "cylinder", sample_s) is None


def test_draws_that_prefer_what_does_the_same_name_an_effect_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """However far the rival is behind on the whole of the data."""
    monkeypatch.setattr(acceptance, "alike", lambda state, kept, name: ("force.cushion",))
    won = {frozenset({"force.spring"}): 0.7, frozenset({"force.cushion", "inertia.mass"}): 0.3}
    kept = SimpleNamespace(names=("force.spring",))
    assert repeated(None, kept, "force.spring", won) == pytest.approx(1.0)  # type: ignore[arg-type]


def test_a_declared_number_stands_for_a_name_only_within_its_tolerance() -> None:
    """Friction that grows with the pressure is a share of all that a piston makes, but of a quarter
    of it; three per cent of a mass are within what a workshop leaves.
    """
    problem = problem_of(lying(by_pressure=3e-5))
    fit, _ = fit_base(problem)
    with_it = fit_with(problem, fit, by_name("friction.pressure"))
    assert _numbers_for(problem, with_it, "friction.pressure") == []
    assert LYING.moving_mass_kg is not None
    lighter = LYING.model_copy(update={"moving_mass_kg": 0.97 * LYING.moving_mass_kg})
    problem = problem_of(lying(), lighter)
    fit, _ = fit_base(problem)
    with_it = fit_with(problem, fit, by_name("inertia.mass"))
    assert "moving_mass_kg" in _numbers_for(problem, with_it, "inertia.mass")


@pytest.mark.parametrize(("by_pressure", "sound"), [(0.0, True), (3e-5, False)])
def test_what_leaves_no_more_than_a_sound_bench_needs_no_name(
    by_pressure: float, sound: bool
) -> None:
    recordings = lying(by_pressure)
    problem = problem_of(recordings)
    fit, _ = fit_base(problem)
    found = Candidate((), fit, evidence(problem, fit))
    assert is_as_sound(problem, found, recordings) == sound
    assert (Trial(True, 1.0, shows=not sound).failed is not None) == sound


def test_what_comes_for_moments_counts_by_its_root_mean_square() -> None:
    key = ("force", "run")
    moments = Evidence({key: 0.0}, {key: 0.6}, {key: 1.5}, {key: 1.0}, {key: 500})
    assert excess_over(moments, {key: 1.0}) == pytest.approx(1.5)
    steady = replace(moments, rms={key: 0.6})
    assert excess_over(steady, {key: 1.0}) == 1.0
    assert excess_over(steady, {key: 0.3}) == pytest.approx(2.0)
