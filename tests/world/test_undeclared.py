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
from testbed.laws.axis_records import AxisParameters
from testbed.laws.supply import PowerUnit
from testbed.machine.names import AXES
from testbed.scenario.parts import Undeclared
from testbed.world.sensing import Transducer
from testbed.world.undeclared import (
    hidden_beside,
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


def _entries(*told: tuple[str, str, dict[str, float]]) -> list[Undeclared]:
    return [Undeclared(effect=name, at=at, parameters=values) for name, at, values in told]


STIFF = {"stiffness": 1e7, "damping": 100.0}


@pytest.mark.parametrize(
    ("told", "refused"),
    [
        ([("friction.presliding", "fl", STIFF), ("friction.presliding", "fl_vertical", STIFF)], 0),
        ([("leg.hinge", "fl", dict(x=0.1, y=0.0, z=0.0))] * 2, 0),
        ([("supply.droop", "supply", {"droop": 1e9, "time": 0.1})] * 2, 0),
        ([("sensor.gain_a", "fl", {"gain_error": share}) for share in (0.02, 0.03)], 0),
        ([("sensor.drift_a", "rr", {"rate": 90.0}), ("sensor.drift_a", "body", {"rate": 70.0})], 0),
    ],
)
def test_of_two_that_replace_the_same_number_the_one_in_vain_is_refused(
    told: list[tuple[str, str, dict[str, float]]], refused: int
) -> None:
    with pytest.raises(InputError, match=rf"undeclared\.{refused} = .* would have no effect"):
        hidden_beside([], _entries(*told))


def test_what_adds_up_may_be_declared_twice_at_a_place() -> None:
    """Two loads on the body, friction of 2 and 3 % and two factors of 0.9: 5 % and 0.81."""
    load = {"mass": 100.0, "x": 0.2, "y": 0.0, "z": 0.4}
    world = hidden_beside(
        [],
        _entries(
            ("robot.payload", "body", load),
            ("robot.payload", "body", load),
            ("friction.load", "fl", {"coefficient": 0.02}),
            ("friction.load", "fl", {"coefficient": 0.03}),
            ("supply.pump", "supply", {"flow_factor": 1.0, "pressure_factor": 0.9}),
            ("supply.pump", "supply", {"flow_factor": 1.0, "pressure_factor": 0.9}),
        ),
    )
    assert [mass.mass_kg for mass in world.body_masses] == [100.0, 100.0]
    added = world.cylinders["fl_vertical"].added
    assert added["seal.load_coefficient"] == pytest.approx(0.05)
    assert world.pump_pressure_factor == pytest.approx(0.81)


def test_what_a_workshop_left_is_replaced_by_what_is_declared() -> None:
    drawn = _entries(("friction.presliding", "fl", STIFF))
    declared = _entries(("friction.presliding", "fl", {"stiffness": 2e7, "damping": 100.0}))
    found = hidden_beside(drawn, declared).cylinders["fl_vertical"].replaced
    assert found["seal.bristle_stiffness"] == 2e7


def test_a_fault_of_a_scenario_has_its_own_number_on_a_drawn_machine() -> None:
    drawn = _entries(("friction.presliding", "fl", STIFF))
    with pytest.raises(InputError, match=r"undeclared\.0\.at"):
        hidden_beside(drawn, _entries(("friction.presliding", "drill", STIFF)))
