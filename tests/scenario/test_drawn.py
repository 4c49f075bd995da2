"""Drawn machines: reproducible, within their tolerances, number by number independent."""

from __future__ import annotations

import numpy as np
import pytest

from testbed.effects import by_name
from testbed.errors import InputError
from testbed.machine.build import build_machine
from testbed.machine.names import AXES
from testbed.scenario import machines as drawn
from testbed.scenario.machines import GROUND, Tolerance, draw_machine, machines_of, tolerances
from testbed.scenario.scenario import load_scenario

DRAWING = build_machine()
WORKSHOP = tolerances("workshop")


def test_the_same_seed_draws_the_same_machine_and_another_one_another() -> None:
    first, again = (draw_machine("workshop", 7, DRAWING).numbers for _ in range(2))
    other = draw_machine("workshop", 8, DRAWING).numbers
    assert first == again
    both = first.keys() & other.keys()
    assert len(both) > 300
    assert all(first[name] != other[name] for name in both)


@pytest.mark.parametrize("tolerance", WORKSHOP, ids=lambda t: t.number)
def test_draws_fill_their_range_and_stay_in_it(tolerance: Tolerance) -> None:
    name, (low, high) = tolerance.names()[0], tolerance.range
    found = [d for seed in range(400) if (d := tolerance.draw(name, seed)) is not None]
    assert low <= min(found) and max(found) <= high
    assert abs(np.mean(found) - 0.5 * (low + high)) < 0.15 * (high - low)
    expected = (high - low) / np.sqrt(24.0 if tolerance.spread == "triangular" else 12.0)
    assert np.std(found) == pytest.approx(expected, rel=0.25)
    assert len(found) / 400 == pytest.approx(tolerance.chance, abs=0.08)


@pytest.mark.parametrize("tolerance", WORKSHOP, ids=lambda t: t.number)
def test_every_tolerance_names_a_number_that_a_world_has(tolerance: Tolerance) -> None:
    number = tolerance.names()[0]
    if number == GROUND:
        return
    if "@" not in number:
        declared = DRAWING.quantity(number)
        assert tolerance.unit == ("1" if tolerance.by == "factor" else declared.unit)
        return
    effect, _, where = number.partition("@")
    place, _, parameter = where.partition(".")
    spec = by_name(effect).spec(parameter)
    assert place in by_name(effect).places
    assert spec.low <= tolerance.range[0] < tolerance.range[1] <= spec.high
    assert tolerance.unit == spec.unit


def test_a_tolerance_less_leaves_the_other_numbers_as_they_are(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    whole = draw_machine("workshop", 3, DRAWING).numbers
    monkeypatch.setattr(drawn, "tolerances", lambda _: WORKSHOP[5:])
    fewer = draw_machine("workshop", 3, DRAWING).numbers
    assert 0 < len(fewer) < len(whole)
    assert all(whole[name] == fewer[name] for name in fewer)


def test_the_model_keeps_the_drawing_and_the_world_takes_the_draw() -> None:
    plain = machines_of(load_scenario("stand_slope_45"))
    drew = machines_of(load_scenario("stand_slope_45", ["machine.draw=workshop", "machine.seed=5"]))
    assert dict(drew.belief.leaves()) == dict(plain.belief.leaves())
    assert dict(plain.truth.leaves()) == dict(plain.belief.leaves())
    sizes = [drew.truth.axes[axis].seal.side_load_coefficient for axis in AXES]
    assert len(set(sizes)) == len(AXES) and min(sizes) >= 0.1 and max(sizes) <= 0.3


def test_a_draw_stands_on_what_the_scenario_changes() -> None:
    more = ["machine.draw=workshop", "hydraulics.parameters.oil.bulk_modulus_pa=0.9e9"]
    factor = {
        len(changes): machines_of(
            load_scenario("stand_slope_45", changes)
        ).truth.oil.bulk_modulus_pa
        for changes in (more[:1], more)
    }
    assert factor[1] == pytest.approx(2.0 * factor[2])


def test_a_seed_without_a_draw_is_refused() -> None:
    with pytest.raises(InputError, match="has a seed, but nothing is drawn"):
        load_scenario("stand_slope_45", ["machine.seed=3"])
    with pytest.raises(InputError, match=r"machine\.draw.*workshop"):
        load_scenario("stand_slope_45", ["machine.draw=kitchen"])


@pytest.mark.parametrize("draw", [[], ["machine.draw=workshop", "machine.seed=7"]])
def test_a_robot_is_as_unsure_of_a_machine_as_drawn_up_as_of_a_drawn_one(draw: list[str]) -> None:
    """It does not know which of the two it is; who wants it to be sure says so."""
    assert load_scenario("stand_slope_45", draw).tolerances == "workshop"
    assert load_scenario("stand_slope_45", [*draw, "model.tolerances=exact"]).tolerances is None
