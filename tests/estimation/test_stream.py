"""The robot's chain sample by sample: the recording's numbers where all come, close to them where
some do not.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from testbed.estimation.live.chain import EstimatorChain, replay_chain, rows_of
from testbed.estimation.live.joined import replay_rows
from testbed.estimation.live.stream import Stream
from testbed.recording.robot import read_robot
from testbed.workflows.estimate import robot_belief

RUN = read_robot(Path(__file__).parents[1] / "data" / "first_version" / "robot")
BELIEF = robot_belief(RUN, None)
SHORT = rows_of(RUN.data, BELIEF)
ROWS = np.concatenate([SHORT, SHORT[::-1]] * 5)
"""Sixty samples of a run to and fro, 0.6 s."""
ROWS["t"] = 1e-3 * np.arange(1, len(ROWS) + 1)


def _over_all() -> np.ndarray:
    rows, chain = ROWS.copy(), EstimatorChain(BELIEF)
    replay_chain(rows, chain.belief, chain.state)
    return rows


WHOLE = _over_all()


def _own(kept: np.ndarray, rows: np.ndarray = ROWS) -> np.ndarray:
    stream = Stream(BELIEF)
    return np.array([stream.update(rows[k : k + 1])["estimate"]["own"][0] for k in kept])


def test_every_sample_in_time_gives_the_numbers_of_the_recording() -> None:
    kept = np.arange(len(ROWS))
    np.testing.assert_array_equal(_own(kept), WHOLE["estimate"]["own"])


def test_samples_that_come_late_or_twice_change_nothing() -> None:
    stream = Stream(BELIEF)
    for k in range(200):
        told = stream.update(ROWS[k : k + 1])
        if k % 7 == 3:
            wrong = ROWS[k - 2 : k - 1].copy()
            wrong["pressure_a"] = 0.0
            assert stream.update(wrong).tobytes() == told.tobytes()
            wrong["t"] = ROWS["t"][k]
            assert stream.update(wrong).tobytes() == told.tobytes()
    np.testing.assert_array_equal(told["estimate"]["own"][0], WHOLE["estimate"]["own"][199])


def test_a_third_of_the_samples_missing_costs_little() -> None:
    kept = np.flatnonzero(np.random.default_rng(3).random(len(ROWS)) > 0.3)
    error = _own(kept) - WHOLE["estimate"]["own"][kept]
    assert np.sqrt(np.mean(error**2)) < 0.02 * 9810.0


def test_a_missing_number_stays_what_it_was_and_its_foot_is_unknown_after_a_tenth_of_a_second() -> (
    None
):
    rows = ROWS[:400].copy()
    rows["pressure_a"][200:, 2] = np.nan  # fl_vertical
    stream = Stream(BELIEF)
    for k in range(290):
        stream.update(rows[k : k + 1])
    assert stream.known.all()
    for k in range(290, 400):
        told = stream.update(rows[k : k + 1])
    assert stream.known.tolist() == [False, True, True, True]
    assert np.isfinite(told["estimate"]["own"]).all()


def test_after_a_long_gap_it_starts_anew() -> None:
    stream, late = Stream(BELIEF), ROWS[300:301].copy()
    for k in range(300):
        stream.update(ROWS[k : k + 1])
    late["t"] += 1.0
    fresh = Stream(BELIEF).update(late)
    np.testing.assert_array_equal(stream.update(late)["estimate"]["own"], fresh["estimate"]["own"])


RAGGED = {name: np.tile(np.append(v, v[::-1]), 5) for name, v in RUN.data.items()}
"""The same 0.6 s as columns, with jitter, gaps and numbers that are missing."""
_rng = np.random.default_rng(4)
RAGGED["t"] = 1e-3 * np.arange(1, len(ROWS) + 1) + _rng.uniform(-4e-4, 4e-4, len(ROWS))
RAGGED["t"][200:] += 0.0137
RAGGED["t"][400:] += 0.6
RAGGED["pressure_a_fl_vertical"] = np.where(
    _rng.random(len(ROWS)) < 0.2, np.nan, RAGGED["pressure_a_fl_vertical"]
)
_kept = _rng.random(len(ROWS)) > 0.2
RAGGED = {name: values[_kept] for name, values in RAGGED.items()}


def _told(rows: np.ndarray) -> np.ndarray:
    parts = (rows["estimate"]["own"], rows["estimate_own"]["low"], rows["estimate_own"]["high"])
    return np.column_stack([*parts, rows["contact"]])


def test_a_ragged_recording_gives_the_numbers_of_its_samples_one_by_one() -> None:
    stream, rows = Stream(BELIEF), rows_of(RAGGED, BELIEF)
    one_by_one = [_told(stream.update(rows[k : k + 1]))[0] for k in range(len(rows))]
    np.testing.assert_array_equal(_told(replay_rows(RAGGED, BELIEF)), one_by_one)


def test_a_sample_changes_nothing_that_was_said_before_it() -> None:
    """Later samples are others, come at other times or not at all."""
    whole = _told(replay_rows(RAGGED, BELIEF))
    for ends in (60, 150, 161, 162, 163, 319, 320, 321, 400):
        cut = {name: values[:ends] for name, values in RAGGED.items()}
        np.testing.assert_array_equal(_told(replay_rows(cut, BELIEF)), whole[:ends])
        later = np.arange(len(whole)) >= ends
        other = RAGGED | {
            "t": RAGGED["t"] + 3e-4 * later,
            "pressure_b_fr_vertical": RAGGED["pressure_b_fr_vertical"] + 1e6 * later,
        }
        np.testing.assert_array_equal(_told(replay_rows(other, BELIEF))[:ends], whole[:ends])


def test_samples_out_of_their_order_change_nothing_in_a_recording_either() -> None:
    order = np.insert(np.arange(len(RAGGED["t"])), 100, [40, 99])
    twice = {name: values[order] for name, values in RAGGED.items()}
    told = _told(replay_rows(twice, BELIEF))
    np.testing.assert_array_equal(told[100:102], told[[99, 99]])
    np.testing.assert_array_equal(
        np.delete(told, [100, 101], 0), _told(replay_rows(RAGGED, BELIEF))
    )


def test_another_detector_judges_the_stream() -> None:
    """Without load-holding valves friction at rest is anywhere in its set: the estimate that the
    threshold is held against takes a quarter of a second.
    """
    stream = Stream(BELIEF, "threshold_own")
    lifted = ROWS[:400].copy()
    lifted["pressure_a"][100:, 2] = 0.0  # fl_vertical
    told = [stream.update(lifted[k : k + 1])["contact"][0] for k in range(400)]
    assert told[99].tolist() == [1.0, 1.0, 1.0, 1.0]
    assert told[399][0] == 0.0
