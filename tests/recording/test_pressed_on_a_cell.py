"""A leg that is pressed on a coarse load cell: what stands still there because it is clipped or
frozen, and what stands still by right.
"""

from __future__ import annotations

import numpy as np
import pytest

from testbed.recording.checker.command import frozen_command
from testbed.recording.checker.raw import REFERENCE, Raw
from testbed.recording.checker.sensors import check_clipped

TIME_S = np.arange(10_000) / 1000.0
STEP_N = 10.0
PRESSES = np.sin(1.3 * TIME_S) + 0.3 * np.sin(3.1 * TIME_S)


def pressed(command: np.ndarray | None = None, most_n: float = np.inf, way_m: float = 5e-4) -> Raw:
    """A leg whose load rises and falls between 0 and 20 kN; the piston yields by `way_m`."""
    rng = np.random.default_rng(1)
    load_n = 1e4 * (1.0 + 0.75 * PRESSES)
    read_n = np.minimum(
        np.round((load_n + rng.standard_normal(load_n.size)) / STEP_N) * STEP_N, most_n
    )
    series = {
        "position": 0.2 + way_m * PRESSES,
        "pressure_a": 3e6 + 250.0 * load_n + 2e3 * rng.standard_normal(load_n.size),
        "valve_command": 0.1 * np.gradient(PRESSES, TIME_S) if command is None else command,
        REFERENCE: read_n,
    }
    return Raw("leg", "vertical-leg", None, TIME_S, series, {}, {})


def held_from(first: int, last: int) -> np.ndarray:
    command = 0.1 * np.gradient(PRESSES, TIME_S)
    command[first:last] = command[first]
    return command


def test_a_sound_coarse_load_cell_is_neither_clipped_nor_its_command_frozen() -> None:
    assert [*check_clipped(pressed()), *frozen_command(pressed())] == []


@pytest.mark.parametrize("share", [0.7, 0.8, 0.93])
def test_a_coarse_load_cell_that_is_clipped_for_a_while_is_found(share: float) -> None:
    most_n = float(np.quantile(pressed().series[REFERENCE], share))
    (found,) = check_clipped(pressed(most_n=most_n))
    assert (found.channel, found.what) == (REFERENCE, "is clipped where no range is declared")


def test_a_load_that_stays_at_its_highest_by_right_is_not_clipped() -> None:
    raw = pressed()
    load_n = np.minimum(1e4 * (1.0 + 0.75 * PRESSES), 1.5e4)
    series = raw.series | {
        REFERENCE: np.round(load_n / STEP_N) * STEP_N,
        "pressure_a": 3e6 + 250.0 * load_n + 2e3 * np.random.default_rng(2).standard_normal(10_000),
    }
    assert list(check_clipped(Raw(**{**vars(raw), "series": series}))) == []


def test_a_command_that_is_frozen_while_the_load_rises_and_falls_is_found() -> None:
    turn = int(np.argmax(PRESSES[:3000]))
    (found,) = frozen_command(pressed(held_from(turn - 600, turn + 600)))
    assert found.what == "stays at one value while the piston presses and lets go"
    assert found.from_s == pytest.approx(TIME_S[turn - 600])


def test_a_command_that_is_held_while_the_load_rises_is_right() -> None:
    assert list(frozen_command(pressed(held_from(200, 700)))) == []


def test_a_piston_that_goes_against_an_open_valve_is_found() -> None:
    rising = slice(0, 900)
    command = held_from(0, 0)
    command[rising] = -0.1
    (found,) = frozen_command(pressed(command, way_m=0.02))
    assert found.what == "stays at one value while the piston goes against it"


ANSWERS_S = 0.03
"""How long a heavy piston runs on: its valve is thrown over while it goes at 0.3 m/s."""


def thrown_over(command: np.ndarray) -> Raw:
    """A piston that goes in and out at 0.3 m/s as its valve is thrown over each second."""
    speed_m_s = 0.3 * np.where(TIME_S % 2.0 < 1.0, -1.0, 1.0)
    late = np.exp(-TIME_S[:200] / ANSWERS_S)
    speed_m_s = np.convolve(np.pad(speed_m_s, (199, 0), "edge"), late / late.sum(), "valid")
    series = {"position": 0.5 + np.cumsum(speed_m_s) * 1e-3, "valve_command": command}
    return Raw("leg", "vertical-leg", None, TIME_S, series, {}, {})


def test_a_piston_that_runs_on_while_its_valve_is_thrown_over_has_no_frozen_command() -> None:
    command = np.where(TIME_S % 2.0 < 1.0, -1.0, 1.0)
    raw = thrown_over(command)
    turn = raw.series["position"][1000:1200]
    assert turn[0] - turn.min() > 2e-3, "it runs on by millimetres"
    assert list(frozen_command(raw)) == []


def test_a_command_that_stays_while_such_a_piston_goes_both_ways_is_found() -> None:
    command = np.where(TIME_S % 2.0 < 1.0, -1.0, 1.0)
    command[1000:4000] = 1.0
    (found,) = frozen_command(thrown_over(command))
    assert found.what == "stays at one value while the piston goes both ways"
