"""Environments on machines of another size: ranges, actions and rewards are theirs, so that the
same share of a range means the same.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from testbed.envs import make_env
from testbed.envs.base import RoboclimberEnv
from testbed.envs.observations import KEEP_TABLE, TABLE, fitted
from testbed.envs.randomisation import draw_overrides, named_set
from testbed.envs.rewards import HOLDING, term_weights
from testbed.errors import InputError
from testbed.machine.build import build_machine
from testbed.machine.scale import Scale
from testbed.workflows.machines import check_machine

HALF = "format: roboclimber-machine/1\nname: half\nset: original\nlength_scale: 0.5\n"
SHIPPED = {
    "climber_8t": "climber_8t_stand",
    "quarter_model": "quarter_model_stand",
    "roboclimber": "stand_slope_45",
}


@pytest.fixture
def half(tmp_path: Path) -> Path:
    """A machine of one's own: ROBOCLIMBER of half its size."""
    (tmp_path / "machine.yaml").write_text(HALF)
    check_machine(str(tmp_path))
    return tmp_path


def _first_look(scenario: str, *overrides: str) -> tuple[np.ndarray, RoboclimberEnv]:
    env = RoboclimberEnv(scenario, list(overrides), duration_s=0.2)
    try:
        return env.reset(seed=1)[0], env
    finally:
        env.close()


def test_the_tables_are_roboclimbers_own() -> None:
    for table in (TABLE, KEEP_TABLE):
        assert fitted(table, build_machine()) == table


@pytest.mark.slow
@pytest.mark.parametrize("scenario", SHIPPED.values(), ids=SHIPPED)
def test_a_shipped_machine_stands_within_its_ranges_and_is_paid_alike(scenario: str) -> None:
    env = RoboclimberEnv(scenario, duration_s=0.2)
    seen, _ = env.reset(seed=1)
    rewards = [env.step(np.zeros(6, np.float32))[1] for _ in range(4)]
    env.close()
    for row, share in zip(env.table, seen, strict=True):
        if row.unit != "1":  # no yes or no
            assert share < 1.0 and (share > -1.0 or row.low == 0.0), row.column
    assert 0.5 < np.mean(rewards) < 1.0


@pytest.mark.slow
def test_a_machine_of_half_the_size_sees_the_forces_and_ways_of_the_whole_one(half: Path) -> None:
    whole = _first_look("stand_slope_45", "machine.set=original")[0]
    posture = ("robot.vertical_m=0.125", "robot.radial_m=0.1", "rates.physics_hz=2000")
    seen, env = _first_look("stand_slope_45", f"machine.folder={half}", *posture)
    assert env.scale.force == pytest.approx(0.125, rel=0.05)
    for row, one, other in zip(TABLE, seen, whole, strict=True):
        if row.unit in ("N", "m", "rad"):
            assert one == pytest.approx(other, abs=0.1), row.column


@pytest.mark.slow
def test_an_action_moves_a_small_machine_by_its_own_measure(half: Path) -> None:
    posture = ["robot.vertical_m=0.125", "robot.radial_m=0.1", "rates.physics_hz=2000"]
    env = RoboclimberEnv("stand_slope_45", [f"machine.folder={half}", *posture], duration_s=0.2)
    env.reset(seed=1)
    pull_n = env._trim.pull_n.copy()
    env.step(np.array([1, 0, 0, 0, 1, 0], np.float32))
    env.close()
    assert env._trim.goal_m[0] == pytest.approx(0.5e-4, rel=0.05)
    assert env._trim.pull_n[0] - pull_n[0] == pytest.approx(200.0 / 8.0, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("force-distribution", {"scenario": "climber_8t_drill"}),
        ("keep", {"scenario": "climber_8t_stand"}),
        ("climb", {"scenario": "climber_8t_crawl", "randomisation": None}),
        ("climb", {"scenario": "quarter_model_crawl", "randomisation": None}),
        (
            "drill-hole",
            {"overrides": ["machine.folder=climber_8t", "robot.vertical_m=0.32"]},
        ),
    ],
)
def test_every_task_begins_on_a_machine_that_can_do_it(
    name: str, options: dict[str, object]
) -> None:
    env = make_env(name, **options).unwrapped
    seen, _ = env.reset(seed=1)
    seen, reward, lost, *_ = env.step(np.zeros(env.action_space.shape, np.float32))
    env.close()
    ranged = np.array([row.unit != "1" for row in env.table])
    assert not lost and np.isfinite(reward) and np.mean(np.abs(seen[ranged]) == 1.0) < 0.2


@pytest.mark.parametrize(
    "begin",
    [
        lambda: make_env("keep", overrides=["machine.folder=quarter_model"], randomisation=None),
        lambda: make_env(
            "drill-hole", overrides=["machine.folder=quarter_model"], randomisation=None
        ),
    ],
)
def test_a_task_that_needs_ropes_or_a_drill_is_refused_by_name(
    begin: Callable[[], RoboclimberEnv],
) -> None:
    with pytest.raises(InputError, match="the machine has no"):
        begin().reset(seed=1)


def test_an_episode_on_another_machine_needs_an_environment_of_its_own() -> None:
    env = RoboclimberEnv("stand_slope_45", duration_s=0.2)
    other = ["machine.folder=climber_8t", "robot.vertical_m=0.32", "robot.radial_m=0.25"]
    with pytest.raises(InputError, match="an environment of its own"):
        env.reset(seed=1, options={"overrides": other})
    env.close()


def test_prices_and_draws_go_with_the_size_and_what_is_given_stays() -> None:
    small = Scale(0.125, 0.5)
    assert term_weights(HOLDING, {}, small)["motion"] == 2.0 * term_weights(HOLDING, {})["motion"]
    assert term_weights(HOLDING, {"motion": 3.0}, small)["motion"] == -3.0
    most = named_set("stand", small)["robot.payload_kg"]["uniform"][1]
    assert most == pytest.approx(1333.0 / 8.0)
    own = {"robot.payload_kg": {"uniform": [0.0, 1333.0]}}
    assert named_set(own, small) == own
    drawn = draw_overrides(named_set("stand", small), np.random.default_rng(1), small)
    assert [change.partition("=")[0] for change in drawn] == list(named_set("stand"))
