"""A balance that no friction can make true is given up; one that it can is kept to the bit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shipped import shipped_model

from testbed.estimation.live import doubt, unknowns
from testbed.estimation.live.axis import AxisState
from testbed.estimation.live.believed import Believed
from testbed.estimation.live.body_belief import body_of
from testbed.estimation.live.body_records import BodyBelief
from testbed.estimation.live.chain import EstimatorChain
from testbed.estimation.live.fusion import Fusion
from testbed.estimation.live.own_tuning import OwnTuning
from testbed.estimation.live.uncertainty import Uncertainty
from testbed.machine.build import build_machine
from testbed.machine.names import AXES, VERTICAL
from testbed.recording.rows import DataRow
from testbed.robot.linkage import Linkages
from testbed.robot.loads.foot_loads import ExpectedLoads
from testbed.robot.model import attitude_gravity
from testbed.robot.rope_bearings import NO_ROPES

MODEL, MACHINE = shipped_model(), build_machine()
BELIEF = Believed.from_machine(MACHINE, 1e-3)
LEVEL = attitude_gravity(0.0, 0.0)
STANCE = np.tile([0.1, 0.2, 0.25], 4)
ROD_SIDE_PA = 2.0e6
HEAVIER = 1.5
"""Feet that bear so much more than the weight as believed: two tonnes that nobody declared."""


def standing(tuning: OwnTuning, *shares: tuple[float, int]) -> tuple[np.ndarray, np.ndarray]:
    """The chain's last row, and the true foot loads (4), after the robot stood still on level
    ground, without friction, while its feet bore a share of what they should, for so many ms, in
    turn.
    """
    sure = Uncertainty(None)
    body = body_of(MACHINE, MODEL, BELIEF.legs, 1e-3, NO_ROPES, tuning, sure)
    chain, row = EstimatorChain(replace(BELIEF, body=body)), DataRow.zeros()
    row["specific_force"], row["pressure_b"], row["carrying"] = -LEVEL, ROD_SIDE_PA, 1.0
    row["oil_temperature"], row["supply_pressure"], row["position"] = 40.0, 9.0e6, STANCE
    loads = ExpectedLoads(MODEL, MACHINE).solve(STANCE, LEVEL, joint_compliance=np.zeros(12))
    arms, cylinders = Linkages.from_machine(MACHINE).rods(STANCE)[1], body["axes"]["cylinder"][0]
    for share, count in shares:
        _, jacobians = MODEL.feet(STANCE)
        ground = np.einsum("ki,kij->j", share * loads.force_in_body_n, jacobians)
        force = (MODEL.gravity_forces(STANCE, LEVEL)[6:] - ground) / arms
        row["pressure_a"] = (force + ROD_SIDE_PA * cylinders["area_b"]) / cylinders["area_a"]
        for _ in range(count):
            chain.step(row)
    return row[0], share * loads.force_in_body_n[:, 2]


def test_the_cost_is_that_of_correlated_deviations_and_of_the_balances_error() -> None:
    """By NumPy, with the deviations of four pistons and three errors of the balance."""
    rng = np.random.default_rng(3)
    fusion = Fusion.zeros()
    deviation, error, alike = rng.normal(size=4), rng.normal(size=3), 0.4
    fusion["sizes"]["spread"], fusion["sizes"]["alike"] = 300.0, alike
    fusion["sizes"]["doubted_sd"] = 200.0
    for k, piston in enumerate(VERTICAL):
        fusion["x"][0][unknowns.DEVIATION + piston] = 300.0 * deviation[k]
    for k, equation in enumerate(unknowns.VERTICAL_EQUATIONS):
        fusion["x"][0][unknowns.BALANCE + equation] = 200.0 * error[k]
    correlation = np.full((4, 4), alike) + (1.0 - alike) * np.eye(4)
    expected = deviation @ np.linalg.solve(correlation, deviation) + error @ error
    assert doubt.cost_of_balance(fusion[0]) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("before", "cost", "grows"),
    [(1.0, 9.9, False), (1.0, 10.1, True), (4.0, 2.4, False), (4.0, 2.6, True)],
)
def test_the_further_the_balance_is_doubted_the_less_cost_is_accepted(
    before: float, cost: float, grows: bool
) -> None:
    belief = BodyBelief.zeros()
    belief["every"], belief["doubt_cost"], belief["doubt_time"] = 5.0, 10.0, 2.0
    belief["decisions"]["dt"] = 1e-3
    after = doubt.followed(before, cost, 10.0, belief[0])
    assert (after > before) == grows and doubt.NONE <= after <= doubt.MOST


def test_a_balance_may_cost_more_once_a_vertical_piston_has_slid() -> None:
    belief, axes = BodyBelief.zeros(), AxisState.zeros(len(AXES))
    belief["doubt_cost"] = 10.0
    axes["has_slid"][VERTICAL[0] - 1] = 1.0
    assert doubt.believable_cost(axes, belief[0]) == 10.0
    axes["has_slid"][VERTICAL[2]] = 1.0
    assert doubt.believable_cost(axes, belief[0]) == 10.0 * doubt.SLID


def test_feet_that_bear_two_tonnes_more_than_believed_are_told_so() -> None:
    """The pressures show it; a balance that is believed hides half of it."""
    doubting, loads = standing(OwnTuning(), (HEAVIER, 8000))
    sure, _ = standing(OwnTuning(doubt_cost=0.0), (HEAVIER, 8000))
    error, without = doubting["estimate"]["own"] - loads, sure["estimate"]["own"] - loads
    assert np.abs(without).min() > 1000.0
    assert np.abs(error).max() < 0.2 * np.abs(without).min()
    interval = doubting["estimate_own"]
    assert ((interval["low"] < loads) & (loads < interval["high"])).all()
    assert doubting["own_balance_doubt"] > 10.0 and sure["own_balance_doubt"] == doubt.NONE


def test_the_doubt_fades_once_the_feet_bear_the_weight_again() -> None:
    row, loads = standing(OwnTuning(), (HEAVIER, 6000), (1.0, 10000))
    assert row["own_balance_doubt"] == doubt.NONE
    assert np.abs(row["estimate"]["own"] - loads).max() < 100.0


def test_a_machine_as_believed_is_estimated_to_the_same_bits_as_without_a_doubt() -> None:
    row, _ = standing(OwnTuning(), (1.05, 3000))
    sure, _ = standing(OwnTuning(doubt_cost=0.0), (1.05, 3000))
    assert row["own_balance_doubt"] == doubt.NONE
    assert all(row["estimate"]["own"] == sure["estimate"]["own"])
