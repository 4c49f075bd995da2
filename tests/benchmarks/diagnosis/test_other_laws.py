"""Recordings of other worlds: what a law of friction, a sensor or a rope may and may not change."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from testbed.benchmarks.diagnosis.other_friction import LAWS, Pistons, elastic, pistons_of
from testbed.benchmarks.diagnosis.other_sensors import PRESSURES, SUPPLY, TENSIONS, flicker
from testbed.benchmarks.diagnosis.other_worlds import (
    BESIDE,
    FAMILIES,
    FRICTION,
    SAG,
    SENSORS,
    OtherWorld,
)
from testbed.benchmarks.diagnosis.robot_recordings import Run
from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.machine.build import build_machine
from testbed.machine.names import AXES, ROTATION
from testbed.robot.robot import Robot

RATE_HZ, SECONDS = 500.0, 6.0
SWAY_M, PERIOD_S = 0.03, 3.0
SURVEYED = {
    "rope_directions_in_world": {"left": [0.6, 0.0, 0.8], "right": [0.6, 0.0, 0.8]},
    "rope_lengths_m": {"left": 30.0, "right": 30.0},
    "payload_kg": 0.0,
}


TAKES_NOISE_AWAY = ("uneven_clock", "other_filter")
"""What these change most is noise, and all of it is gone at their usual size."""


@pytest.fixture(scope="module")
def run() -> Run:
    """A machine whose pistons go out and in together, as its sensors would read it."""
    rng = np.random.default_rng(3)
    t = np.arange(1, int(RATE_HZ * SECONDS) + 1) / RATE_HZ
    sway = SWAY_M * np.sin(2.0 * np.pi * t / PERIOD_S)
    data: dict[str, Array] = {"t": t, SUPPLY: 9e6 + 1e4 * rng.standard_normal(len(t))}
    for k, axis in enumerate(AXES):
        turns = k in ROTATION
        at = (0.0 if turns else 0.2) + (4.0 if turns else 1.0) * sway
        data[f"position_{axis}"] = np.round(at / 1e-4) * 1e-4
        data[f"valve_{axis}"] = 0.2 * np.cos(2.0 * np.pi * t / PERIOD_S)
    for name in PRESSURES:
        data[name] = 3e6 + 1e6 * sway / SWAY_M + 2e3 * rng.standard_normal(len(t))
    for name in TENSIONS:
        data[name] = 14e3 + 400.0 * sway / SWAY_M + 60.0 * rng.standard_normal(len(t))
    data |= {f"specific_force_{k}": rng.standard_normal(len(t)) for k in "xyz"}
    data |= {f"attitude_{k}": 1e-3 * rng.standard_normal(len(t)) for k in ("roll", "pitch")}
    return Run(data, {}, SURVEYED)


@pytest.mark.parametrize("family", FAMILIES)
def test_a_law_of_no_size_leaves_a_recording_bit_by_bit(family: str, run: Run) -> None:
    same = OtherWorld((family,), 0.0).recorded(run, 5)
    assert same.surveyed == run.surveyed
    assert all(np.array_equal(same.data[name], run.data[name]) for name in run.data)


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.slow
def test_each_law_changes_something_and_the_more_the_larger_it_is(family: str, run: Run) -> None:
    small, one, three = (_change(run, OtherWorld((family,), size)) for size in (0.01, 1.0, 3.0))
    moved = [name for name in one if np.any(one[name])]
    assert moved
    grows = 0.9 if family in TAKES_NOISE_AWAY else 1.5
    for name in moved:
        least, usual, most = (float(np.abs(made[name]).mean()) for made in (small, one, three))
        assert least < 0.2 * usual
        assert grows * usual < most < 5.0 * usual


def _change(run: Run, world: OtherWorld) -> dict[str, Array]:
    """Column or rope -> by what it is another one in this world."""
    made = world.recorded(run, 5)
    out = {name: made.data[name] - run.data[name] for name in run.data}
    ropes, there = (r.surveyed["rope_directions_in_world"] for r in (made, run))
    return out | {side: np.subtract(ropes[side], there[side]) for side in ropes}


def test_encoders_go_on_counting(run: Run) -> None:
    change = _change(run, OtherWorld(("encoders",), 3.0))[f"position_{AXES[1]}"]
    counts = change / build_machine().sensor.encoder_linear_m
    assert np.allclose(counts, np.round(counts), atol=1e-6)
    assert 1.0 <= np.abs(counts).max() <= 5.0


@pytest.mark.parametrize("family", FRICTION)
def test_friction_of_another_law_is_a_few_per_cent_of_coulomb_friction(
    family: str, run: Run
) -> None:
    change = _change(run, OtherWorld((family,)))
    for axis, one in build_machine().axes.items():
        area_a, area_b = one.cylinder.areas_m2
        force = area_a * change[f"pressure_a_{axis}"] - area_b * change[f"pressure_b_{axis}"]
        largest = 2.0 * 0.08 * one.cylinder.coulomb_out_n
        assert 0.0 < np.abs(force).max() <= largest


@pytest.mark.parametrize("family", ["bristles", "stribeck", "breakaway"])
def test_friction_opposes_a_piston_that_has_slid_some_millimetres(family: str) -> None:
    pistons = _to_and_fro()
    force = LAWS[family](pistons, np.random.default_rng(2))
    way = np.sign(pistons.speed_m_s)
    turned = np.abs(np.diff(way, axis=0, prepend=way[:1])) > 0
    slid = np.cumsum(np.abs(pistons.speed_m_s) * pistons.step_s, axis=0)
    since = slid - np.maximum.accumulate(np.where(turned, slid, 0.0), axis=0)
    long_since = since > 7e-3
    assert long_since.any()
    assert (force * way)[long_since].min() >= 0.0


def _to_and_fro() -> Pistons:
    t = np.arange(0.0, 12.0, 0.01)
    way = np.repeat(0.02 * np.sin(2.0 * np.pi * t / 4.0)[:, None], 12, axis=1)
    return Pistons(t, way, np.gradient(way, 0.01, axis=0), np.full(12, 30.0))


def test_a_resting_piston_keeps_the_friction_that_it_stopped_with() -> None:
    t = np.arange(0.0, 10.0, 0.01)
    way = np.repeat(0.02 * np.minimum(t / 4.0, 1.0)[:, None], 12, axis=1)
    rests = Pistons(t, way, np.gradient(way, 0.01, axis=0), np.full(12, 30.0))
    force = LAWS["bristles"](rests, np.random.default_rng(2))
    assert np.allclose(force[410:], 1.0)


def test_an_elastic_element_slips_and_turns_round_over_twice_its_reach() -> None:
    way = np.array([0.0, 1.0, 3.0, 2.0, 1.0, -5.0])[:, None]
    assert elastic(way, 1.0)[:, 0].tolist() == [0.0, 1.0, 1.0, 0.0, -1.0, -1.0]


def test_pistons_are_as_encoders_and_linkages_have_them(run: Run) -> None:
    robot = _robot()
    pistons = pistons_of(run.data, robot, np.random.default_rng(1))
    vertical = AXES.index("fl_vertical")
    expected = 0.2 + SWAY_M * np.sin(2.0 * np.pi * pistons.time_s / PERIOD_S)
    assert np.abs(pistons.extension_m[:, vertical] - expected)[10:-10].max() < 2e-4


def _robot() -> Robot:
    from pathlib import Path

    from testbed.workflows.estimate import survey_of

    return survey_of(SURVEYED, Path("run")).robot(build_machine())


def test_a_loop_reads_less_on_the_way_up_within_a_quarter_of_a_per_cent(run: Run) -> None:
    change = _change(run, OtherWorld(("hysteresis",)))
    rises = np.cos(2.0 * np.pi * run.data["t"] / PERIOD_S) > 0.3
    falls = np.cos(2.0 * np.pi * run.data["t"] / PERIOD_S) < -0.3
    later = run.data["t"] > PERIOD_S / 4.0
    for name in PRESSURES:
        gap = change[name][falls & later].mean() - change[name][rises & later].mean()
        assert 0.5 * 1e-3 * 1e7 < gap < 1.01 * 2.5e-3 * 1e7


def test_a_rope_that_sags_leads_below_its_anchor(run: Run) -> None:
    made = OtherWorld((SAG,)).recorded(run, 5).surveyed["rope_directions_in_world"]
    for side in ("left", "right"):
        anchor = np.array(made[side]) / np.linalg.norm(made[side])
        led = np.array(SURVEYED["rope_directions_in_world"][side])  # type: ignore[index]
        above = np.arcsin(anchor[2]) - np.arcsin(led[2])
        assert 0.4 * 9.81 * 0.6 * 30.0 / 28e3 * 0.99 < above < 0.9 * 9.81 * 0.6 * 30.0 / 28e3 * 1.01


def test_recordings_of_one_machine_share_its_laws_and_not_its_noise(run: Run) -> None:
    def read(family: str, recording: int) -> Array:
        return OtherWorld((family,)).recorded(run, 5, recording).data[PRESSURES[0]]

    assert np.array_equal(read("stribeck", 0), read("stribeck", 1))
    assert not np.array_equal(read("coloured_noise", 0), read("coloured_noise", 1))


def test_flicker_is_louder_the_slower_it_is() -> None:
    noise = flicker(20_000, 1000.0, 1.0, np.random.default_rng(1))
    power = np.abs(np.fft.rfft(noise)) ** 2
    assert noise.std() == pytest.approx(1.0)
    assert power[20:200].mean() > 20.0 * power[2000:10_000].mean()


def test_worlds_differ_and_each_has_friction_and_two_kinds_of_sensors() -> None:
    world = OtherWorld()
    drawn = {world.of_machine(seed) for seed in range(40)}
    assert len(drawn) > 20
    for laws in drawn:
        assert 1 <= len({*laws} & {*FRICTION}) <= 2
        assert len({*laws} & {*SENSORS}) == 2
    assert {law for laws in drawn for law in laws} == {*FRICTION, *SENSORS, *BESIDE}


def test_a_family_that_there_is_not_is_refused() -> None:
    with pytest.raises(InputError, match="bristels"):
        OtherWorld(("bristels",))


def answered(**other: Any) -> dict[str, Any]:
    """What the blind test keeps of a run."""
    return {"kind": "clean", "verdict": "none", "names": [], "visible": [], **other}


def test_by_law_counts_sound_machines_and_names_apart() -> None:
    from testbed.benchmarks.diagnosis.robot_other_laws import _said

    alone = answered(verdict="effect")
    runs = [
        answered(alone=alone),
        answered(alone=answered(), verdict="effect"),
        answered(kind="single", truth=["a"], visible=["a"], names=["a"], verdict="effect"),
        answered(kind="single", truth=["a"], visible=["a"], names=["b"], verdict="effect"),
        answered(kind="single", truth=["a"], visible=[], names=[]),
    ]
    said = _said(runs)
    assert (said["sound"]["share"], said["sound"]["of"]) == (0.5, 2)
    assert (said["sound_alone"]["share"], said["sound_alone"]["of"]) == (0.5, 2)
    assert (said["named"]["share"], said["named"]["of"]) == (0.5, 2)
