"""Nothing is accepted without effect: every argument of an environment changes its episodes or is
refused.
"""

from __future__ import annotations

import inspect
from typing import Any

import numpy as np
import pytest

from testbed.envs.base import RoboclimberEnv
from testbed.envs.climb import ClimbEnv
from testbed.envs.rewards import HOLDING, term_weights
from testbed.errors import InputError

GIVEN: dict[str, Any] = {"scenario": "drill_slope_45", "duration_s": 0.1}
OTHER: dict[str, Any] = {
    "scenario": "stand_flat",
    "overrides": ["terrain.slope_deg=40"],
    "duration_s": 0.16,
    "randomisation": {"terrain.friction": {"uniform": [0.3, 0.5]}},
    "step_ms": 40,
    "weights": {"friction_use": 1.0},
    "observations": "dict",
    "render_mode": "rgb_array",
}


def _episode(**arguments: Any) -> list[Any]:
    """Everything that an agent is told, step by step, and what the last picture is."""
    env = RoboclimberEnv(**(GIVEN | arguments))
    try:
        seen, _ = env.reset(seed=1)
        told: list[Any] = [str(seen)]
        over = False
        while not over:
            seen, reward, lost, ended, _ = env.step(np.zeros(6, np.float32))
            told.append((str(seen), reward))
            over = lost or ended
        return [*told, env.render() is not None]
    finally:
        env.close()


@pytest.mark.slow
def test_every_argument_changes_an_episode() -> None:
    assert set(OTHER) == set(inspect.signature(RoboclimberEnv).parameters)
    plain = _episode()
    for name, value in OTHER.items():
        assert _episode(**{name: value}) != plain, name


@pytest.mark.parametrize("term", [term.name for term in HOLDING])
def test_every_weight_replaces_its_terms_own_and_keeps_its_sign(term: str) -> None:
    own, given = term_weights(HOLDING, {}), term_weights(HOLDING, {term: 3.0})
    assert given[term] == (3.0 if own[term] > 0.0 else -3.0)
    assert {name for name in own if own[name] != given[name]} == {term}


@pytest.mark.parametrize(
    ("kind", "weights", "told"),
    [
        (RoboclimberEnv, {"speed": 1.0}, "weights.speed = 1.0: would have no effect"),
        (ClimbEnv, {"motion": 1.0}, "weights.motion = 1.0: would have no effect"),
        (RoboclimberEnv, {"lost": float("nan")}, "weights.lost = nan: cannot be used"),
    ],
)
def test_a_weight_that_no_reward_takes_is_refused(
    kind: type[RoboclimberEnv], weights: dict[str, float], told: str
) -> None:
    with pytest.raises(InputError, match=told):
        kind(weights=weights)


@pytest.mark.parametrize(
    ("argument", "told"),
    [
        ({"overrides": "terrain.slope_deg=40"}, "overrides = 'terrain.slope_deg=40': is one text"),
        ({"scenario": 3}, "scenario = 3: cannot be used"),
        ({"randomisation": 5}, "randomisation = 5: cannot be used"),
        ({"weights": [1.0]}, r"weights = \[1.0\]: cannot be used"),
        ({"step_ms": "20"}, "step_ms = '20': must be whole control ticks"),
    ],
)
def test_an_argument_of_another_kind_is_refused_by_its_name(
    argument: dict[str, Any], told: str
) -> None:
    with pytest.raises(InputError, match=told):
        RoboclimberEnv(**argument)
