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
from testbed.diagnosis.robot.bin_edge_noise import flicker_pa, of_shared_edges
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
    assert quiet[0] == 0.0
    assert 3.0e4 < quiet[1] < 1.0e5  # within what a workshop's machines have


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
