"""A shifted centre of mass is no payload: moments without a mass lie on no machine."""

from __future__ import annotations

import numpy as np

from testbed.effects import by_name
from testbed.effects.robot_payload import LEAST_KG
from testbed.machine.scale import ROBOCLIMBER
from testbed.scenario.machines import tolerances


def possible(mass: float, x: float) -> bool:
    """Whether a payload of so many kg may have so large a moment, kg m."""
    numbers = {"mass": mass, "mass x": x, "mass y": 0.0, "mass z": 0.0}
    drawn = {key: np.array([value]) for key, value in numbers.items()}
    return bool(by_name("robot.payload").possible(drawn, ROBOCLIMBER)[0])


def test_a_payload_lies_on_the_machine_and_is_more_than_any_machine_carries() -> None:
    assert possible(300.0, 150.0) and possible(300.0, -300.0)
    assert not possible(10.0, 300.0) and not possible(300.0, 600.0)
    assert possible(95.0, 20.0) and not possible(60.0, 20.0) and not possible(-300.0, 20.0)


def test_no_workshop_leaves_a_payload() -> None:
    (left,) = [one for one in tolerances("workshop") if one.number == "robot.payload@body.mass"]
    assert max(left.range) == LEAST_KG


def test_other_effects_may_have_any_numbers() -> None:
    drawn = {"x": np.array([-3.0, 0.0, 9.0])}
    assert by_name("robot.centre_of_mass").possible(drawn, ROBOCLIMBER).all()
