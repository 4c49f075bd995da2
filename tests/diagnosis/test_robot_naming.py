"""What is not said: a name whose size may be nothing, and what becomes of its probability."""

from __future__ import annotations

from typing import Any

import pytest

from testbed.diagnosis.robot.diagnose import SIZE_UNKNOWN, RobotDiagnosis, Verdict
from testbed.diagnosis.robot.findings import as_json, models
from testbed.diagnosis.robot.groups import FORCES
from testbed.diagnosis.robot.naming import CONTAINS_ZERO, NO_SIZE, without
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


def test_what_has_no_size_is_there_all_the_same() -> None:
    """Its probability goes to all others in proportion; that of one that may be zero to none."""
    weights = {(SPRING,): 0.5, (CUSHION,): 0.3, (): 0.2}
    assert without(weights, {SPRING: NO_SIZE}) == {
        (CUSHION,): pytest.approx(0.6),
        (): pytest.approx(0.4),
    }
    assert without(weights, {SPRING: CONTAINS_ZERO}) == {
        (CUSHION,): pytest.approx(0.3),
        (): pytest.approx(0.7),
    }
    assert without({(SPRING,): 1.0}, {SPRING: NO_SIZE}) == {(): 1.0}


@pytest.mark.parametrize(("unsized", "believed"), [((), 1), (("rr_vertical",), 0)])
def test_forces_are_not_corrected_where_the_size_of_a_rival_is_unknown(
    unsized: tuple[str, ...], believed: int
) -> None:
    nothing: Any = None
    cushion = found(CUSHION, stiffness=(1e4, 2e4), start=(0.1, 0.2))
    verdict = Verdict("effect", nothing, (((CUSHION,), 1.0),), {})
    errors = {FORCES: {"before": 1.0, "refit": 1.0, "after": 0.9}}
    said = RobotDiagnosis(
        "run", nothing, nothing, verdict, (cushion,), errors, {}, unsized=frozenset(unsized)
    )
    assert len(models(said, RobotModelFile())["after"].effects) == believed
    assert as_json(said).get("not_believed") == (None if believed else SIZE_UNKNOWN)
