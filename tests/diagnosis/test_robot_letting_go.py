"""Stuck seals let go by as much as the body's balances jump."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from testbed.benchmarks.diagnosis.robot_draws import drawn
from testbed.benchmarks.diagnosis.robot_recordings import simulated
from testbed.benchmarks.diagnosis.robot_trials import balances_in
from testbed.diagnosis.robot.balance import BODY_ROWS
from testbed.diagnosis.robot.hypotheses import Ledger
from testbed.diagnosis.robot.letting_go import MOST, answers_n, let_go, likely_share

DRY_N, NOISE_N, BINS = 800.0, 50.0, 12
NOISE = np.broadcast_to(NOISE_N**2 * np.eye(BODY_ROWS), (BINS, BODY_ROWS, BODY_ROWS))
STUCK_N = np.full((BINS, 12), DRY_N)
WAYS = np.hstack([np.eye(BODY_ROWS), 0.5 * np.eye(BODY_ROWS)])
"""What the six balances miss by a newton of each of twelve seals."""
SEEMED_TO_STICK = {
    12650: "friction.pressure@rl_rotation",
    12581: "friction.presliding@rl_vertical",
    12347: "friction.pressure@fl_rotation",
}
"""Of the blind test's runs: effects that are not there, with ln B of 7 to 92 before."""


def balance_of(missing: np.ndarray, counted: np.ndarray | None = None) -> Any:
    """A body whose balances miss `missing` (n, 6)."""
    return SimpleNamespace(
        missing=np.hstack([missing, np.zeros((BINS, 12))]),
        by_force=np.broadcast_to(np.vstack([WAYS, np.zeros((12, 12))]), (BINS, 18, 12)),
        counted=np.ones((BINS, 18), dtype=bool) if counted is None else counted,
    )


def share(missing: np.ndarray, counted: np.ndarray | None = None) -> np.ndarray:
    """What is let go from bin to bin."""
    return let_go(balance_of(missing, counted), STUCK_N, NOISE)


def test_a_jump_is_as_large_as_the_share_that_is_let_go_says() -> None:
    jump, by_seal = np.full((1, 1), 600.0), np.full((1, 1, 1), DRY_N)
    found = likely_share(jump, by_seal, np.full((1, 1, 1), NOISE_N**2))
    assert found[0] * DRY_N**2 + NOISE_N**2 == pytest.approx(600.0**2, rel=1e-3)
    assert likely_share(1e4 * jump, by_seal, np.ones((1, 1, 1)))[0] == pytest.approx(MOST)


def test_balances_that_drift_by_less_than_their_noise_show_nothing_let_go() -> None:
    drift = 20.0 * np.arange(BINS)[:, None] * np.ones(BODY_ROWS)
    assert share(drift).tolist() == [0.0] * BINS


def test_what_jumps_once_is_let_go_there_and_beside_and_nowhere_else() -> None:
    for size in (300.0, 1200.0):
        step = size * (np.arange(BINS) >= 6)[:, None] * np.ones(BODY_ROWS)
        found = share(step)
        expected = (size**2 - 2.0 * NOISE_N**2) / (1.25 * DRY_N**2)
        assert found[5:8] == pytest.approx([expected] * 3, rel=1e-3)
        assert np.delete(found, [5, 6, 7]).tolist() == [0.0] * (BINS - 3)


def test_a_bin_whose_balances_do_not_count_shows_nothing() -> None:
    counted = np.ones((BINS, 18), dtype=bool)
    counted[6] = False
    step = 1200.0 * (np.arange(BINS) == 6)[:, None] * np.ones(BODY_ROWS)
    assert share(step, counted).tolist() == [0.0] * BINS


def test_stuck_seals_answer_a_jump_with_what_closes_it_each_as_far_as_it_reaches() -> None:
    step = 1200.0 * (np.arange(BINS) >= 6)[:, None] * np.eye(BODY_ROWS)[2]
    found = answers_n(balance_of(step), STUCK_N, NOISE)
    assert WAYS @ found[6] == pytest.approx(1200.0 * np.eye(BODY_ROWS)[2], rel=0.01)
    assert found[6, 8] == pytest.approx(0.5 * found[6, 2])
    assert np.abs(np.delete(found, 6, axis=0)).max() == 0.0


def test_a_seal_that_slides_answers_nothing() -> None:
    step = 1200.0 * (np.arange(BINS) >= 6)[:, None] * np.eye(BODY_ROWS)[2]
    stuck_n = STUCK_N.copy()
    stuck_n[:, 2] = 0.0
    found = answers_n(balance_of(step), stuck_n, NOISE)
    assert found[6, 2] == 0.0 and 0.5 * found[6, 8] == pytest.approx(1200.0, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "name"), SEEMED_TO_STICK.items())
def test_a_sound_machine_that_drills_has_no_friction_at_a_piston_that_creeps(
    seed: int, name: str
) -> None:
    """Two whose rotation is pressed through its play, and one whose vertical pistons creep."""
    ledger = Ledger(balances_in(simulated(drawn(seed).scenario())))
    assert ledger.hypothesis((name,)).log_factor < 5.0
