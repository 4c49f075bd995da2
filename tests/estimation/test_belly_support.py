"""A body that lies on something: the balance is left alone until feet and ropes carry it again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shipped import shipped_model

from testbed.estimation.live import unknowns
from testbed.estimation.live.believed import Believed
from testbed.estimation.live.body_belief import body_of
from testbed.estimation.live.chain import EstimatorChain
from testbed.machine.build import build_machine
from testbed.machine.names import GRAVITY_M_S2, LEGS
from testbed.recording.rows import DataRow
from testbed.robot.linkage import Linkages
from testbed.robot.loads.foot_loads import ExpectedLoads
from testbed.robot.model import attitude_gravity
from testbed.robot.rope_bearings import NO_ROPES

MODEL, MACHINE = shipped_model(), build_machine()
BELIEF = Believed.from_machine(MACHINE, 1e-3)
LEVEL = attitude_gravity(0.0, 0.0)
STANCE = np.tile([0.1, 0.2, 0.25], 4)
VERTICAL = slice(2, 12, 3)
ROD_SIDE_PA = 2.0e6
SPEED_M_S = 0.02
"""Feet go down at it: their pistons slide, and zeros are learnt."""


def pressure_a_pa(carried: float, lies: dict[int, float], slides: bool) -> np.ndarray:
    """(12,) under which the feet carry a share of their loads, against friction where they slide;
    `lies`: axis -> N that its sensors add.
    """
    loads = ExpectedLoads(MODEL, MACHINE).solve(STANCE, LEVEL, joint_compliance=np.zeros(12))
    _, jacobians = MODEL.feet(STANCE)
    ground = np.einsum("ki,kij->j", carried * loads.force_in_body_n, jacobians)
    force = (MODEL.gravity_forces(STANCE, LEVEL)[6:] - ground) / Linkages.from_machine(
        MACHINE
    ).rods(STANCE)[1]
    for axis, more in lies.items():
        force[axis] += more
    if slides:
        force[VERTICAL] += [MACHINE.axes[f"{leg}_vertical"].cylinder.coulomb_out_n for leg in LEGS]
    cylinders = bodies()["axes"]["cylinder"][0]
    return (force + ROD_SIDE_PA * cylinders["area_b"]) / cylinders["area_a"]


def bodies() -> np.ndarray:
    return body_of(MACHINE, MODEL, BELIEF.legs, 1e-3, NO_ROPES)


def lowered(
    shares: list[tuple[float, int]],
    rests_ms: int = 0,
    belly: float = 1.0,
    lies: dict[int, float] | None = None,
) -> tuple[EstimatorChain, np.ndarray]:
    """The chain and its row after feet went down that carried (share, for so many ms) of their
    loads, in turn, and then rested under all of them; `belly`: its size beside the true one.
    """
    body = bodies()
    body["belly_length"] *= belly
    chain, row = EstimatorChain(replace(BELIEF, body=body)), DataRow.zeros()
    row["specific_force"], row["pressure_b"], row["carrying"] = -LEVEL, ROD_SIDE_PA, 1.0
    row["oil_temperature"], row["supply_pressure"], row["position"] = 40.0, 9.0e6, STANCE
    row["position"][:, VERTICAL] -= 0.5e-3 * SPEED_M_S * sum(count for _, count in shares)
    for share, count, speed in [
        *((share, count, SPEED_M_S) for share, count in shares),
        (1.0, rests_ms, 0.0),
    ]:
        row["pressure_a"] = pressure_a_pa(share, lies or {}, speed > 0.0)
        for _ in range(count):
            row["position"][:, VERTICAL] += 1e-3 * speed
            chain.step(row)
    return chain, row


def zeros_n(chain: EstimatorChain) -> np.ndarray:
    return np.array(
        chain.state["body"]["fusion"]["x"][0, unknowns.ZERO : unknowns.ZERO + 12][VERTICAL]
    )


def test_feet_that_carry_a_fifth_while_the_belly_lies_teach_no_zeros() -> None:
    chain, row = lowered([(0.2, 2000)])
    assert chain.state["body"]["support"]["carries"][0] == 1.0
    assert not zeros_n(chain).any() and not chain.state["body"]["fusion"]["blamed"].any()
    assert (row["estimate"]["own"][0] < 0.4 * 1.0e4).all()  # and no load is invented
    blind, _ = lowered([(0.2, 2000)], belly=0.0)
    assert blind.state["body"]["fusion"]["x"][0, unknowns.MASS] < -1000.0  # that the belly bears


def test_once_the_feet_carry_the_balance_counts_again() -> None:
    chain, row = lowered([(0.2, 2000)], rests_ms=2000)
    assert chain.state["body"]["support"]["carries"][0] == 0.0
    weight_n = MODEL.total_mass_kg * GRAVITY_M_S2
    assert row["estimate"]["own"][0].sum() == pytest.approx(weight_n, rel=0.02)


def test_a_sensor_that_lies_is_not_taken_for_a_belly() -> None:
    chain, _ = lowered([(1.0, 3000)], lies={5: -5000.0})
    assert chain.state["body"]["support"]["carries"][0] == 0.0
    assert chain.state["body"]["fusion"]["blamed"][0, 5] > 0.0
