"""Signs and scales of forces, of a piston whose every force is known: what is turned round, scaled
or exchanged is found by the balance.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from testbed.recording.checker.balance import check_balance, check_reference, suspects
from testbed.recording.checker.forces import Forces
from testbed.recording.checker.late import check_late
from testbed.recording.checker.motion import MOVING_M_S, Even
from testbed.recording.known import Known

RATE_HZ = 500.0
KNOWN = Known(bore_m=0.08, rod_m=0.045, stroke_m=0.5, moving_mass_kg=80.0, inclination_deg=0.0)
NAMES = {"pressure_a": "pressure_a", "pressure_b": "pressure_b", "reference": "load cell"}
COULOMB_N, VISCOUS_N_S_M = 300.0, 2000.0


def piston(mass_kg: float = 80.0) -> Even:
    """A piston that swings against its friction and a known load, all forces in balance."""
    t = np.arange(0.0, 10.0, 1.0 / RATE_HZ)
    turns = 2.0 * np.pi * 0.3
    speed = 0.1 * turns * np.cos(turns * t)
    acceleration = -0.1 * turns**2 * np.sin(turns * t)
    load = 3000.0 + 1500.0 * np.sin(2.0 * np.pi * 0.11 * t)
    pressure_b = 1.0e6 + 4.0e5 * np.cos(2.0 * np.pi * 0.23 * t)
    friction = COULOMB_N * np.sign(speed) + VISCOUS_N_S_M * speed
    weight = mass_kg * (KNOWN.gravity_along_axis_m_s2 - acceleration)
    pressure_a = (load + friction - weight + pressure_b * KNOWN.area_b_m2) / KNOWN.area_a_m2
    series = {"pressure_a": pressure_a, "pressure_b": pressure_b, "reference": load}
    return Even(RATE_HZ, speed, acceleration, series)


def changed(**series: np.ndarray) -> Forces:
    sound = piston()
    now = {**sound.series, **series}
    return Forces(Even(RATE_HZ, sound.speed_m_s, sound.acceleration_m_s2, now), KNOWN)


def test_what_friction_cannot_explain_of_a_sound_piston_is_nothing() -> None:
    assert Forces(piston(), KNOWN).misfit({}) < 1e-9
    assert list(check_balance(Forces(piston(), KNOWN), NAMES)) == []


def test_a_pressure_that_reads_above_nothing_is_not_turned_round() -> None:
    """A load that would balance with chamber B's pressure turned: the reference is wrong."""
    series = piston().series
    other_load = series["reference"] + 2.0 * series["pressure_b"] * KNOWN.area_b_m2
    found = list(check_balance(changed(reference=other_load), NAMES))
    assert not any("pressure_b" in f.channel and "sign" in f.what for f in found)


def test_what_is_left_over_is_friction_itself() -> None:
    even = piston()
    left, speed, size = Forces(even, KNOWN).left_over({})
    expected = COULOMB_N * np.sign(even.speed_m_s) + VISCOUS_N_S_M * even.speed_m_s
    assert left == pytest.approx(expected, abs=1e-6)
    assert speed == pytest.approx(even.speed_m_s)
    assert size > np.sqrt(np.mean(even.series["reference"] ** 2))


@pytest.mark.parametrize(
    ("channel", "factor", "words"),
    [
        ("pressure_a", -1.0, "its sign is turned round"),
        ("pressure_a", 1e-5, "is too small by 100000"),
        ("pressure_b", -1.0, "its sign is turned round"),
        ("reference", -1.0, "its sign is turned round"),
        ("reference", 1e-3, "is too small by 1000"),
        ("reference", 4.44822, "is too large by 4.44822"),
    ],
)
def test_a_channel_that_is_turned_or_scaled_is_named_with_what_it_needs(
    channel: str, factor: float, words: str
) -> None:
    (finding,) = check_balance(changed(**{channel: factor * piston().series[channel]}), NAMES)
    assert finding.severity == "error"
    assert finding.channel == NAMES[channel]
    assert words in finding.what


def test_exchanged_chambers_are_told_from_turned_signs() -> None:
    a, b = (piston().series[name] for name in ("pressure_a", "pressure_b"))
    (finding,) = check_balance(changed(pressure_a=b, pressure_b=a), NAMES)
    assert finding.channel == "pressure_a, pressure_b"
    assert finding.what == "the chambers are exchanged"


def test_a_position_that_counts_the_other_way_turns_friction_round() -> None:
    sound = piston()
    turned = Even(RATE_HZ, -sound.speed_m_s, -sound.acceleration_m_s2, sound.series)
    (finding,) = check_balance(Forces(turned, KNOWN), NAMES)
    assert (finding.channel, finding.what) == ("position", "its sign is turned round")


def test_an_effect_that_no_sign_or_scale_mends_is_left_to_the_diagnosis() -> None:
    sound = piston()
    spring = 4.0e4 * np.cumsum(sound.speed_m_s) / RATE_HZ / KNOWN.area_a_m2
    forces = changed(pressure_a=sound.series["pressure_a"] + spring)
    assert forces.misfit({}) > 0.008
    assert list(check_balance(forces, NAMES)) == []


