"""The published filters: hand-computed steps, equality with filterpy, and the lock-out."""

import numpy as np
import pytest

from testbed.estimation.filters import kbf, modified_kbf, reference


def noisy_walk(n=1500):
    rng = np.random.default_rng(3)
    z = np.cumsum(rng.normal(0, 30, n)) + rng.normal(0, 60, n)
    z[400:440] += 2000.0
    z[900:] += 5000.0
    return z


def test_first_two_kbf_steps_equal_the_hand_computed_ones():
    # P0 = R = 4, Q = 2: P- = 6, K = 0.6, x = 10 + 0.6 (20 - 10) = 16, P = 0.16 * 6 + 0.36 * 4 = 2.4
    state, p = np.zeros(kbf.STATE_SIZE), np.array([2.0, 4.0])
    assert kbf.step(state, 10.0, p) == 10.0
    assert kbf.step(state, 20.0, p) == pytest.approx(16.0, abs=1e-13)
    assert state[1] == pytest.approx(2.4, abs=1e-13)


def test_compiled_kbf_equals_filterpy():
    z = noisy_walk()
    ours, theirs = kbf.run(z, np.array([25.0, 3600.0])), reference.kbf(z, 25.0, 3600.0)
    assert np.max(np.abs(ours - theirs) / np.maximum(1.0, np.abs(theirs))) < 1e-12


@pytest.mark.parametrize("e_max", [50.0, 150.0, 300.0, 3000.0])
def test_compiled_modified_kbf_equals_filterpy(e_max):
    z = noisy_walk()
    ours = modified_kbf.run(z, np.array([25.0, 3600.0, e_max]))
    theirs = reference.modified_kbf(z, 25.0, 3600.0, e_max)
    assert np.max(np.abs(ours - theirs) / np.maximum(1.0, np.abs(theirs))) < 1e-12


def test_samples_that_are_not_numbers_are_passed_over_by_both_alike():
    z = noisy_walk(400)
    z[100:130] = np.nan
    for ours, theirs in (
        (kbf.run(z, np.array([25.0, 3600.0])), reference.kbf(z, 25.0, 3600.0)),
        (
            modified_kbf.run(z, np.array([25.0, 3600.0, 300.0])),
            reference.modified_kbf(z, 25.0, 3600.0, 300.0),
        ),
    ):
        np.testing.assert_allclose(ours, theirs, rtol=1e-12)


def test_one_sample_at_a_time_equals_the_array():
    z, p = noisy_walk(300), np.array([25.0, 3600.0, 300.0])
    for module in (kbf, modified_kbf):
        state = np.zeros(module.STATE_SIZE)
        assert [module.step(state, v, p) for v in z] == list(module.run(z, p))


def test_rejected_sample_keeps_the_state_and_propagates_p():
    state, p = np.array([100.0, 5.0, 1.0]), np.array([2.0, 4.0, 300.0])
    assert modified_kbf.step(state, 500.0, p) == 100.0
    assert state[1] == 7.0


def test_modified_kbf_locks_out_after_a_true_step_above_its_gate():
    z = np.where(np.arange(20000) < 1000, 0.0, 2000.0)
    assert np.all(modified_kbf.run(z, np.array([25.0, 3600.0, 300.0])) == 0.0)
    assert kbf.run(z, np.array([25.0, 3600.0]))[-1] == pytest.approx(2000.0, abs=1e-6)


def test_samples_that_are_not_numbers_leave_the_estimate_alone():
    z, p = np.array([np.nan, 10.0, np.nan, 10.0]), np.array([2.0, 4.0, 300.0])
    for module in (kbf, modified_kbf):
        assert list(module.run(z, p)) == [0.0, 10.0, 10.0, 10.0]
