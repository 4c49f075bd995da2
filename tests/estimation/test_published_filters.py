"""The published filters: hand-computed steps, equality with filterpy, and the lock-out."""

import numpy as np
import pytest

from testbed.benchmarks.paper import figure_12 as reference
from testbed.estimation.filters import kbf, modified_kbf
from testbed.estimation.filters.kbf import KalmanState

NOISES = {"process_variance": 25.0, "measurement_variance": 3600.0}
SMALL = {"process_variance": 2.0, "measurement_variance": 4.0}


def published(noises):
    """Both filters with their constants, the modified one's gate at 300 N."""
    return (kbf, noises), (modified_kbf, noises | {"innovation_limit": 300.0})


def noisy_walk(n=1500):
    rng = np.random.default_rng(3)
    z = np.cumsum(rng.normal(0, 30, n)) + rng.normal(0, 60, n)
    z[400:440] += 2000.0
    z[900:] += 5000.0
    return z


def test_first_two_kbf_steps_equal_the_hand_computed_ones():
    # P0 = R = 4, Q = 2: P- = 6, K = 0.6, x = 10 + 0.6 (20 - 10) = 16, P = 0.16 * 6 + 0.36 * 4 = 2.4
    state, numbers = KalmanState.zeros()[0], kbf.Numbers.one(**SMALL)[0]
    assert kbf.step(state, 10.0, numbers) == 10.0
    assert kbf.step(state, 20.0, numbers) == pytest.approx(16.0, abs=1e-13)
    assert state["variance"] == pytest.approx(2.4, abs=1e-13)


def test_compiled_kbf_equals_filterpy():
    z = noisy_walk()
    ours, theirs = kbf.run(z, **NOISES), reference.kbf(z, 25.0, 3600.0)
    assert np.max(np.abs(ours - theirs) / np.maximum(1.0, np.abs(theirs))) < 1e-12


@pytest.mark.parametrize("e_max", [50.0, 150.0, 300.0, 3000.0])
def test_compiled_modified_kbf_equals_filterpy(e_max):
    z = noisy_walk()
    ours = modified_kbf.run(z, **NOISES, innovation_limit=e_max)
    theirs = reference.modified_kbf(z, 25.0, 3600.0, e_max)
    assert np.max(np.abs(ours - theirs) / np.maximum(1.0, np.abs(theirs))) < 1e-12


def test_samples_that_are_not_numbers_are_passed_over_by_both_alike():
    z = noisy_walk(400)
    z[100:130] = np.nan
    for ours, theirs in (
        (kbf.run(z, **NOISES), reference.kbf(z, 25.0, 3600.0)),
        (
            modified_kbf.run(z, **NOISES, innovation_limit=300.0),
            reference.modified_kbf(z, 25.0, 3600.0, 300.0),
        ),
    ):
        np.testing.assert_allclose(ours, theirs, rtol=1e-12)


def test_one_sample_at_a_time_equals_the_array():
    z = noisy_walk(300)
    for module, constants in published(NOISES):
        state, numbers = KalmanState.zeros()[0], module.Numbers.one(**constants)[0]
        assert [module.step(state, v, numbers) for v in z] == list(module.run(z, **constants))


def test_rejected_sample_keeps_the_state_and_propagates_p():
    state = KalmanState.one(value=100.0, variance=5.0, started=1.0)[0]
    numbers = modified_kbf.Numbers.one(**SMALL, innovation_limit=300.0)[0]
    assert modified_kbf.step(state, 500.0, numbers) == 100.0
    assert state["variance"] == 7.0


def test_modified_kbf_locks_out_after_a_true_step_above_its_gate():
    z = np.where(np.arange(20000) < 1000, 0.0, 2000.0)
    assert np.all(modified_kbf.run(z, **NOISES, innovation_limit=300.0) == 0.0)
    assert kbf.run(z, **NOISES)[-1] == pytest.approx(2000.0, abs=1e-6)


def test_samples_that_are_not_numbers_leave_the_estimate_alone():
    z = np.array([np.nan, 10.0, np.nan, 10.0])
    for module, constants in published(SMALL):
        assert list(module.run(z, **constants)) == [0.0, 10.0, 10.0, 10.0]
