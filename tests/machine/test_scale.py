"""A number grows with a machine's size as its unit says."""

from __future__ import annotations

import pytest

from testbed.diagnosis.robot.unexplained import UnexplainedForce
from testbed.effects import by_name
from testbed.machine.scale import ROBOCLIMBER, Scale

HALF = Scale(0.125, 0.5)


def test_half_the_length_is_an_eighth_of_the_mass() -> None:
    found = Scale.of(500.0)
    assert (found.force, found.length) == pytest.approx((HALF.force, HALF.length), abs=0.02)


@pytest.mark.parametrize(
    ("unit", "times"),
    [("N", 0.125), ("N m", 0.0625), ("m/N", 4.0), ("Pa", 0.5), ("m3/s", 0.5**2.5), ("1", 1.0)],
)
def test_gravity_and_density_stay(unit: str, times: float) -> None:
    assert HALF.times(unit) == pytest.approx(times)
    assert ROBOCLIMBER.times(unit) == 1.0


@pytest.mark.parametrize(
    ("effect", "number", "times"),
    [
        ("robot.payload", "mass", 0.125),
        ("robot.payload", "mass x", 0.0625),
        ("force.spring", "stiffness rest", 0.125),
        ("sensor.gain_a", "gain_error", 1.0),
        ("sensor.encoder_offset", "offset", 1.0),
    ],
)
def test_an_effect_is_looked_for_at_the_size_of_the_machine(
    effect: str, number: str, times: float
) -> None:
    assert by_name(effect).grows(number, HALF) == pytest.approx(times)


def test_so_is_what_no_name_covers() -> None:
    assert UnexplainedForce().grows("3", HALF) == pytest.approx(0.125)
