"""Scales against the declared mass: where friction is most of a force a wrong unit leaves a balance
that closes, and only what the mass needs tells.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from testbed.recording.checker.balance import check_balance
from testbed.recording.checker.forces import Forces
from testbed.recording.checker.inertia import check_inertia, inertial_scale
from testbed.recording.checker.motion import Even
from testbed.recording.known import Known

RATE_HZ, MASS_KG, COULOMB_N = 500.0, 40.0, 150.0
NAMES = {"force": "actuator_force"}


def drive(swing_hz: float = 1.5, inclination_deg: float = 90.0, spring_n_m: float = 0.0) -> Forces:
    """A drive that swings at two frequencies against Coulomb friction that falls with speed."""
    t = np.arange(0.0, 12.0, 1.0 / RATE_HZ)
    slow, fast = 2.0 * np.pi * 0.3, 2.0 * np.pi * swing_hz
    way = 0.1 * np.sin(slow * t) + 0.02 * np.sin(fast * t)
    speed = 0.1 * slow * np.cos(slow * t) + 0.02 * fast * np.cos(fast * t)
    acceleration = -0.1 * slow**2 * np.sin(slow * t) - 0.02 * fast**2 * np.sin(fast * t)
    known = Known(moving_mass_kg=MASS_KG, inclination_deg=inclination_deg)
    friction = COULOMB_N * np.sign(speed) * (1.0 + 0.4 * np.exp(-np.abs(speed) / 0.02))
    force = friction + spring_n_m * way + MASS_KG * (acceleration - known.gravity_along_axis_m_s2)
    noise = np.random.default_rng(5).normal(0.0, 3.0, t.size)
    return Forces(Even(RATE_HZ, speed, acceleration, {"force": force + noise}), known)


def scaled(forces: Forces, force: float = 1.0, way: float = 1.0, mass: float = 1.0) -> Forces:
    even = forces.even
    return Forces(
        replace(
            even,
            speed_m_s=way * even.speed_m_s,
            acceleration_m_s2=way * even.acceleration_m_s2,
            series={"force": force * even.series["force"]},
        ),
        forces.known.model_copy(update={"moving_mass_kg": mass * MASS_KG}),
    )


@pytest.mark.parametrize("inclination_deg", [90.0, 30.0, 180.0])
@pytest.mark.parametrize("spring_n_m", [0.0, 4000.0])
def test_a_sound_drive_has_the_inertia_of_its_mass(
    inclination_deg: float, spring_n_m: float
) -> None:
    forces = drive(inclination_deg=inclination_deg, spring_n_m=spring_n_m)
    assert inertial_scale(forces) == pytest.approx(1.0, rel=0.1)
    assert list(check_inertia(forces, NAMES)) == []


@pytest.mark.parametrize("factor", [1e-3, 0.1, 10.0, 1e3])
def test_a_force_in_another_unit_is_told_on_a_drive(factor: float) -> None:
    forces = scaled(drive(), force=factor)
    (finding,) = check_inertia(forces, NAMES)
    assert (finding.severity, finding.channel) == ("error", "actuator_force")
    assert ("too large" if factor > 1.0 else "too small") in finding.what.split(";")[0]


def test_what_the_balance_alone_does_not_see_is_seen() -> None:
    forces = scaled(drive(swing_hz=1.0), force=1e3)
    assert list(check_balance(forces, NAMES)) == []  # friction may have any size
    assert len(list(check_inertia(forces, NAMES))) == 1


@pytest.mark.parametrize("factor", [1e-3, 0.1, 10.0])
def test_a_weight_that_is_right_leaves_the_position(factor: float) -> None:
    (finding,) = check_inertia(scaled(drive(inclination_deg=0.0), way=factor), NAMES)
    assert finding.channel == "position"
    assert "actuator_force" not in finding.what
    (finding,) = check_inertia(scaled(drive(inclination_deg=0.0), force=factor), NAMES)
    assert finding.channel == "actuator_force"
    assert "position" not in finding.what and "known.moving_mass_kg" in finding.what


def test_a_mass_in_tonnes_is_told() -> None:
    (finding,) = check_inertia(scaled(drive(), mass=1e-3), NAMES)
    assert "known.moving_mass_kg: it is" in finding.what
    assert finding.what.endswith("times too small")


def test_a_piston_that_hardly_accelerates_says_nothing() -> None:
    slow = drive(swing_hz=0.05)
    heavy = scaled(slow, force=10.0)
    assert inertial_scale(heavy) is None
    unknown = Forces(slow.even, slow.known.model_copy(update={"moving_mass_kg": None}))
    assert inertial_scale(unknown) is None
