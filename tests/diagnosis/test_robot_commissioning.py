"""The regression by which the robot comes to know itself, on evidence whose answer is known."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from testbed.diagnosis.robot import commissioning
from testbed.diagnosis.robot.commissioning import Evidence, Posterior
from testbed.diagnosis.robot.forces import Tolerated
from testbed.effects.signature import Change, RobotSeen
from testbed.machine.build import build_machine
from testbed.machine.names import AXES

MASS, ZERO, NONE = "total", "zero", ""


def _number(name: str, sd: float, mean: float = 0.0, drawn: float = 0.0) -> Tolerated:
    return Tolerated(Change(), sd, name, mean, drawn)


def _evidence(truth: dict[str, float], columns: np.ndarray, sd: float, *names: str) -> Evidence:
    """Of rows = columns @ truth, seen with noise of standard deviation `sd`."""
    numbers = tuple(_number(name, 2.0) for name in names)
    wide = columns * 2.0 / sd
    rows = columns @ np.array([truth[name] for name in names]) / sd
    return Evidence(numbers, wide.T @ wide, wide.T @ rows)


def test_numbers_that_rows_tell_apart_are_found() -> None:
    rng = np.random.default_rng(3)
    truth = {MASS: 1.5, ZERO: -0.7}
    found = Posterior.of([_evidence(truth, rng.normal(size=(500, 2)), 0.01, MASS, ZERO)])
    for name, value in truth.items():
        number = found.of_sum({name: 1.0}, "N", drawn=10.0)
        assert number.value == pytest.approx(10.0 + value, abs=3.0 * number.sd)
        assert number.sd < 0.01 and number.shown


def test_a_sum_is_surer_than_its_parts_where_only_it_is_seen() -> None:
    truth = {MASS: 1.5, ZERO: -0.7}
    found = Posterior.of([_evidence(truth, np.ones((100, 2)), 0.01, MASS, ZERO)])
    part, whole = found.of_sum({MASS: 1.0}, "N"), found.of_sum({MASS: 1.0, ZERO: 1.0}, "N")
    assert whole.value == pytest.approx(0.8, abs=0.01)
    assert part.sd == pytest.approx(2.0 / math.sqrt(2.0), rel=0.01)
    assert whole.sd < 0.01 * part.sd
    assert part.before == (0.0, 2.0)


def test_two_recordings_say_more_than_one_and_their_own_disturbances_stay_apart() -> None:
    rng = np.random.default_rng(4)
    first = _evidence({MASS: 1.0, NONE: 2.0}, rng.normal(size=(40, 2)), 0.5, MASS, NONE)
    second = _evidence({MASS: 1.0, NONE: -2.0}, rng.normal(size=(40, 2)), 0.5, MASS, NONE)
    alone = Posterior.of([first]).of_sum({MASS: 1.0}, "kg")
    both = Posterior.of([first, second]).of_sum({MASS: 1.0}, "kg")
    assert both.sd < 0.8 * alone.sd
    assert both.value == pytest.approx(1.0, abs=2.0 * both.sd)


def test_what_no_recording_shows_keeps_its_prior() -> None:
    found = Posterior.of([_evidence({MASS: 1.0}, np.zeros((5, 1)), 0.5, MASS)])
    number = found.of_sum({MASS: 3.0}, "kg")
    assert number.value == 0.0 and number.before == (0.0, 6.0)
    assert not number.shown


AREA_A_M2, AREA_B_M2, FOOT = 3e-3, 2e-3, AXES.index("rl_vertical")


def measured(pressure_a: np.ndarray, pressure_b: np.ndarray, direction: float = 0.0) -> Any:
    """What a robot reads whose every cylinder has these pressures (n,), Pa."""
    bins = len(pressure_a)
    given = SimpleNamespace(
        bins=bins,
        direction=np.full((bins, len(AXES)), direction),
        area_a_m2=np.full(len(AXES), AREA_A_M2),
        area_b_m2=np.full(len(AXES), AREA_B_M2),
        oil_by_reading=np.zeros((bins, len(AXES), 2)),
        pressures_pa=lambda _: np.column_stack([pressure_a, pressure_b]),
    )
    given.reads = lambda *of: RobotSeen.reads(given, *of)  # type: ignore[arg-type]
    return given


def test_a_foot_that_takes_over_a_load_reads_too_little_of_it_by_both_loops() -> None:
    loaded = np.where(np.arange(20) < 10, 0.5e6, 3.0e6)
    machine = build_machine()
    behind = list(commissioning._behind(measured(loaded, 3.5e6 - loaded), machine))
    own = [one for one in behind if "rl_vertical" in one.name]
    assert [one.name[-1] for one in own] == ["a", "b"]
    force_n = sum(one.mean * one.change.force[FOOT] for one in own)
    loop_pa = machine.axes["rl_vertical"].sensor.loop_mean_pa
    assert np.all(force_n[:10] == 0.0)  # nothing has moved yet
    assert force_n[10:] == pytest.approx(-loop_pa * (AREA_A_M2 + AREA_B_M2))


def test_the_mean_loop_is_what_a_machine_draws() -> None:
    sensor = build_machine().axes["fl_vertical"].sensor
    widths = np.linspace(0.2, 1.0, 10_001) * sensor.pressure_hysteresis_pa
    assert sensor.loop_mean_pa == pytest.approx(widths.mean())
    assert sensor.loop_sd_pa == pytest.approx(widths.std(), rel=1e-3)


@pytest.mark.parametrize(
    ("direction", "expected_pa"), [(-1.0, commissioning.GROWING_PA), (1.0, 0.0)]
)
def test_a_chamber_that_is_sucked_empty_pulls_less_than_half_a_void_says(
    direction: float, expected_pa: float
) -> None:
    ended = np.zeros((4, len(AXES), 2))
    ended[2:, FOOT, 1] = 1.0  # chamber B, which grows while the piston goes in
    full = np.full(4, 2.0e6)
    every = list(commissioning._empty(measured(full, 0.0 * full, direction), ended))
    force_n = sum(one.mean * one.change.force[FOOT] for one in every if FOOT in one.change.force)
    assert force_n == pytest.approx([0.0, 0.0, *[expected_pa * AREA_B_M2] * 2])
    wide_n = math.sqrt(
        sum(
            float((one.sd * one.change.force[FOOT][3]) ** 2)
            for one in every
            if FOOT in one.change.force
        )
    )
    assert AREA_B_M2 * 0.2e5 < wide_n < AREA_B_M2 * 0.4e5
