"""Probabilities of the diagnosis: they add up, follow the signs, and their numbers are found again
by the fit.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from testbed.benchmarks.diagnosis.calibration import fit, restated
from testbed.benchmarks.diagnosis.scores import closed_of_added
from testbed.diagnosis.leg.probabilities import (
    FORCE_LEFT,
    Calibration,
    calibration,
    distribution,
    quiet,
)
from testbed.diagnosis.leg.signs import SetSigns, Signs
from testbed.effects import by_name
from testbed.effects.terms import Signals
from testbed.recording.known import Known

NOTHING = SetSigns((), 0.0, 0.0, 0.0, 0.0, 0.0, 1.2, 1.2)


def found(gain: float, fall: float, behind: float = 1000.0, left: float = 1.2) -> Signs:
    """Signs of one good name and one rival."""
    before = replace(NOTHING, force=left / max(1.0 - fall, 1e-3))
    first = SetSigns(("a",), gain, gain, fall, gain, 0.0, left, 1.2)
    rival = replace(first, names=("b",), gain=gain - behind, more=gain - behind)
    gains = (((), 0.0), (("a",), gain), (("b",), gain - behind))
    return Signs(before, (first, rival), None, gains, 1.0, 1e-3, 1.0)


def test_probabilities_add_up_to_one() -> None:
    for s in (
        found(0.0, 0.0),
        found(30.0, 0.03, 5.0),
        found(5000.0, 0.8),
        found(100.0, 0.1, left=20.0),
    ):
        assert sum(distribution(s, calibration()).values()) == pytest.approx(1.0, abs=1e-12)


def test_without_gain_there_is_nothing_and_with_much_of_it_there_is_the_leader() -> None:
    assert max((d := distribution(found(1.0, 0.002, 1.0), calibration())), key=lambda n: d[n]) == ()
    assert distribution(found(5000.0, 0.8, 4000.0), calibration())[("a",)] > 0.9


def test_equal_rivals_share_equally_and_one_behind_by_slack_has_a_quarter_of_the_leader_at_power_two() -> (
    None
):
    rivals = dict(slack=10.0, share=0.1, power_1=2.0, power_2=2.0)
    never = {"one": -30.0}
    c = Calibration(never, never, never, {"one": 30.0}, never, rivals)
    even = distribution(found(100.0, 0.5, 0.0), c)
    assert even[("a",)] == pytest.approx(even[("b",)]) == pytest.approx(0.5, abs=1e-9)
    apart = distribution(found(100.0, 0.5, 20.0), c)  # slack 10 + 0.1 * 100
    assert apart[("b",)] / apart[("a",)] == pytest.approx(0.25)


def test_a_sure_yes_is_held_back_by_the_rate_of_ghosts_and_a_sure_no_by_the_rate_of_what_was_missed() -> (
    None
):
    rivals = dict(slack=10.0, share=0.1, power_1=40.0, power_2=2.0)
    never = {"one": -30.0}
    lapses = {"unnamed_missed": 0.04, "presence_ghost": 0.1, "presence_missed": 0.2}
    sure = distribution(
        found(1000.0, 0.5), Calibration(never, never, never, {"one": 30.0}, never, rivals, lapses)
    )
    assert sure[("unnamed",)] == pytest.approx(0.04) and sure[()] == pytest.approx(0.96 * 0.1)
    assert sure[("a",)] == pytest.approx(0.96 * 0.9, abs=1e-6)
    none = distribution(
        found(1000.0, 0.5), Calibration(never, never, never, never, never, rivals, lapses)
    )
    assert none[()] == pytest.approx(0.96 * 0.8)


def test_signs_are_read_as_they_were_written() -> None:
    s = found(30.0, 0.03)
    assert Signs.from_json(s.as_json()) == s


@pytest.mark.slow
def test_the_fit_learns_that_a_gain_of_forty_means_an_effect_only_every_other_time() -> None:
    trials = [
        {
            "seed": k,
            "visible": True,
            "kind": "single" if k % 2 else "clean",
            "truth": ["a"] if k % 2 else [],
            "signs": found(40.0, 0.05).as_json(),
        }
        for k in range(24)
    ]
    stated = restated(trials, fit(trials))
    nothing = [h["probability"] for t in stated for h in t["hypotheses"] if h["names"] == []]
    assert len(nothing) == 24 and nothing == pytest.approx([0.5] * 24, abs=0.08)


def test_share_of_what_was_added_counts_from_the_sound_twins_error() -> None:
    e = {"force_n": {"refit": 50.0, "after": 34.0, "floor": 10.0}}
    trial = {"oracle_closed_force": 0.5, "error": {"sine": e}, "sound": {"sine": {"force_n": 30.0}}}
    assert closed_of_added(trial) == pytest.approx((50.0**2 - 34.0**2) / (50.0**2 - 30.0**2))


def test_a_delay_that_is_a_first_order_lag_is_undone() -> None:
    rate, lag, w = 250.0, 0.02, 2.0 * np.pi * 1.5
    t = np.arange(2000) / rate
    true = 4e6 + 1e6 * np.sin(w * t)
    read = 4e6 + 1e6 / np.hypot(1.0, w * lag) * np.sin(w * t - np.arctan(w * lag))
    signals = Signals(t, rate, Known(), t, t, t, pressure_a_pa=read, pressure_b_pa=read)
    law = by_name("sensor.delay")
    again = law.correct(signals, law.complete({"delay": lag, "lag_share": 1.0})).pressure_a_pa
    assert again is not None
    inside = slice(100, -100)
    assert np.abs(again - true)[inside].max() < 5e3 < 0.05 * np.abs(read - true)[inside].max()


def test_what_trims_a_long_recording_is_no_rival_of_what_explains_a_short_one() -> None:
    plain = replace(NOTHING, names=("a",), gain=60.0, more=60.0, fall=0.57, carried=77.0)
    slight = replace(NOTHING, names=("b",), gain=73.0, more=73.0, fall=0.04, carried=130.0)
    gains = (((), 0.0), (("a",), 60.0), (("b",), 73.0))
    both = distribution(Signs(NOTHING, (plain, slight), None, gains, 1.0, 1e-3, 1.0), calibration())
    only = distribution(Signs(NOTHING, (plain,), None, gains[:2], 1.0, 1e-3, 1.0), calibration())
    assert both[()] == pytest.approx(only[()])  # how sure an effect is, the plainest name says
    assert both[("a",)] > 2.0 * both[("b",)]


def test_what_generic_terms_gain_counts_as_much_where_no_name_gains_as_beside_one_that_hardly_does() -> (
    None
):
    loud = replace(NOTHING, force=FORCE_LEFT[0])  # as much as a sound leg may leave

    def unnamed(signs: Signs, gain: float) -> float:
        told = replace(signs, generic_gain=gain, alone_gain=gain, generic_fall=0.1)
        return distribution(told, calibration())[("unnamed",)]

    hardly = replace(loud, names=("a",), gain=6.1, more=6.1, fall=0.013)
    gains = (((), 0.0), (("a",), 6.1))
    beside = Signs(loud, (hardly,), None, gains, 1.0, 1e-3, 1.0)
    no_name = Signs(loud, (), None, gains[:1], 1.0, 1e-3, 1.0)
    for gain in (1.0, 100.0, 1000.0):
        assert unnamed(no_name, gain) == pytest.approx(unnamed(beside, gain), abs=0.03)
    assert unnamed(no_name, 1000.0) > 0.8


def test_a_command_later_than_any_recorder_writes_it_speaks_for_what_no_name_covers() -> None:
    def unnamed(late: float) -> float:
        told = Signs(replace(NOTHING, late=late), (), None, (((), 0.0),), 1.0, 1e-3, 1.0)
        return distribution(told, calibration())[("unnamed",)]

    assert unnamed(1.0) == pytest.approx(unnamed(0.0), abs=0.02)  # recorders differ by a sample
    assert unnamed(3.0) > 0.85 and unnamed(-3.0) == unnamed(3.0)
    usual, dead_time, odds = 0.75, 5.0, 0.03  # samples, samples, of what is late and has no name
    weights = calibration().late
    assert weights["one"] == pytest.approx(np.log(odds * usual / dead_time), abs=1e-3)
    assert weights["square"] == pytest.approx(0.5 / usual**2 - 0.5 / dead_time**2, abs=1e-4)


def test_what_is_far_below_what_a_sound_leg_leaves_speaks_for_no_law_without_a_name() -> None:
    """Generic terms gain as much in both; in one there is nothing but the floor."""
    unnamed = {}
    for left in (1.0, 1.6, FORCE_LEFT[0]):
        still = replace(NOTHING, force=left, flow=1.0, pressed=1.0)
        some = Signs(still, (), None, (((), 0.0),), 200.0, 0.1, 1.0, alone_gain=200.0)
        unnamed[left] = distribution(some, calibration())[("unnamed",)]
        assert quiet(still) == pytest.approx(max(1.0 - (left - 1.0) / 1.5, 0.0))
    assert unnamed[1.0] < 0.2 < 0.4 < unnamed[FORCE_LEFT[0]]
    assert unnamed[1.0] < unnamed[1.6] < unnamed[FORCE_LEFT[0]]
