"""A foot pushes and does not pull: what follows from it for friction, and for nothing else."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from testbed.estimation.live import unknowns
from testbed.estimation.live.body_records import BodyBelief, BodyState
from testbed.estimation.live.cylinder_errors import force_error, learn_no_pull
from testbed.estimation.live.fusion import start

MAPS = np.tile(np.eye(3), (4, 1, 1))
"""Cylinders that push straight along the body's axes."""


def seen(up_n: list[float]) -> tuple[Any, np.ndarray]:
    """The estimate after feet seemed to push so hard (4,), N, and the loads that are left."""
    body, state = BodyBelief.zeros()[0], BodyState.zeros()[0]
    body["air_sd"], body["gate"] = 40.0, 8.0
    state["fusion"]["sizes"]["spread"], state["fusion"]["sizes"]["zero_sd"] = 400.0, 100.0
    start(state["fusion"], np.full(len(unknowns.CONSTANTS), 100.0))
    state["means"]["foot_force"][:, 2] = up_n
    learn_no_pull(MAPS, body, state)
    return state, np.array([up - force_error(3 * k + 2, state) for k, up in enumerate(up_n)])


def test_a_foot_that_seems_to_pull_carries_nothing_and_its_friction_is_the_reason() -> None:
    state, left = seen([7000.0, -600.0, 7000.0, 50.0])
    assert left[[0, 2, 3]] == pytest.approx([7000.0, 7000.0, 50.0])
    assert -60.0 < left[1] < 0.0  # but for what its zero, which learns nothing here, may be off by
    assert state["fusion"]["x"][unknowns.DEVIATION + 5] < -500.0
    assert not state["fusion"]["x"][: unknowns.DEVIATION].any()
    assert not np.delete(state["fusion"]["x"], unknowns.DEVIATION + 5).any()


def test_feet_that_push_teach_nothing() -> None:
    state, _ = seen([7000.0, 1.0, 0.0, 300.0])
    assert not state["fusion"]["x"].any()
