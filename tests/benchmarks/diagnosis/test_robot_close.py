"""Runs that are drawn to be close: what is made small, and what a sound recording foretells."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from testbed.benchmarks.diagnosis.robot_close import (
    LATER,
    SMALLEST,
    CloseCases,
    Forecast,
    small_effect,
)
from testbed.benchmarks.diagnosis.robot_draws import (
    AGAIN,
    BEFORE,
    drawn,
    effect_drawn,
    hidden_sizes,
    strokes_m,
)
from testbed.diagnosis.robot.evidence import RawGroup
from testbed.diagnosis.robot.hypotheses import Ledger
from testbed.effects import by_name
from tests.diagnosis.test_robot_nonlinear_fit import AXIS, PLACE, asked
from tests.diagnosis.test_robot_signatures import balanced


def test_what_is_made_small_are_parameters_of_the_blind_tests_effects() -> None:
    sizes = hidden_sizes()
    table = {**sizes["named"], **sizes["unnamed"]}
    for name, parameters in sizes["small"].items():
        assert set(parameters) <= set(table[name])


def test_small_effects_lie_between_nothing_and_their_size_in_the_blind_test() -> None:
    sizes, rng = hidden_sizes(), np.random.default_rng(3)
    table = {**sizes["named"], **sizes["unnamed"]}
    seen = set()
    for _ in range(300):
        hidden = small_effect(rng, "walk")
        name = hidden["effect"]
        seen.add(name)
        by_name(name).complete(hidden["parameters"])
        for parameter, without in sizes["small"][name].items():
            low, high = sorted(table[name][parameter])
            value = hidden["parameters"][parameter]
            if math.isinf(without):
                assert low <= value <= high / SMALLEST
            else:
                most = max(abs(low - without), abs(high - without))
                assert abs(value - without) <= most
    assert "drill.thrust" not in seen and len(seen) > 20


def test_drawn_cushions_begin_inside_their_cylinder_and_leave_a_third_of_it_free() -> None:
    rng, seen = np.random.default_rng(5), set()
    for _ in range(200):
        name = "force.cushion"
        drawn_one = effect_drawn(rng, name, hidden_sizes()["named"][name])
        seen.add(drawn_one["at"])
        start_m, stroke_m = drawn_one["parameters"]["start"], strokes_m()[drawn_one["at"]]
        assert 0.4 * stroke_m < start_m < 0.65 * stroke_m
    assert seen == set(strokes_m())


def test_only_machines_of_sound_runs_serve_and_their_noise_is_another() -> None:
    cases = CloseCases(runs=50, first_seed=100).cases()
    assert len(cases) == 20 and all(drawn(seed).kind == "clean" for seed in cases.values())
    assert LATER not in (0, AGAIN, BEFORE)


@pytest.mark.parametrize("gain", [0.0, 0.1])
def test_what_an_effect_adds_to_a_sound_recording_is_predicted(gain: float) -> None:
    seen = balanced().seen
    balances: Any = asked(seen, np.zeros(seen.bins), 30.0, "sensor.gain_a", "sensor.gain_b")
    raw: RawGroup = balances.raw["forces"]
    name = f"sensor.gain_a@{PLACE}"
    predicted = Forecast(Ledger(balances)).ranked(
        {"effect": "sensor.gain_a", "at": PLACE, "parameters": {"gain_error": gain}}
    )
    missing = gain * by_name("sensor.gain_a").signature(seen, PLACE)["gain_error"].force[AXIS]
    there = asked(seen, missing, 30.0, "sensor.gain_a", "sensor.gain_b")
    evidence = Ledger(there).hypothesis((name,)).log_factor
    assert raw.missing.shape == missing.shape
    if gain == 0.0:
        assert predicted == () and evidence < 0.0
        return
    said = dict(predicted)
    assert max(said, key=said.__getitem__) == (name,) and evidence > 20.0
    assert sum(said.values()) == pytest.approx(1.0)
