"""Detectors of contact loss: each speaks for a loss and not before, causally; the seals slip as they must."""

from __future__ import annotations

import numpy as np
import pytest

from testbed.errors import InputError
from testbed.estimation.detectors import combined, cusum, glr, momentum, signals
from testbed.estimation.detectors.table import BEST, DETECTORS, by_name
from testbed.estimation.live.believed import Believed
from testbed.machine.build import build_machine

MACHINE = build_machine()
LEG = Believed.from_machine(MACHINE, 1e-3).legs[0].packed()
NUMBERS = signals.parameters(MACHINE, 1e-3)


def _signals(load: np.ndarray) -> np.ndarray:
    """Every rung reads `load` (n,) on all four feet; 5 kN are expected."""
    out = np.zeros((len(load), len(signals.SIGNALS), 4))
    for row in (*range(signals.OWN_SD), signals.CARRIED, signals.REFERENCE, signals.BALANCE):
        out[:, row] = load[:, None]
    out[:, signals.EXPECTED] = 5000.0
    return out


def _scores(name: str, load: np.ndarray) -> np.ndarray:
    detector, score = by_name(name), np.zeros((len(load), 4))
    detector.run(_signals(load), detector.start(), np.array(detector.numbers), score)
    return score


@pytest.mark.parametrize("name", [d.name for d in DETECTORS])
def test_a_lost_foot_scores_higher_than_any_moment_before_and_all_feet_alike(name: str) -> None:
    load = np.concatenate([np.full(500, 5000.0), np.zeros(200)])
    score = _scores(name, load)
    assert score[550:].max() > score[:500].max()
    assert np.all(score == score[:, :1])


@pytest.mark.parametrize("name", [d.name for d in DETECTORS])
def test_a_score_does_not_depend_on_what_comes_later(name: str) -> None:
    rng = np.random.default_rng(3)
    load = 4000.0 + rng.normal(0.0, 300.0, 400)
    other = np.concatenate([load[:300], rng.normal(0.0, 300.0, 100)])
    assert np.array_equal(_scores(name, load)[:300], _scores(name, other)[:300])


def test_one_detector_is_the_best_and_an_unknown_name_is_refused() -> None:
    assert [d.name for d in DETECTORS if d.best] == [BEST]
    with pytest.raises(InputError, match="no such detector"):
        by_name("combinde")


