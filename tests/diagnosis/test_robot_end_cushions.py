"""The end cushions that a machine declares are no effect that its model lacks."""

from __future__ import annotations

import numpy as np
import pytest
from shipped import MACHINE, shipped_robot

from testbed.benchmarks.diagnosis.robot_draws import drawn
from testbed.benchmarks.diagnosis.robot_recordings import simulated
from testbed.benchmarks.diagnosis.robot_trials import balances_in
from testbed.diagnosis.robot.end_cushions import end_cushions_n
from testbed.diagnosis.robot.hypotheses import Ledger
from testbed.laws.end_stops import EndParameters, end_force
from testbed.world.hydraulic_parameters import axis_parameters

SWAYS_TO_ITS_END = 11208
"""Of the blind test's runs: a sound machine whose radial pistons come within 1 cm of their ends."""
STEP_S = 1e-4


@pytest.mark.parametrize("from_end_m", [0.004, 0.016, 0.029, 0.2])
@pytest.mark.parametrize("speed_m_s", [-0.05, 0.02])
@pytest.mark.parametrize("inner", [True, False])
def test_cushions_brake_as_the_machine_s_own(
    from_end_m: float, speed_m_s: float, inner: bool
) -> None:
    stroke_m = shipped_robot().linkages.stroke_m
    place = np.where(inner, from_end_m, stroke_m - from_end_m)
    found = end_cushions_n(place[None], np.full((1, 12), speed_m_s), stroke_m, MACHINE)
    ends = axis_parameters(MACHINE)["ends"]
    for i, place_m in enumerate(place.tolist()):
        own = EndParameters.of(**dict(zip(ends.dtype.names, ends[i], strict=True)))
        made = end_force(own, stroke_m[i], place_m, speed_m_s, speed_m_s, STEP_S)
        assert found[0, i] == pytest.approx(made, rel=0.01, abs=0.1)


def test_a_piston_that_leaves_its_end_is_not_held() -> None:
    stroke_m = shipped_robot().linkages.stroke_m
    found = end_cushions_n(np.full((1, 12), 0.01), np.full((1, 12), 0.05), stroke_m, MACHINE)
    assert np.all(found == 0.0)


@pytest.mark.slow
def test_a_sound_machine_that_sways_to_its_ends_has_no_soft_cushion() -> None:
    """It was accused of one with 0.95: what its own end cushions brake was nowhere believed."""
    ledger = Ledger(balances_in(simulated(drawn(SWAYS_TO_ITS_END).scenario())))
    assert ledger.hypothesis(("force.cushion@rr_radial",)).log_factor < 0.0
