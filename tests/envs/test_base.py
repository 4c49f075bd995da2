"""The environment around a run, asked directly: orders add up, rows are named, and a run's end is
told once.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from testbed.control.gait import Layered
from testbed.envs.base import RoboclimberEnv
from testbed.envs.observations import (
    OFFSET_RANGE_M,
    OFFSET_STEP_M,
    PULL_STEP_N,
    TABLE,
    in_units,
)
from testbed.errors import InputError
from testbed.machine.names import LEGS, SIDES

RAISE_FL, HAUL_RIGHT = np.eye(6, dtype=np.float32)[[0, 5]]
REST = np.zeros(6, dtype=np.float32)


@pytest.fixture
def env() -> Iterator[RoboclimberEnv]:
    made = RoboclimberEnv("stand_slope_45", duration_s=1.0)
    yield made
    made.close()


def test_an_action_adds_to_the_orders_before_and_stops_at_their_range(env: RoboclimberEnv) -> None:
    env.reset(seed=1)
    before = env._trim.pull_n.copy()
    for _ in range(3):
        env.step(RAISE_FL - HAUL_RIGHT)
    assert env._trim.goal_m == pytest.approx([3 * OFFSET_STEP_M, 0.0, 0.0, 0.0])
    assert env._trim.pull_n - before == pytest.approx([0.0, -3 * PULL_STEP_N])
    env._order(1e6 * (RAISE_FL + HAUL_RIGHT))
    assert env._trim.goal_m[0] == OFFSET_RANGE_M and env._trim.pull_n[1] == 3.14e4  # rating
    env._order(-1e6 * HAUL_RIGHT)
    assert env._trim.pull_n[1] == 0.0


def test_actions_beyond_one_count_as_one(env: RoboclimberEnv) -> None:
    env.reset(seed=1)
    env.step(7.0 * RAISE_FL)
    assert env._trim.goal_m[0] == pytest.approx(OFFSET_STEP_M)


def test_the_agents_orders_are_a_layer_over_the_tasks_gait(env: RoboclimberEnv) -> None:
    env.reset(seed=1)
    gait = env._sim.machine.gait
    assert isinstance(gait, Layered) and gait.layers == (env._trim,)


def test_an_observation_holds_the_steps_mean_and_the_orders_by_name(env: RoboclimberEnv) -> None:
    env.reset(seed=1)
    seen: list[np.ndarray] = []
    run = env._sim.run_block
    env._sim.run_block = lambda rows: seen.append(run(rows)) or seen[-1]
    values = in_units(env.step(RAISE_FL)[0])
    mean = dict(zip(env._sim.data_columns, seen[0][0].mean(axis=0), strict=True))
    for row in TABLE:
        if not row.column.startswith("orders."):
            wanted = float(np.clip(mean[row.column], row.low, row.high))
            scale = row.high - row.low
            assert abs(values[row.column] - wanted) < 1e-6 * scale, row.column
    assert values["orders.offset_fl"] == pytest.approx(OFFSET_STEP_M, rel=1e-4)
    for k, side in enumerate(SIDES):
        assert values[f"orders.pull_{side}"] == pytest.approx(env._trim.pull_n[k], rel=1e-4)


def test_the_scenarios_end_cuts_the_episode_off_and_a_fall_terminates_it() -> None:
    for changes, ends in (
        ([], (False, True)),
        (["ropes.enabled=false", "terrain.friction=0.3"], (True, False)),
    ):
        env = RoboclimberEnv("stand_slope_45", changes, duration_s=3.0 if changes else 0.1)
        try:
            _, info = env.reset(seed=1)
            over = (False, False)
            while not any(over):
                _, _, *over, info = env.step(REST)
                over = tuple(over)
            assert over == ends and (info["verdict"] == "stood") == over[1]
            with pytest.raises(InputError, match="the episode has ended"):
                env.step(REST)
        finally:
            env.close()


def test_what_is_told_of_the_truth_has_units_and_its_own_memory(env: RoboclimberEnv) -> None:
    _, info = env.reset(seed=1)
    assert info["t_s"] == pytest.approx(0.02) and info["loads_n"].shape == (len(LEGS),)
    later = env.step(REST)[4]
    assert later["t_s"] == pytest.approx(0.04) and later["loads_n"] is not info["loads_n"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"step_ms": 15}, "step_ms = 15: must be whole control ticks"),
        ({"overrides": ["rates.record_hz=125"]}, "record_hz = 125: makes no whole rows"),
        ({"render_mode": "ansi"}, "render_mode = 'ansi': no such mode"),
        ({"scenario": "no_such"}, "no such scenario"),
    ],
)
def test_arguments_that_cannot_be_used_are_refused(arguments: dict[str, object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        RoboclimberEnv(**{"scenario": "stand_slope_45", **arguments}).reset(seed=1)  # type: ignore[arg-type]


def test_a_reset_may_change_the_scenario_for_one_episode(env: RoboclimberEnv) -> None:
    flat = env.reset(seed=1, options={"overrides": ["terrain.slope_deg=0"]})[0]
    steep = env.reset(seed=1)[0]
    assert in_units(flat)["attitude_pitch"] == pytest.approx(0.0, abs=3e-3)
    assert in_units(steep)["attitude_pitch"] == pytest.approx(-np.pi / 4, abs=3e-3)


def test_a_reset_refuses_options_that_nothing_would_come_of(env: RoboclimberEnv) -> None:
    env.reset(seed=1)
    steeper = ["terrain.slope_deg=50"]
    for options, said in (
        ({"overides": steeper}, "no such option, did you mean 'overrides'"),
        ({"same_machine": True, "overrides": steeper}, "same_machine rules it"),
    ):
        with pytest.raises(InputError, match=said):
            env.reset(seed=1, options=options)
    env.step(REST)


def test_no_step_follows_a_reset_that_was_refused(env: RoboclimberEnv) -> None:
    env.reset(seed=1)
    with pytest.raises(InputError, match="out of range"):
        env.reset(seed=1, options={"overrides": ["terrain.slope_deg=99"]})
    with pytest.raises(InputError, match="the episode has ended"):
        env.step(REST)


def test_friction_is_used_against_what_is_under_each_foot() -> None:
    """On a patch of a fifth of the friction the same forces use five times of it, and slide."""
    uses = []
    for changes in ([], ["terrain.patches=[{foot: fl, friction: 0.14}]"]):
        env = RoboclimberEnv("stand_slope_45", ["terrain.friction=0.7", *changes], duration_s=0.1)
        try:
            uses.append(env.reset(seed=1)[1]["friction_use"])
        finally:
            env.close()
    assert uses[0] < 0.35 and 0.9 < uses[1] < 1.05
