"""Undeclared effects change the world by the stated size at the stated place, and never the
model.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from testbed.effects import ALL, by_name
from testbed.effects.terms import Hidden
from testbed.errors import InputError
from testbed.laws.hydraulics import AxisParameters
from testbed.laws.supply import PowerUnit
from testbed.machine.names import AXES
from testbed.scenario.parts import Undeclared
from testbed.world.sensing import Transducer
from testbed.world.undeclared import (
    hidden_of,
    places_of,
    put_into_cylinders,
    put_into_sensors,
    put_into_supply,
)


def hidden(effect: str, at: str, **parameters: float) -> Hidden:
    """What a world has with this one effect."""
    return hidden_of([Undeclared(effect=effect, at=at, parameters=parameters)])


def middle(name: str) -> dict[str, float]:
    """An effect's required parameters in the middle of their prior."""
    specs = [p for p in by_name(name).parameters if p.default is None]
    return {p.name: 0.5 * sum(p.prior) + 0.1 * (p.prior[1] - p.prior[0]) for p in specs}


@pytest.mark.parametrize("name", [effect.kind for effect in ALL])
def test_every_effect_changes_what_its_place_has_and_nothing_elsewhere(name: str) -> None:
    place = by_name(name).places[0]
    changed, sound = hidden(name, place, **middle(name)), Hidden()
    assert changed != sound
    for other, cylinder in changed.cylinders.items():
        assert other == place or cylinder == sound.cylinders[other]


def test_an_effect_of_a_cylinder_sits_at_any_of_the_twelve() -> None:
    for number, axis in enumerate(AXES):
        params = AxisParameters.zeros(12)
        put_into_cylinders(hidden("friction.load", axis, coefficient=0.05), params)
        assert (
            params[number].seal.load_coefficient == 0.05
            and np.count_nonzero(AxisParameters.as_table(params)) == 1
        )


def test_frequencies_become_angular_and_what_is_there_already_is_added_to() -> None:
    params = AxisParameters.zeros(12)
    AxisParameters.as_table(params)[:] = 2.0
    world = hidden("force.periodic", "fr_radial", amplitude=90.0, frequency=5.0)
    put_into_cylinders(world, params)
    assert params[4].extra.periodic_frequency == pytest.approx(10.0 * math.pi)
    put_into_cylinders(hidden("valve.deadband", "fr_radial", deadband=0.1), params)
    assert params[4].valve.dead_band == pytest.approx(2.1)


def test_sensors_have_their_gain_drift_and_delay_in_samples() -> None:
    transducers = Transducer.zeros(2, 12)
    transducers["gain"] = 1.0
    for world in (
        hidden("sensor.gain_b", "rl_vertical", gain_error=0.1),
        hidden("sensor.drift_a", "rl_vertical", rate=500.0),
        hidden("sensor.delay", "rl_vertical", delay=0.02),
    ):
        put_into_sensors(world, transducers, 0.001)
    a, b = transducers[:, 8]
    assert (a.gain, b.gain) == (1.0, pytest.approx(1.1))
    assert (a.drift, b.drift) == (500.0, 0.0)
    assert a.delay_steps == b.delay_steps == 20.0
    with pytest.raises(InputError, match="longer than the world can hold back"):
        put_into_sensors(hidden("sensor.delay", "fl", delay=0.2), transducers, 1e-4)


def test_the_one_power_unit_droops_whichever_cylinder_feels_it() -> None:
    unit = PowerUnit.zeros()[0]
    put_into_supply(hidden("supply.droop", "rr_vertical", droop=1e9, time=0.5), unit)
    assert unit.droop == 1e9 and unit.droop_time == 0.5


def test_a_leg_stands_for_its_vertical_joint_and_the_body_for_all_cylinders() -> None:
    gain = by_name("sensor.gain_a")
    assert places_of(gain, "rl", "at") == ("rl_vertical",)
    assert places_of(gain, "fr_radial", "at") == ("fr_radial",)
    assert places_of(gain, "body", "at") == AXES
    with pytest.raises(InputError, match="rope_left"):
        places_of(gain, "rope_left", "at")


def test_shapes_of_real_machines_are_refused() -> None:
    with pytest.raises(InputError, match="is a shape that the simulated machine does not have"):
        hidden("friction.position", "fl", slope=1.0, curvature=2.0)
