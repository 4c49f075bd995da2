"""Recordings whose samples come rarely: what noise and ripple leave at the bins' edges is known,
and a sound machine stays sound.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shipped import MACHINE

from testbed.benchmarks.diagnosis.robot_draws import drawn
from testbed.benchmarks.diagnosis.robot_recordings import simulated
from testbed.benchmarks.diagnosis.robot_trials import balances_in
from testbed.diagnosis.robot.bin_edge_noise import flicker_pa, of_shared_edges, told_share
from testbed.diagnosis.robot.bins import Frame
from testbed.diagnosis.robot.diagnose import judged
from testbed.diagnosis.robot.findings import as_json

NOISE_PA = 4.0e3
SOUND_SEED = 8747
"""Of the blind test's runs: a sound machine that drills."""


def frame_of(rate_hz: float) -> Frame:
    return Frame.of(np.arange(0.0, 60.0, 1.0 / rate_hz))


@pytest.mark.parametrize("rate_hz", [1000.0, 200.0, 100.0])
def test_noise_at_edges_is_that_of_a_mean_of_its_samples(rate_hz: float) -> None:
    frame = frame_of(rate_hz)
    noise = NOISE_PA * np.random.default_rng(3).standard_normal(frame.samples)
    at_edges = float(np.std(frame.at_edges(noise)))
    assert frame.noise_at_edges(noise) == pytest.approx(at_edges, rel=0.12)


def test_what_changes_slowly_is_no_noise() -> None:
    frame = frame_of(1000.0)
    slow = 1.0e6 * np.sin(2.0 * np.pi * np.arange(frame.samples) / frame.samples)
    assert frame.noise_at_edges(slow) < 1e-4 * float(np.std(slow))


def test_ripple_counts_only_where_samples_are_too_rare_for_it() -> None:
    axis = MACHINE.axes["fl_vertical"]
    quiet = [
        flicker_pa(axis, np.zeros(frame.samples), frame) for frame in map(frame_of, (1e3, 2e2))
    ]
    assert quiet[0].max() == 0.0
    assert (
        quiet[1].min() > 3.0e4 and quiet[1].max() < 1.0e5
    )  # within what a workshop's machines have


@pytest.mark.parametrize("ripple_hz", [5.0, 15.0, 27.0])
def test_ripple_that_beats_with_the_bins_is_noise_at_their_edges(ripple_hz: float) -> None:
    frame, axis = frame_of(1000.0), MACHINE.axes["fl_vertical"]
    ripple = NOISE_PA * np.cos(2.0 * np.pi * ripple_hz * np.arange(frame.samples) * 1e-3 + 0.4)
    left = float(np.std(frame.at_edges(ripple)))
    assert frame.noise_at_edges(ripple) < 0.1 * left
    assert left < np.median(flicker_pa(axis, ripple, frame)) < 3.0 * left


def test_a_pressure_that_rises_now_and_then_flickers_no_more_for_that() -> None:
    frame, axis = frame_of(1000.0), MACHINE.axes["fl_vertical"]
    noise = NOISE_PA * np.random.default_rng(4).standard_normal(frame.samples)
    steps = 1.0e6 * (np.arange(frame.samples) // 10_000)
    quiet, rising = (flicker_pa(axis, one, frame) for one in (noise, noise + steps))
    assert rising.max() < 1.5 * quiet.max()


def test_a_change_as_small_as_its_noise_is_none_and_a_large_one_is_whole() -> None:
    edges = np.array([0.0, 1.0, 0.0, 10.0, 10.5, 0.0])
    assert told_share(edges, np.ones(5)).tolist() == [0.0, 0.0, 1.0, 0.0, 1.0]
    assert told_share(edges, np.zeros(5)).tolist() == [1.0] * 5


def test_air_is_hardly_denied_by_pressures_that_only_flicker() -> None:
    """What a chamber at rest seems to take up is noise, in its balance and in every column."""
    sd = np.full(400, 1.0e3)
    edges = 3.0e5 + 1.0e3 * np.random.default_rng(8).standard_normal(401)
    changed, told = np.diff(edges), told_share(edges, sd)
    assert np.mean(told == 0.0) > 0.6
    assert np.mean((told * changed) ** 2) < 0.5 * np.mean(changed**2)


def test_neighbouring_bins_share_an_edge() -> None:
    errors = np.random.default_rng(5).standard_normal((20_000, 5))
    measured = np.cov(np.diff(errors, axis=1).T)
    np.testing.assert_allclose(of_shared_edges(np.ones(4)), measured, atol=0.06)


@pytest.mark.slow
@pytest.mark.parametrize("every", [1, 5, 10])
def test_a_sound_machine_is_left_alone_however_rarely_it_is_sampled(every: int) -> None:
    """Ripple that is sampled 200 times a second looked like hoses that fill slowly."""
    run = simulated(drawn(SOUND_SEED).scenario())
    rare = replace(run, data={name: values[::every] for name, values in run.data.items()})
    found = judged("rare", balances_in(rare))
    sound = next(h for h in as_json(found)["hypotheses"] if not h["names"])
    assert sound["probability"] > 0.9
