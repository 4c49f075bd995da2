"""A vector of fitted numbers and what it stands for: there and back, bounds kept, the rest as it
was.
"""

from __future__ import annotations

import numpy as np
import pytest

from testbed.diagnosis.leg.points import (
    DECLARED,
    FRICTION,
    FRICTION_NAMES,
    NUISANCE,
    ZERO,
    Point,
    friction_coordinates,
    point,
    restarted,
    start_vector,
)
from testbed.effects import by_name
from testbed.effects.active import Active
from testbed.effects.terms import Coordinate
from testbed.estimation.leg.flow import Edges
from testbed.recording.known import Known
from testbed.recording.leg_model import Friction, LegModel

STICKY = Friction(viscous_plus_n_s_m=2_000.0, coulomb_plus_n=300.0, stribeck_speed_plus_m_s=0.02)
GAIN = by_name("sensor.gain_a")
AT = Point(
    STICKY, Edges(), (Active(GAIN, GAIN.complete({"gain_error": 0.03})),), 50.0, {"bore_m": 0.01}
)
EVERY = (
    *friction_coordinates(STICKY, 100.0),
    Coordinate(NUISANCE, "gain", 1.0, 0.5, 2.0, 0.1),
    Coordinate(ZERO, "zero", 0.0, -1e4, 1e4, 100.0),
    Coordinate(DECLARED, "bore_m", 0.0, -0.1, 0.1, 0.01),
    GAIN.spec("gain_error").coordinate(GAIN.name, 0.0, ("force",)),
)


def test_a_point_comes_back_from_the_vector_that_it_starts() -> None:
    from_here = [restarted(coordinate, AT) for coordinate in EVERY]
    again = point(from_here, start_vector(from_here), AT)
    for name in FRICTION_NAMES:
        assert getattr(again.friction, name) == pytest.approx(getattr(STICKY, name))
    assert (again.zero_n, again.off["bore_m"]) == (50.0, 0.01)
    assert again.edges.gain == AT.edges.gain
    (effect,) = again.effects
    assert effect.values == pytest.approx(AT.effects[0].values)


def test_what_is_not_fitted_stays_as_it_was() -> None:
    speed = Coordinate(FRICTION, "coulomb_plus_n", 0.0, 0.0, 1e6, 100.0)
    moved = point([speed], np.array([777.0]), AT)
    assert moved.friction.coulomb_plus_n == 777.0
    assert moved.friction.viscous_plus_n_s_m == STICKY.viscous_plus_n_s_m
    assert (moved.zero_n, moved.off, moved.edges) == (AT.zero_n, dict(AT.off), AT.edges)


@pytest.mark.parametrize(("t", "number"), [(1e9, 2.0), (-1e9, 0.5), (1.2, 1.2)])
def test_a_number_is_held_within_its_bounds(t: float, number: float) -> None:
    gain = Coordinate(NUISANCE, "gain", 1.0, 0.5, 2.0, 0.1)
    assert point([gain], np.array([t]), AT).edges.gain == number


def test_speeds_are_fitted_as_logarithms_and_forces_as_they_are() -> None:
    vector = dict(
        zip(FRICTION_NAMES, start_vector(friction_coordinates(STICKY, 100.0)), strict=True)
    )
    assert vector["stribeck_speed_plus_m_s"] == pytest.approx(np.log(0.02))
    assert vector["coulomb_plus_n"] == 300.0


def test_a_start_beyond_its_bounds_starts_at_the_bound() -> None:
    beyond = Coordinate(ZERO, "zero", 1e9, -1e4, 1e4, 100.0)
    assert start_vector([beyond]).tolist() == [1e4]


def test_a_model_has_the_points_friction_zero_and_declared_numbers_and_no_effect_of_its_own() -> (
    None
):
    base = LegModel(known=Known(bore_m=0.08, rod_m=0.045), force_offset_n=20.0)
    model = AT.model(base)
    assert model.friction is STICKY and model.force_offset_n == 70.0
    assert model.known.bore_m == pytest.approx(0.0808) and model.known.rod_m == 0.045
    assert model.effects == base.effects
    assert Point(STICKY, Edges(), ()).model(base).known == base.known


def test_an_effect_that_joins_is_made_of_its_fitted_numbers_and_its_defaults() -> None:
    joins = by_name("force.spring")
    fitted = joins.coordinates({"stiffness": 800.0, "rest": 0.2})
    found = point(fitted, start_vector(fitted), Point(STICKY, Edges(), ()))
    (effect,) = found.effects
    assert effect.effect.name == "force.spring"
    assert effect.values == pytest.approx({"stiffness": 800.0, "rest": 0.2, "cubic": 0.0})
