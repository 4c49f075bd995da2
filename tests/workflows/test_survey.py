"""What people measured before a run is in its recording: whoever reads it believes what the run
believed.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from testbed.errors import InputError
from testbed.machine.build import build_machine
from testbed.scenario.scenario import load_scenario
from testbed.workflows.estimate import survey_of, with_body
from testbed.world.believed_robot import believed_robot
from testbed.world.simulation import Simulation
from testbed.world.summary import surveyed

ROPES = {"left": [0.6, 0.0, 0.8], "right": [0.6, 0.0, 0.8]}
SURVEY = {"rope_directions_in_world": ROPES, "payload_kg": 100.0}
FILE = Path("recording.yaml")


@pytest.mark.parametrize("height_m", [None, 0.28])
def test_the_ropes_are_attached_where_the_survey_says_else_where_the_urdf_does(
    height_m: float | None,
) -> None:
    machine = build_machine()
    urdf_m = survey_of(SURVEY, FILE).robot(machine).model.rope_attachments_m[:, 2]
    survey = SURVEY | {"rope_attachment_height_m": height_m}
    expected = urdf_m if height_m is None else np.full(2, height_m)
    found = survey_of(survey, FILE).robot(machine).model.rope_attachments_m[:, 2]
    np.testing.assert_allclose(found, expected)
    believed = believed_robot(machine, None)
    whole = with_body(believed.legs(1e-3), believed, survey, FILE)
    assert whole.body is not None
    np.testing.assert_allclose(whole.body["rope_point"][0, :, 2], expected)


def test_a_height_that_is_none_is_refused() -> None:
    with pytest.raises(InputError, match="surveyed"):
        survey_of(SURVEY | {"rope_attachment_height_m": "high"}, FILE)


@pytest.mark.slow
def test_a_run_on_a_wall_tells_how_high_its_ropes_are_attached() -> None:
    world = Simulation(load_scenario("drill_slope_45", ["ropes.attachment_height_m=0.28"], 0))
    try:
        survey = survey_of(surveyed(world), FILE)
        there = world.machine.chain.belief["body"]["rope_point"][0]
    finally:
        world.close()
    assert survey.rope_height_m == 0.28
    np.testing.assert_allclose(there[:, 2], 0.28)
