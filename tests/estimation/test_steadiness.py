"""What the balance says the longer a machine rests and the less steadily it goes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_belly_support import (
    BELIEF,
    LEVEL,
    ROD_SIDE_PA,
    SPEED_M_S,
    STANCE,
    VERTICAL,
    bodies,
    pressure_a_pa,
)

from testbed.estimation.live import unknowns
from testbed.estimation.live.chain import EstimatorChain
from testbed.estimation.live.fusion import Fusion, predict, start
from testbed.recording.rows import DataRow

SPREAD_N = 300.0


def spread_at(alike: list[float]) -> np.ndarray:
    """Covariance (12, 12) of deviations long after their start, under these correlations (4,)."""
    fusion = Fusion.zeros()[0]
    fusion["sizes"]["spread"], fusion["sizes"]["keep"] = SPREAD_N, 0.9
    fusion["sizes"]["alike"], fusion["sizes"]["balance_keep"] = alike, 0.9
    start(fusion, np.zeros(len(unknowns.CONSTANTS)))
    for _ in range(100):
        predict(fusion)
    return np.array(
        fusion["p"][
            unknowns.DEVIATION : unknowns.DEVIATION + 12,
            unknowns.DEVIATION : unknowns.DEVIATION + 12,
        ]
    )


def test_friction_of_pistons_long_at_rest_is_alike_at_the_feet_and_no_wider() -> None:
    p = spread_at([0.5] * 4)
    assert np.diag(p) == pytest.approx(SPREAD_N**2)
    feet = p[VERTICAL, VERTICAL]
    assert feet[~np.eye(4, dtype=bool)] == pytest.approx(0.5 * SPREAD_N**2, rel=1e-3)
    assert np.linalg.eigvalsh(p).min() > 0.0
    assert not (p - np.diag(np.diag(p)))[:2].any()  # of other cylinders nothing is known


def test_a_foot_that_moves_has_friction_of_its_own() -> None:
    p = spread_at([0.5, 0.0, 0.5, 0.5])
    assert not p[5, [2, 8, 11]].any() and p[2, 8] > 0.0


def sure_of_mass_kg(shake_m_s2: float) -> float:
    """How sure the machine is of its mass after its feet slid down for 0.2 s, under a specific
    force that changes by so much from balance to balance.
    """
    body = bodies()
    chain, row = EstimatorChain(replace(BELIEF, body=body)), DataRow.zeros()
    row["pressure_a"], row["pressure_b"] = pressure_a_pa(1.0, {}, True), ROD_SIDE_PA
    row["oil_temperature"], row["supply_pressure"], row["carrying"] = 40.0, 9.0e6, 1.0
    row["position"] = STANCE
    for k in range(200):
        row["specific_force"] = -LEVEL
        row["specific_force"][0, 2] += 0.5 * shake_m_s2 * (-1.0) ** (k // int(body["every"][0]))
        row["position"][:, VERTICAL] += 1e-3 * SPEED_M_S
        chain.step(row)
    return float(np.sqrt(chain.state["body"]["fusion"]["p"][0, unknowns.MASS, unknowns.MASS]))


def test_a_body_that_goes_unsteadily_teaches_less() -> None:
    before = float(bodies()["known"][0, unknowns.MASS])
    steady, little, much = (before - sure_of_mass_kg(shake) for shake in (0.0, 1.0, 10.0))
    assert 0.0 < much < 0.5 * steady and much < little < steady
