"""Nothing is accepted without effect: every argument of an environment changes its episodes or is refused."""

from __future__ import annotations

import inspect
from dataclasses import fields
from typing import Any

import numpy as np
import pytest

from testbed.envs.base import RoboclimberEnv
from testbed.envs.climb import ClimbEnv
from testbed.envs.rewards import Truth as Known
from testbed.envs.rewards import Weights, holding_reward
from testbed.errors import InputError

GIVEN: dict[str, Any] = {"scenario": "drill_slope_45", "duration_s": 0.1}
OTHER: dict[str, Any] = {
    "scenario": "stand_flat",
    "overrides": ["terrain.slope_deg=40"],
    "duration_s": 0.16,
    "randomisation": {"terrain.friction": {"uniform": [0.3, 0.5]}},
    "step_ms": 40,
    "weights": {"friction_use": 1.0},
    "render_mode": "rgb_array",
}


def _episode(**arguments: Any) -> list[Any]:
    """Everything that an agent is told, step by step, and what the last picture is."""
    env = RoboclimberEnv(**(GIVEN | arguments))
    try:
        seen, _ = env.reset(seed=1)
        told: list[Any] = [seen.tobytes()]
        over = False
        while not over:
            seen, reward, lost, ended, _ = env.step(np.zeros(6, np.float32))
            told.append((seen.tobytes(), reward))
            over = lost or ended
        return [*told, env.render() is not None]
    finally:
        env.close()


def test_every_argument_changes_an_episode() -> None:
    assert set(OTHER) == set(inspect.signature(RoboclimberEnv).parameters)
    plain = _episode()
    for name, value in OTHER.items():
        assert _episode(**{name: value}) != plain, name


@pytest.mark.parametrize("weight", [field.name for field in fields(Weights)])
def test_every_weight_changes_the_reward(weight: str) -> None:
    known = Known(100.0, 0.4, 1, 0.01, np.array([0.01, 0.0, 0.0]), np.zeros(4))
    rewards = [
        holding_reward(known, np.ones(6), True, Weights.of(given, RoboclimberEnv.weights))
        for given in ({}, {weight: 3.0})
    ]
    assert rewards[0] != rewards[1]


@pytest.mark.parametrize(
    ("kind", "weights", "told"),
    [
        (RoboclimberEnv, {"speed": 1.0}, "weights.speed = 1.0: would have no effect"),
        (ClimbEnv, {"motion_1_m": 1.0}, "weights.motion_1_m = 1.0: would have no effect"),
        (RoboclimberEnv, {"lost": float("nan")}, "weights.lost = nan: cannot be used"),
    ],
)
def test_a_weight_that_no_reward_takes_is_refused(
    kind: type[RoboclimberEnv], weights: dict[str, float], told: str
) -> None:
    with pytest.raises(InputError, match=told):
        kind(weights=weights)