def _combined(own: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Load that the combined detector sees where `balance` and `carried` read `others` (n,) and the estimate `own`."""
    rows, score = _signals(others), np.zeros((len(own), 4))
    rows[:, signals.OWN] = own[:, None]
    combined.run(rows, by_name(BEST).start(), np.array(by_name(BEST).numbers), score)
    return -score[:, 0]


def test_a_drifting_sensor_is_given_back_what_friction_cannot_explain() -> None:
    """Drifted by 4 kN, 800 N of them friction's: 0.35 * 4000 + (0.3 + 0.35) * 3200 = 3480 N, not 1400."""
    own = np.full(100_000, 4000.0)
    assert _combined(own, np.zeros(100_000))[-1] == pytest.approx(3480.0, abs=1.0)
    assert _combined(own, np.full(100_000, 3300.0))[-1] == pytest.approx(
        0.35 * 4000.0 + 0.65 * 3300.0
    )


def test_a_foot_lost_after_a_drift_is_still_seen_within_a_hundredth_of_a_second() -> None:
    lost = np.concatenate([np.full(60_000, 4000.0), np.zeros(20)])
    seen = _combined(lost, lost - 3000.0)
    assert seen[59_999] > 3000.0
    assert seen[60_010] < seen[59_999] - 3900.0


def test_cusum_gains_the_log_likelihood_ratio_of_each_sample() -> None:
    """m0 = 1000, s = 500, load 250: -1000 / 250 000 (250 - 500) = 1 nat a sample; it cannot fall below 0."""
    p, state, score = (
        np.array([signals.OWN, 1000.0, 500.0, 5.0]),
        np.zeros((4, 1)),
        np.zeros((5, 4)),
    )
    cusum.run(_signals(np.array([3000.0, 250.0, 250.0, 250.0, 750.0])), state, p, score)
    assert score[:, 0] == pytest.approx([0.0, 1.0, 2.0, 3.0, 2.0])


def test_glr_of_white_noise_is_the_textbook_ratio() -> None:
    """Uncoloured, m0 = 1000, m1 = 0, s = 100: 40 samples of 0 N give 40 / 2 (1000 / 100)^2 = 2000 nats."""
    p = np.array([signals.OWN, 1000.0, 0.0, 0.0, 0.0, 100.0])
    state, score = np.zeros((4, glr.STATE_SIZE)), np.zeros((100, 4))
    glr.run(_signals(np.concatenate([np.full(60, 5000.0), np.zeros(40)])), state, p, score)
    assert score[-1, 0] == pytest.approx(2000.0)
    assert score[59, 0] < 0.0


def test_the_momentum_observer_follows_the_force_with_its_time_constant() -> None:
    p, state, score = (
        np.array([100.0, 91.7, 1e-3]),
        np.zeros((4, momentum.STATE_SIZE)),
        np.zeros((1000, 4)),
    )
    momentum.run(_signals(np.concatenate([np.full(500, 5000.0), np.zeros(500)])), state, p, score)
    assert -score[499, 0] == pytest.approx(5000.0, rel=1e-6)
    assert -score[510, 0] == pytest.approx(5000.0 * (1.0 - 100.0 * 1e-3) ** 11)  # e^(-t K) in steps


def _carried(load: np.ndarray, friction: np.ndarray) -> np.ndarray:
    """CARRIED for a still, shut cylinder whose pressures bear `load` plus `friction` (n,), N; B at 2 MPa."""
    area_a, area_b, weight = LEG[8], LEG[9], LEG[10] * 9.81
    state, out = np.zeros(signals.STATE_SIZE), np.zeros((len(signals.SIGNALS), 4))
    numbers = NUMBERS.copy()
    numbers[[signals.LEAK, signals.EDGE_LEAK, signals.EDGE_LEAK_P]] = 0.0
    found = []
    for force in load + friction - weight:
        pa = (force + 2.0e6 * area_b) / area_a
        signals.step_leg(pa, 2.0e6, 0.25, 0.0, 9.0e6, 9.81, LEG, numbers, state, out, 0)
        found.append(out[signals.CARRIED, 0])
    return np.array(found)


@pytest.mark.parametrize("before", [-700.0, 0.0, 800.0])
def test_after_a_loss_of_twice_the_break_away_the_load_is_known_whatever_friction_was(
    before: float,
) -> None:
    """The foot extends as it is let go, so friction ends at its upper bound: 620 + 180 N."""
    load = np.concatenate([np.full(300, 6000.0), np.linspace(6000.0, 0.0, 50), np.zeros(200)])
    friction = np.concatenate(
        [np.full(300, before), np.linspace(before, 800.0, 50), np.full(200, 800.0)]
    )
    assert abs(_carried(load, friction)[-1]) < 1.0


def test_a_small_change_of_load_is_shared_between_oil_and_seal() -> None:
    """Unloading by dF lengthens oil and seal together: the pressures show k_oil / (k_oil + k_seal) of it."""
    leak_free = NUMBERS.copy()
    leak_free[[signals.LEAK, signals.EDGE_LEAK, signals.EDGE_LEAK_P]] = 0.0
    dp = 1.0e4
    travel = signals.oil_travel(-dp, 0.0, 3.0e6, 2.0e6, 9.0e6, 0.25, 0.0, LEG, leak_free)
    k_oil = dp * LEG[8] / travel
    assert 1.0e7 < k_oil < 3.0e7
    step = 200.0
    seen = step * k_oil / (k_oil + LEG[31])
    load = np.concatenate([np.full(300, 6000.0), np.full(300, 6000.0 - step)])
    friction = np.concatenate([np.zeros(300), np.full(300, step - seen)])
    assert _carried(load, friction)[-1] == pytest.approx(6000.0 - step, abs=0.03 * step)