def test_a_zero_of_a_sensor_is_no_sign_and_no_scale() -> None:
    zero = 0.02 * np.abs(piston().series["pressure_a"]).max()
    assert (
        list(check_balance(changed(pressure_a=piston().series["pressure_a"] + zero), NAMES)) == []
    )


def test_only_channels_that_are_there_are_suspected() -> None:
    sound = piston()
    without: Mapping[str, np.ndarray] = {"pressure_a": sound.series["pressure_a"]}
    forces = Forces(Even(RATE_HZ, sound.speed_m_s, sound.acceleration_m_s2, without), KNOWN)
    suspected = {suspect.channel for suspect in suspects(forces, NAMES)}
    channels = {name for name in suspected if not name.startswith("known.")}
    assert channels == {"pressure_a", "position"}


@pytest.mark.parametrize(("factor", "found"), [(1.0, 0), (1.2, 0), (0.5, 1), (3.0, 1)])
def test_a_load_cell_that_moves_alike_by_another_factor_has_another_scale(
    factor: float, found: int
) -> None:
    """In a press: the cell sees what the pressures make, friction aside."""
    even = piston(mass_kg=0.0)
    load, pressure_b = even.series["reference"], even.series["pressure_b"]
    pressure_a = (load + pressure_b * KNOWN.area_b_m2) / KNOWN.area_a_m2
    series = {"pressure_a": pressure_a, "pressure_b": pressure_b, "reference": factor * load}
    still = np.zeros(len(load))
    light = KNOWN.model_copy(update={"moving_mass_kg": 0.0})
    forces = Forces(Even(RATE_HZ, still, still, series), light)
    assert len(list(check_reference(forces, "load cell"))) == found


@pytest.mark.parametrize("constant_n", [-6e4, 6e4])
def test_a_constant_force_beside_the_load_is_no_other_scale(constant_n: float) -> None:
    """A weight that nobody declares, or a gain of the other chamber: the swings are alike."""
    even = piston(mass_kg=0.0)
    load, pressure_b = even.series["reference"], even.series["pressure_b"]
    pressure_a = (load + constant_n + pressure_b * KNOWN.area_b_m2) / KNOWN.area_a_m2
    series = even.series | {"pressure_a": pressure_a}
    still = np.zeros(len(load))
    light = KNOWN.model_copy(update={"moving_mass_kg": 0.0})
    forces = Forces(Even(RATE_HZ, still, still, series), light)
    assert list(check_reference(forces, "load cell")) == []


def test_slow_samples_say_nothing_of_frictions_direction() -> None:
    even = Even(RATE_HZ, np.array([0.0, 0.9, -1.1]) * MOVING_M_S, np.zeros(3), {})
    assert even.moving.tolist() == [False, False, True]


def test_a_chamber_whose_sensor_says_nothing_is_blamed_and_not_the_other_one() -> None:
    noise = np.random.default_rng(1).standard_normal(piston().series["pressure_a"].size)
    (finding,) = check_balance(changed(pressure_a=4e3 + 5e2 * noise), NAMES)
    assert (finding.severity, finding.channel) == ("error", "pressure_a")
    assert "next to nothing" in finding.what


def test_a_radius_in_place_of_the_bore_is_named_as_such() -> None:
    known = KNOWN.model_copy(update={"bore_m": 0.5 * 0.08, "rod_m": None})
    sound = piston()
    one_chamber = {
        "pressure_a": sound.series["pressure_a"]
        - sound.series["pressure_b"] * KNOWN.area_b_m2 / KNOWN.area_a_m2,
        "reference": sound.series["reference"],
    }
    forces = Forces(Even(RATE_HZ, sound.speed_m_s, sound.acceleration_m_s2, one_chamber), known)
    (finding,) = check_balance(forces, NAMES)
    assert "known.bore_m" in finding.channel + finding.what
    assert "radius" in finding.what


def test_pressures_of_a_seal_are_not_said_to_be_in_a_unit_that_leaves_no_pressure() -> None:
    sound = piston()
    scale = 0.01  # of a pneumatic cylinder
    series = {
        "pressure_a": scale * sound.series["pressure_a"],
        "pressure_b": scale * sound.series["pressure_b"],
        "reference": 1e-3 * scale * sound.series["reference"],
    }
    known = KNOWN.model_copy(update={"moving_mass_kg": 80.0 * scale})
    forces = Forces(Even(RATE_HZ, sound.speed_m_s, sound.acceleration_m_s2, series), known)
    (finding,) = check_balance(forces, NAMES)
    assert finding.channel == "load cell"
    assert "pressure" not in finding.what


@pytest.mark.parametrize(("shift", "words"), [(60, "late"), (-60, "early")])
def test_a_load_cell_of_another_clock_is_late_or_early(shift: int, words: str) -> None:
    forces = changed(reference=np.roll(piston().series["reference"], shift))
    (finding,) = check_late(forces, NAMES)
    assert (finding.severity, finding.channel) == ("warning", "load cell")
    assert words in finding.what
    assert f"{1e3 * abs(shift) / RATE_HZ:.0f} ms" in finding.evidence


@pytest.mark.parametrize("shift", [0, 10])
def test_a_load_cell_in_time_or_late_as_a_sensor_may_be_is_left_alone(shift: int) -> None:
    forces = changed(reference=np.roll(piston().series["reference"], shift))
    assert list(check_late(forces, NAMES)) == []
