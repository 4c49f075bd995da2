"""A tolerance's mean and spread are those of its draws, and its ranges grow with the machine as
their unit does.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from testbed.machine.names import AXES
from testbed.machine.scale import ROBOCLIMBER, Scale
from testbed.scenario.machines import Tolerance


def tolerance(**fields: Any) -> Tolerance:
    shared = {
        "number": "axes.*.seal.position_slope",
        "by": "offset",
        "range": (-0.2, 0.6),
        "unit": "1",
        "spread": "uniform",
        "mark": "E",
        "source": "a test",
    }
    return Tolerance.model_validate(shared | fields)


@pytest.mark.parametrize("spread", ["uniform", "triangular"])
@pytest.mark.parametrize("chance", [1.0, 0.3])
@pytest.mark.parametrize("by", ["offset", "factor"])
def test_mean_and_spread_are_those_of_many_draws(spread: str, chance: float, by: str) -> None:
    one = tolerance(spread=spread, chance=chance, by=by, range=(0.9, 1.3))
    none = 1.0 if by == "factor" else 0.0
    drawn = [one.draw("a.number", seed) for seed in range(4_000)]
    values = np.array([none if value is None else value for value in drawn])
    mean, deviation = one.moments()
    assert values.mean() == pytest.approx(mean, abs=5.0 * deviation / np.sqrt(len(values)))
    assert values.std() == pytest.approx(deviation, rel=0.05)


@pytest.mark.parametrize(
    ("by", "drawing", "true"), [("offset", 2.0, 2.5), ("factor", 2.0, 1.0), ("value", 2.0, 0.5)]
)
def test_a_draw_of_a_half_is_applied_as_it_says(by: str, drawing: float, true: float) -> None:
    assert tolerance(by=by, range=(0.0, 1.0)).applied(drawing, 0.5) == true


def test_a_factors_spread_goes_with_the_drawing_and_an_offsets_does_not() -> None:
    of_drawing = tolerance(by="factor", range=(0.9, 1.1))
    assert of_drawing.standard_deviation("x", 50.0, ROBOCLIMBER) == pytest.approx(
        10.0 / np.sqrt(12.0)
    )
    assert tolerance().standard_deviation("x", 50.0, ROBOCLIMBER) == pytest.approx(
        0.8 / np.sqrt(12.0)
    )


@pytest.mark.parametrize(
    ("unit", "name", "grows"),
    [
        ("m", "x", 2.0),
        ("kg", "x", 8.0),
        ("1", "x", 1.0),
        ("rad/s", "x", 1.0),
        ("m or rad", "fl_radial.offset", 2.0),
        ("m or rad", "fl_rotation.offset", 1.0),
    ],
)
def test_a_machine_of_twice_the_size_errs_by_more_as_the_unit_says(
    unit: str, name: str, grows: float
) -> None:
    assert tolerance(unit=unit).times(name, Scale(8.0, 2.0)) == pytest.approx(grows)
    assert tolerance(unit=unit, by="factor").times(name, Scale(8.0, 2.0)) == 1.0


@pytest.mark.parametrize(
    ("number", "count", "first"),
    [
        ("axes.*.seal.position_slope", 12, f"axes.{AXES[0]}.seal.position_slope"),
        ("leg.hinge@*.z", 4, "leg.hinge@fl.z"),
        ("each_leg.*.radial_offset_m", 4, "each_leg.fl.radial_offset_m"),
        ("rope.direction@*.azimuth", 2, "rope.direction@rope_left.azimuth"),
        ("joint.play@*.play", 4, "joint.play@fl_rotation.play"),
        ("power_unit.full_flow_m3_s", 1, "power_unit.full_flow_m3_s"),
    ],
)
def test_a_star_stands_for_each_place_of_its_kind(number: str, count: int, first: str) -> None:
    names = tolerance(number=number).names()
    assert len(names) == len(set(names)) == count and names[0] == first


def test_parameters_of_one_effect_are_there_together_or_not_at_all() -> None:
    rare = tolerance(number="sensor.gain_a@*.gain_error", chance=0.5)
    for seed in range(200):
        pair = [rare.draw(f"sensor.gain_a@fl_vertical.{key}", seed) for key in ("one", "other")]
        assert (pair[0] is None) == (pair[1] is None)
