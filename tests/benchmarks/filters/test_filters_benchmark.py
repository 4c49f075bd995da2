"""The own filter against its rivals: six scenes, no lock-out, bounded delay; rivals' steps by
hand.
"""

import json
import math

import numpy as np
import pytest

from testbed.benchmarks.filters import rivals
from testbed.benchmarks.filters.benchmark import Filters, compare_scene, half_height_delays
from testbed.benchmarks.filters.rivals import OWN, RIVALS, SCENES, scene, spikes
from testbed.benchmarks.harness import run
from testbed.estimation.filters import kbf, persistent
from testbed.estimation.filters.kbf import KalmanState

RIVAL = {f.name: f for f in RIVALS}


QUIET = {
    "process_variance": 9.0,
    "measurement_variance": 3600.0,
    "innovation_limit": 300.0,
    "hold_samples": 10.0,
}


def after_one_sample(step, constants, z, **numbers):
    """Estimate and variance after one sample; before it 0 and 4, with Q = 2 and R = 4."""
    state = KalmanState.one(value=0.0, variance=4.0, started=1.0)[0]
    given = constants.one(process_variance=2.0, measurement_variance=4.0, **numbers)[0]
    return step(state, z, given), state["variance"]


def test_saturated_filter_pulls_by_gain_times_its_limit():
    # P- = 6, K = 6 / 10; the innovation 100 counts as 5
    assert after_one_sample(rivals.saturated_step, rivals.Saturated, 100.0, limit=5.0)[
        0
    ] == pytest.approx(3.0)


def test_huber_weight_grows_the_noise_beyond_c_sigmas():
    # sqrt(S) = sqrt(10), r = 10 / 3.1623 = 3.1623, R -> 4 * 3.1623 = 12.649, K = 6 / 18.649 =
    # 0.32173
    assert after_one_sample(rivals.huber_step, rivals.Huber, 10.0, corner=1.0)[0] == pytest.approx(
        3.2173, abs=1e-4
    )


def test_chi_square_gate_rejects_what_the_model_does_not_expect():
    # e^2 / S = 100 / 10 = 10 > 6.63: rejected, P = 4 + 2; 64 / 10 = 6.4: used
    assert after_one_sample(rivals.chi_square_step, rivals.ChiSquare, 10.0, limit=6.63) == (
        0.0,
        6.0,
    )
    assert after_one_sample(rivals.chi_square_step, rivals.ChiSquare, 8.0, limit=6.63)[
        0
    ] == pytest.approx(4.8)


def test_student_t_filter_equals_the_plain_one_for_many_degrees_of_freedom():
    nearly_normal = after_one_sample(rivals.student_t_step, rivals.StudentT, 10.0, freedom=1e9)[0]
    assert nearly_normal == pytest.approx(
        after_one_sample(kbf.step, kbf.Numbers, 10.0)[0], rel=1e-6
    )


def test_student_t_filter_hardly_moves_for_a_gross_outlier():
    assert abs(after_one_sample(rivals.student_t_step, rivals.StudentT, 1e4, freedom=4.0)[0]) < 1.0


def test_spike_shorter_than_the_hold_leaves_no_mark():
    z = np.zeros(100)
    z[50:59] = 3000.0
    assert np.all(persistent.run(z, **QUIET) == 0.0)


def test_step_is_believed_with_the_tenth_sample_at_its_full_height():
    z = np.where(np.arange(100) < 50, 0.0, 3000.0)
    x = persistent.run(z, **QUIET)
    assert x[58] == 0.0
    assert x[59] == pytest.approx(3000.0)


@pytest.mark.parametrize("name", list(SCENES))
@pytest.mark.slow
def test_own_filter_is_within_ten_per_cent_of_the_best_rival_in_every_scene(name):
    assert compare_scene(name, seeds=3).ratio <= 1.1


def test_own_filter_never_locks_out_and_is_no_later_than_twice_the_plain_filter():
    rng = np.random.default_rng(5)
    heights = np.exp(rng.uniform(np.log(300.0), np.log(1e4), 2000)) * rng.choice([-1.0, 1.0], 2000)
    own, plain = half_height_delays(OWN, heights), half_height_delays(RIVAL["kf"], heights)
    assert np.isfinite(own).all()
    for q in (50, 95):
        assert np.percentile(own, q) <= 2.0 * np.percentile(plain, q)


def test_published_modified_filter_locks_out_of_steps_above_its_gate():
    heights = np.array([1000.0, -3000.0, 8000.0])
    assert np.isinf(half_height_delays(RIVAL["modified_kbf"], heights)).all()


@pytest.mark.parametrize("amplitude", [350.0, 1000.0, 8000.0])
@pytest.mark.parametrize("period", [2, 7, 15, 19, 40])
def test_square_wave_of_any_period_is_not_rejected_for_good(amplitude, period):
    k = np.arange(4000)
    z = 5000.0 + amplitude * np.where(k % period < period // 2, 1.0, -1.0) * (k > 500)
    x = persistent.run(z, **QUIET)
    assert (
        np.ptp(x[2000:]) > 0.2 * amplitude
        or abs(x[2000:].mean() - z[2000:].mean()) < 0.2 * amplitude
    )


def test_scene_is_the_same_for_the_same_seed_and_its_noise_has_the_stated_size():
    truth, measured = scene("slow load", 4)
    assert np.array_equal(measured, scene("slow load", 4)[1])
    assert np.std(measured - truth) == pytest.approx(60.0, rel=0.03)


def test_spikes_are_at_most_eight_samples_long():
    s = spikes(20000, np.random.default_rng(1)) != 0.0
    edges = np.flatnonzero(np.diff(np.concatenate([[0], s.astype(int), [0]])))
    assert (edges[1::2] - edges[::2]).max() <= 8


def test_benchmark_writes_one_table(tmp_path):
    small = Filters(seeds=1, steps=30)
    answer = run(small, tmp_path)
    (table,) = small.tables(answer)
    assert len(table.rows) == 10 and all(len(r) == len(table.heads) == 9 for r in table.rows)
    written = json.loads((tmp_path / "filters.json").read_text())
    assert [s["scene"] for s in written["scenes"]] == list(SCENES)
    assert all(math.isfinite(s["ratio"]) for s in written["scenes"])


def test_two_spikes_one_after_the_other_are_not_added_up():
    z = np.zeros(200)
    z[50:58] = z[80:88] = 3000.0
    assert np.all(persistent.run(z, **QUIET) == 0.0)
