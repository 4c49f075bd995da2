"""Soft bristles on the robot: what friction is behind, with a rod that a force presses across."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from testbed.effects.friction_presliding import BENDS_M, Presliding
from testbed.effects.signature import RobotSeen
from testbed.machine.names import AXES

PLACE = "fl_radial"
STEP_S, SPEED_M_S = 0.1, 0.01


def seen(dry_n: np.ndarray, sense: np.ndarray) -> RobotSeen:
    """A cylinder that slides at SPEED_M_S in a sense (n,), against dry friction (n,), N."""
    count, at = len(sense), AXES.index(PLACE)
    columns = {
        "speed_m_s": SPEED_M_S * sense,
        "dry_n": dry_n,
        "sense": sense,
    }
    tables = {name: np.zeros((count, len(AXES))) for name in columns}
    for name, column in columns.items():
        tables[name][:, at] = column
    found = SimpleNamespace(
        time_s=STEP_S * np.arange(count), bins=count, axis=lambda place: at, **tables
    )
    return cast(RobotSeen, cast(Any, found))


def behind(dry_n: np.ndarray, sense: np.ndarray, number: int) -> np.ndarray:
    """(n,) N of one of the signature's numbers."""
    changes = Presliding().signature(seen(dry_n, sense), PLACE)
    return np.asarray(list(changes.values())[number].force[AXES.index(PLACE)])


@pytest.mark.parametrize("number", range(len(BENDS_M)))
def test_after_a_turn_friction_is_behind_by_twice_itself_and_ever_less(number: int) -> None:
    sense = np.where(np.arange(40) < 10, 1.0, -1.0)
    found = behind(np.full(40, 2000.0), sense, number)
    gone_m = SPEED_M_S * STEP_S * np.arange(1, 31)
    assert found[:10] == pytest.approx(np.zeros(10), abs=1e-9)
    assert found[10:] == pytest.approx(4000.0 * np.exp(-gone_m / BENDS_M[number]))


def test_a_rod_that_is_pressed_harder_turns_round_over_more() -> None:
    """Of one stiffness: twice the friction slips after twice the way, and holds twice as much."""
    sense = np.where(np.arange(60) % 40 < 20, 1.0, -1.0)
    dry = np.where(np.arange(60) < 39, 1000.0, 2000.0)
    found = behind(dry, sense, 1)
    gone_m = SPEED_M_S * STEP_S * np.arange(1, 20)
    assert found[20:39] == pytest.approx(2000.0 * np.exp(-gone_m / BENDS_M[1]))
    bent_n = -1000.0 * (1.0 - 2.0 * np.exp(-gone_m[-1] / BENDS_M[1]))
    bent_n = -2000.0 + (2000.0 + bent_n) * np.exp(-SPEED_M_S * STEP_S / (2.0 * BENDS_M[1]))
    assert found[39] == pytest.approx(2000.0 + bent_n)
