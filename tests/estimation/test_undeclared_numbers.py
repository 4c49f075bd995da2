"""What a rig leaves undeclared is found with its friction, and what it declares moves no further
than its tolerance lets it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from testbed.estimation.friction.declared_numbers import (
    MOST,
    Unknown,
    Used,
    choose_form,
    fit,
    fit_declared,
    held_out,
    unknowns,
)
from testbed.estimation.friction.evidence import Evidence
from testbed.recording.known import Known

KNOWN = Known(bore_m=0.08, rod_m=0.045, moving_mass_kg=120.0, inclination_deg=0.0)
FRICTION = (2500.0, 350.0, 200.0, 0.012)
"""Viscous N s/m, Coulomb N, static N, Stribeck speed m/s; the same both ways."""


def friction_n(speed: np.ndarray) -> np.ndarray:
    viscous, coulomb, static, stribeck = FRICTION
    size = coulomb + static * np.exp(-np.abs(speed) / stribeck)
    return viscous * speed + np.sign(speed) * size


def evidence(noise_n: float = 2.0) -> Evidence:
    """Four recordings at speeds from 3 to 150 mm/s both ways, with rows that balance."""
    rng = np.random.default_rng(4)
    speed = np.geomspace(3e-3, 0.15, 400) * rng.choice([-1.0, 1.0], 400)
    return Evidence(
        speed,
        friction_n(speed) + noise_n * rng.normal(size=400),
        rng.normal(0.0, 0.4, 400),
        rng.uniform(2e6, 8e6, 400),
        rng.uniform(1e6, 4e6, 400),
        np.arange(400) * 4 // 400,
    )


def missing_mass(rows: Evidence, kg: float) -> Evidence:
    """The same rows where nobody took weight and inertia of a mass off."""
    weight = kg * (KNOWN.gravity_along_axis_m_s2 - rows.acceleration_m_s2)
    return replace(rows, force_n=rows.force_n - weight)


def test_a_sound_leg_on_its_bench_has_nothing_that_may_move() -> None:
    assert unknowns(evidence(), KNOWN, "vertical-leg") == ([], [])
    found = fit_declared(evidence(), KNOWN, "vertical-leg")
    assert (found.known, found.offset_n, found.used) == (KNOWN, 0.0, ())


def test_a_mass_that_nobody_declares_is_found() -> None:
    unweighed = KNOWN.model_copy(update={"moving_mass_kg": None})
    found = fit_declared(missing_mass(evidence(), 120.0), unweighed, "vertical-leg")
    assert found.known.moving_mass_kg == pytest.approx(120.0, rel=0.01)
    assert found.evidence.force_n == pytest.approx(evidence().force_n, abs=15.0)
    assert str(found.used[0]).startswith("moving_mass_kg: not declared, found 1")


def test_without_acceleration_no_mass_shows() -> None:
    still = replace(evidence(), acceleration_m_s2=np.zeros(400))
    free, _ = unknowns(still, KNOWN.model_copy(update={"moving_mass_kg": None}), "drive")
    assert [unknown.name for unknown in free] == ["force_offset_n"]


def test_a_leg_that_goes_steadily_shows_its_mass_by_its_weight() -> None:
    still = replace(evidence(), acceleration_m_s2=np.zeros(400))
    unweighed = KNOWN.model_copy(update={"moving_mass_kg": None})
    found = fit_declared(missing_mass(still, 120.0), unweighed, "vertical-leg")
    assert found.known.moving_mass_kg == pytest.approx(120.0, rel=0.01) and found.constant_found
    lying = unweighed.model_copy(update={"inclination_deg": 90.0})
    assert unknowns(still, lying, "vertical-leg") == ([], [])


def test_a_constant_force_of_a_cylinders_sensors_is_taken_out() -> None:
    rows = evidence()
    found = fit_declared(replace(rows, force_n=rows.force_n - 180.0), KNOWN, "cylinder")
    assert found.offset_n == pytest.approx(180.0, abs=6.0)
    assert found.evidence.force_n == pytest.approx(rows.force_n, abs=25.0)


def test_declared_numbers_stay_where_moving_them_predicts_nothing_better() -> None:
    found = fit_declared(evidence(), KNOWN, "cylinder")
    assert found.known == KNOWN
    assert [used.name for used in found.used] == ["force_offset_n"] or all(
        used.used == pytest.approx(used.declared, rel=0.01) for used in found.used[:-1]
    )


def test_a_bore_that_is_a_little_off_is_found_within_its_tolerance() -> None:
    """The true bore is 1 % larger than declared: its area shows in the pressures."""
    rows, wider = evidence(), KNOWN.model_copy(update={"bore_m": 0.0808})
    more_m2 = wider.area_a_m2 - KNOWN.area_a_m2
    short = rows.force_n - more_m2 * (rows.pressure_a_pa - rows.pressure_b_pa)
    found = fit_declared(replace(rows, force_n=short), KNOWN, "cylinder")
    assert found.known.bore_m == pytest.approx(0.0808, rel=1e-3)
    bore = next(used for used in found.used if used.name == "bore_m")
    assert bore.tolerances_off == pytest.approx(0.5, abs=0.1) and not bore.at_bound


def test_data_that_contradict_a_declaration_are_said_to_and_move_it_no_further() -> None:
    rows, wider = evidence(), KNOWN.model_copy(update={"bore_m": 0.1})
    more_m2 = wider.area_a_m2 - KNOWN.area_a_m2
    short = rows.force_n - more_m2 * (rows.pressure_a_pa - rows.pressure_b_pa)
    found = fit_declared(replace(rows, force_n=short), KNOWN, "cylinder")
    bore = next(used for used in found.used if used.name == "bore_m")
    assert bore.at_bound and bore.tolerances_off == pytest.approx(MOST, rel=1e-3)
    assert str(bore).endswith("the data contradict the declared number")


def test_the_simplest_form_is_taken_that_predicts_as_well() -> None:
    rows = evidence()
    speed = rows.velocity_m_s
    assert choose_form(rows, [])[0] == "stribeck"
    straight = replace(rows, force_n=2500.0 * speed + 350.0 * np.sign(speed))
    assert choose_form(straight, [])[0] == "viscous"
    assert choose_form(replace(rows, force_n=350.0 * np.sign(speed)), [])[0] == "coulomb"


def test_the_stribeck_part_is_kept_where_one_recording_alone_is_slow() -> None:
    rows = evidence(noise_n=20.0)
    slow = np.abs(rows.velocity_m_s) < 0.07
    alone = replace(rows, recording=np.where(slow, 0, 1 + np.arange(400) % 3))
    by_recording, _ = choose_form(alone, [])
    found = fit_declared(alone, KNOWN, "cylinder")
    assert (by_recording, found.form) == ("viscous", "stribeck")


def test_speeds_that_span_little_tell_no_parts_of_friction_apart() -> None:
    rows = evidence()
    narrow = replace(rows, velocity_m_s=np.sign(rows.velocity_m_s) * np.linspace(0.05, 0.1, 400))
    assert choose_form(narrow, [])[0] == "coulomb"


def test_what_is_set_aside_is_predicted_by_the_rest_and_not_by_itself() -> None:
    """Each recording has an offset of its own, which the others cannot know."""
    rows = evidence(noise_n=0.0)
    offsets = np.array([-300.0, -100.0, 100.0, 300.0])[rows.recording]
    apart = replace(rows, force_n=rows.force_n + offsets)
    offset = Unknown("force_offset_n", -np.ones(len(rows)))
    every = np.ones(len(rows), dtype=bool)
    fitted = float(np.sum(fit(apart, [offset], "stribeck", every).residual ** 2))
    assert held_out(apart, [offset], "stribeck") > 1.2 * fitted


def test_an_unknown_number_moves_by_its_tolerances_and_not_below_what_can_be() -> None:
    mass = Unknown("moving_mass_kg", np.zeros(3), width=50.0, low=-120.0)
    assert mass.bounds == (-120.0, 150.0)
    assert Unknown("force_offset_n", np.zeros(3)).bounds == (-np.inf, np.inf)


def test_a_number_that_moved_says_so_in_a_line() -> None:
    used = Used("bore_m", "m", 0.08, 0.081, 0.02, 0.6)
    assert str(used) == "bore_m: declared 0.08 m, used 0.081 (0.6 tolerances of 2 %)"


@pytest.mark.parametrize("kind", ["vertical-leg", "cylinder"])
def test_a_rod_that_nobody_declares_is_found_beside_chamber_b(kind: str) -> None:
    rodless = KNOWN.model_copy(update={"rod_m": None})
    rows = evidence()
    area = 0.25 * np.pi * KNOWN.rod_m**2
    as_large_as_a = replace(rows, force_n=rows.force_n - rows.pressure_b_pa * area)
    found = fit_declared(as_large_as_a, rodless, kind)
    assert found.known.rod_m == pytest.approx(KNOWN.rod_m, rel=0.01)
    assert found.evidence.force_n == pytest.approx(rows.force_n, abs=15.0)
    assert any(str(used).startswith("rod_m: not declared, found 0.04") for used in found.used)


def test_a_rod_is_not_thicker_than_its_bore_and_without_chamber_b_is_none() -> None:
    rodless = KNOWN.model_copy(update={"rod_m": None})
    rows = evidence()
    absurd = replace(rows, force_n=rows.force_n - 2.0 * rows.pressure_b_pa * KNOWN.area_a_m2)
    found = fit_declared(absurd, rodless, "vertical-leg").known.rod_m
    assert found is not None and found < KNOWN.bore_m
    one_chamber = replace(rows, pressure_b_pa=np.zeros(400))
    assert unknowns(one_chamber, rodless, "vertical-leg") == ([], [])


@pytest.mark.parametrize("coarse_n", [0.0, 150.0])
def test_a_bore_does_not_shrink_with_what_friction_leaves(coarse_n: float) -> None:
    """Rows of a cylinder that lies and is free, with a force along the rows that no form has: of a
    piston 6 % smaller 12 % less of it would be left, and nothing speaks for one.
    """
    known = KNOWN.model_copy(update={"inclination_deg": 90.0, "moving_mass_kg": 1.0})
    rows = evidence()
    left = coarse_n * np.sin(np.arange(400) / 7.0)
    force = rows.force_n + left
    in_a = (force + known.area_b_m2 * rows.pressure_b_pa + rows.acceleration_m_s2) / known.area_a_m2
    found = fit_declared(replace(rows, force_n=force, pressure_a_pa=in_a), known, "cylinder")
    assert found.known.bore_m == pytest.approx(known.bore_m, rel=1e-3)


def test_a_bore_that_is_off_is_found_by_a_known_load() -> None:
    """Beside a load of 20 kN a piston of 2 % more area shows, and friction comes out as it is."""
    rows, known = evidence(), KNOWN.model_copy(update={"inclination_deg": 90.0})
    assert known.moving_mass_kg is not None
    load = np.random.default_rng(2).uniform(0.0, 2e4, 400)
    inertia = known.moving_mass_kg * rows.acceleration_m_s2
    across = rows.pressure_b_pa * known.area_b_m2
    area = known.area_a_m2
    in_b = rows.pressure_b_pa
    larger = 1.02 * area
    in_a = (rows.force_n + load + inertia + across + 0.02 * area * in_b) / larger
    force = area * in_a - across - inertia - load
    found = fit_declared(replace(rows, force_n=force, pressure_a_pa=in_a), known, "cylinder")
    assert found.known.area_a_m2 == pytest.approx(larger, rel=2e-3)
    np.testing.assert_allclose(found.evidence.force_n + found.offset_n, rows.force_n, atol=15.0)
