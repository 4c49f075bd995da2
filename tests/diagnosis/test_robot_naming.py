"""A name whose size may be nothing: what is not said, and what forces are not corrected for."""

from __future__ import annotations

from typing import Any

import pytest

from testbed.diagnosis.robot.diagnose import SIZE_UNKNOWN, RobotDiagnosis, Verdict
from testbed.diagnosis.robot.findings import as_json, models
from testbed.diagnosis.robot.groups import FORCES
from testbed.diagnosis.robot.naming import CONTAINS_ZERO, without
from testbed.diagnosis.robot.parameters import Found
from testbed.recording.leg_model import Parameter
from testbed.recording.robot_model import RobotModelFile

SPRING, CUSHION = "force.spring@rr_vertical", "force.cushion@rr_vertical"


def found(name: str, **intervals: tuple[float, float]) -> Found:
    """An effect with the middles of these intervals."""
    kind, _, place = name.partition("@")
    return Found(
        kind,
        place,
        {k: Parameter(value=sum(ends) / 2, interval90=ends) for k, ends in intervals.items()},
    )


PLACE = {"x": (0.1, 0.2), "y": (0.1, 0.2), "z": (-0.1, 0.2)}


@pytest.mark.parametrize(
    ("effect", "nothing"),
    [
        (found(SPRING, stiffness=(-3e4, 2e4), rest=(0.1, 0.2)), True),
        (found(SPRING, stiffness=(1e4, 2e4), rest=(-0.1, 0.2)), False),
        (found("rope.stiffness@rope", factor=(0.4, 1.2)), True),
        (found("rope.stiffness@rope", factor=(0.4, 0.8)), False),
        (found("robot.payload@body", mass=(-30.0, 600.0), **PLACE), True),
        (found("robot.payload@body", mass=(300.0, 600.0), **PLACE), False),
        (found("rope.tension_gain@rope_left", gain_error=(-0.1, 0.1), zero=(100.0, 300.0)), False),
        (found("sensor.delay@rr_radial", delay=(-0.002, 0.02)), True),
        (found("robot.centre_of_mass@body", x=(-0.1, 0.1), y=(-0.1, 0.1), z=(0.1, 0.2)), False),
    ],
)
def test_an_effect_may_be_nothing_by_a_number_that_makes_it_none_alone(
    effect: Found, nothing: bool
) -> None:
    assert effect.may_be_nothing == nothing


def test_the_probability_of_what_may_be_zero_goes_to_what_is_left_without_it() -> None:
    weights = {(SPRING,): 0.5, (CUSHION,): 0.3, (): 0.2}
    assert without(weights, {SPRING: CONTAINS_ZERO}) == {
        (CUSHION,): pytest.approx(0.3),
        (): pytest.approx(0.7),
    }


@pytest.mark.parametrize(("lowest", "believed"), [(1e3, 1), (-3e4, 0)])
def test_forces_are_not_corrected_for_what_may_be_of_any_size_elsewhere(
    lowest: float, believed: int
) -> None:
    """A spring whose piston hardly moved: it is said, and its force there is known."""
    nothing: Any = None
    spring = found(SPRING, stiffness=(lowest, 4e4), rest=(0.1, 0.2))
    verdict = Verdict("effect", nothing, (((SPRING,), 1.0),), {})
    errors = {FORCES: {"before": 1.0, "refit": 1.0, "after": 0.9}}
    said = RobotDiagnosis("run", nothing, nothing, verdict, (spring,), errors, {})
    assert len(models(said, RobotModelFile())["after"].effects) == believed
    assert as_json(said).get("not_believed") == (None if believed else SIZE_UNKNOWN)
