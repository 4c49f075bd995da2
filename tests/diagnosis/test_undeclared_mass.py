"""A moving mass that is declared as null is identified, and no finding."""

from __future__ import annotations

from dataclasses import replace

import pytest

from testbed.benchmarks.diagnosis.bench_rigs import make_bench
from testbed.benchmarks.reference_leg.rigs import make_rig
from testbed.diagnosis.leg.base_models import declared, fit_base, not_declared
from testbed.diagnosis.leg.hypotheses import available
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.series import series_of
from testbed.estimation.friction.identification import identify_rig
from testbed.recording.axis import Recording, Rig

HEAVY = 60.0
"""So many times the mass, and the forces, of a simulated drive."""


def unweighed(recording: Recording) -> Recording:
    known = recording.known.model_copy(update={"moving_mass_kg": None})
    return replace(recording, header=recording.header.model_copy(update={"known": known}))


def test_every_model_has_the_mass_that_was_found_and_none_names_it() -> None:
    sound, _ = make_rig(2, "clean")
    parts = (tuple(map(unweighed, part)) for part in (sound.identify, sound.verify))
    rig = Rig(sound.name, sound.folder, *parts)
    assert not_declared(rig) == ("moving_mass_kg",) and not_declared(sound) == ()
    base = declared(rig, identify_rig(rig).model)
    true_kg, found_kg = sound.known.moving_mass_kg, base.known.moving_mass_kg
    assert found_kg == pytest.approx(true_kg, rel=0.2)  # lopsided friction weighs, too
    series = series_of(rig.identify, base.known)
    left_out = {one.name for one in available(Problem(series, base, True, (), ("x",)))[1]}
    nobodys = {
        one.name: one.reason
        for one in available(Problem(series, base, True, (), not_declared(rig)))[1]
    }
    assert "inertia.mass" not in left_out and "nobody declares" in nobodys["inertia.mass"]


def sound_drive() -> Rig:
    """The first simulated drive that hides nothing."""
    rigs = (make_bench(seed) for seed in range(0, 24, 2))
    return next(rig for rig, hidden in rigs if hidden.kind == "clean" and rig.kind == "drive")


def refitted_kg(rig: Rig) -> float | None:
    """The mass with which a bench or a drive that declares none is fitted."""
    base = declared(rig, identify_rig(rig).model)
    series = series_of(rig.identify, base.known)
    _, refit = fit_base(Problem(series, base, False, (), not_declared(rig)))
    return refit.known.moving_mass_kg


def test_a_heavy_drive_whose_mass_nobody_declares_is_not_fitted_a_light_one() -> None:
    sound = sound_drive()

    def heavy(recording: Recording) -> Recording:
        force = recording.actuator_force_n
        assert force is not None
        return replace(unweighed(recording), actuator_force_n=HEAVY * force)

    parts = (tuple(map(heavy, part)) for part in (sound.identify, sound.verify))
    true_kg = sound.known.moving_mass_kg
    assert true_kg
    assert refitted_kg(Rig(sound.name, sound.folder, *parts)) == pytest.approx(
        HEAVY * true_kg, rel=0.05
    )


def test_a_bench_that_accelerates_has_the_mass_that_its_forces_show() -> None:
    sound = sound_drive()

    def pushed_by_a_pressure(recording: Recording) -> Recording:
        """The same motion, its force made by a chamber."""
        force, cylinder = recording.actuator_force_n, unweighed(recording)
        assert force is not None
        known = cylinder.known.model_copy(update={"bore_m": 0.05, "rod_m": 0.02})
        header = cylinder.header.model_copy(update={"rig": "cylinder", "known": known})
        pressure_pa = 1e6 + force / known.area_a_m2
        return replace(cylinder, header=header, actuator_force_n=None, pressure_a_pa=pressure_pa)

    parts = (tuple(map(pushed_by_a_pressure, part)) for part in (sound.identify, sound.verify))
    found = refitted_kg(Rig(sound.name, sound.folder, *parts))
    assert found == pytest.approx(sound.known.moving_mass_kg, rel=0.1)
