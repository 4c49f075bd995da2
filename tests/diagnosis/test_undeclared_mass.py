"""A leg's moving mass that is declared as null is identified, and no finding."""

from __future__ import annotations

from dataclasses import replace

import pytest

from testbed.benchmarks.reference_leg.rigs import make_rig
from testbed.diagnosis.leg.base_models import declared, not_declared
from testbed.diagnosis.leg.hypotheses import available
from testbed.diagnosis.leg.problem import Problem
from testbed.diagnosis.leg.series import series_of
from testbed.estimation.friction.identification import identify_rig
from testbed.recording.axis import Recording, Rig


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
