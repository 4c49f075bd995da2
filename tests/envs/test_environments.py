"""Every registered environment: the checkers, seeds, tasks, vectors."""

from __future__ import annotations

import json
import runpy
import warnings
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

import testbed.envs
from testbed.envs.climb import ClimbEnv
from testbed.envs.observations import (
    CLIMB_TABLE,
    HOLE_TABLE,
    KEEP_TABLE,
    SHARE_TABLE,
    TABLE,
    in_units,
)
from testbed.envs.rewards import HOLDING, Truth, holding_amounts, term_weights, truth_of_step
from testbed.recording.rows import TruthRow

IDS = sorted(testbed.envs.ENVIRONMENTS)
SECONDS = {"Roboclimber/Climb-v1": 60.0, "Roboclimber/DrillHole-v0": 8.0}
"""Length of an episode in which more than one decision is made, where 2 s are too few."""
SHARE = "Roboclimber/ForceDistribution-v0"


def _truth(**changes: float) -> Truth:
    values = {"lowest_normal_n": 5e3, "friction_use": 0.2, "feet_lost": 0, "moved_m": 0.001}
    return Truth(**{**values, **changes}, way_in_world_m=np.zeros(3), loads_n=np.full(4, 6e3))  # type: ignore[arg-type]


@pytest.mark.slow
@pytest.mark.parametrize("name", IDS)
def test_gymnasiums_checker_is_content(name: str) -> None:
    env = gymnasium.make(name, duration_s=SECONDS.get(name, 2.0)).unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*no display.*")
        warnings.filterwarnings("ignore", message=".*Climb-v0")  # it says that it is outdated
        check_env(env)
    env.close()


@pytest.mark.rl
@pytest.mark.slow
@pytest.mark.parametrize("name", IDS)
def test_stable_baselines3s_checker_is_content(name: str) -> None:
    checker = pytest.importorskip(
        "stable_baselines3.common.env_checker", reason="the extra `rl` is not installed"
    )
    env = gymnasium.make(name, duration_s=SECONDS.get(name, 2.0)).unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checker.check_env(env)
    env.close()


def test_entry_points_are_names_and_arguments_plain_json() -> None:
    for entry, kwargs in testbed.envs.ENVIRONMENTS.values():
        assert isinstance(entry, str)
        assert json.loads(json.dumps(kwargs)) == kwargs


def test_the_page_of_the_environments_is_what_the_code_says() -> None:
    docs = Path(__file__).parents[2] / "docs"
    page, text = (
        runpy.run_path(str(docs / "environments.py"))["page"],
        (docs / "environments.md").read_text(),
    )
    assert text == page(), "python docs/environments.py > docs/environments.md"
    assert all(
        f"| {row.column} |" in text
        for row in (*TABLE, *SHARE_TABLE, *KEEP_TABLE, *HOLE_TABLE, *CLIMB_TABLE)
    )


def test_rewards_by_hand() -> None:
    """1 - 0.5 * 0.2 - 20 * 0.001 - 0.05 * 0.25 = 0.8675; a lost foot takes 1, a fall 50; 2 cm up
    the slope bring 2.
    """
    action, weights = np.full(6, 0.5), term_weights(HOLDING, {})

    def reward(truth: Truth, ended: bool) -> float:
        amounts = holding_amounts(truth, action, ended)
        return sum(weights[name] * amount for name, amount in amounts.items())

    assert reward(_truth(), False) == pytest.approx(0.8675)
    assert reward(_truth(feet_lost=1), True) == pytest.approx(0.8675 - 51.0)
    climbing = {term.name: term.weight for term in ClimbEnv.terms}
    assert climbing == {
        "way": 100.0,
        **{name: weights[name] for name in ("friction_use", "lost", "effort", "end")},
    }


def test_truth_of_a_step_by_hand() -> None:
    """A foot with 1000 N across and 4000 N along the normal uses 1000 / (0.5 * 4000) of its
    friction: a half.
    """
    rows = TruthRow.zeros(2)
    rows["contact_normal"] = 4000.0
    rows["foot_force_in_world"][..., 2] = 4000.0
    rows["foot_force_in_world"][:, 0, 0] = 1000.0
    rows["contact_normal"][0, 3] = rows["foot_force_in_world"][0, 3, 2] = 50.0
    rows["body_pose_in_world"][1, 0] = 0.003
    stance = np.ones(4, dtype=bool)
    truth = truth_of_step(rows, 0.5, stance, np.array([0.001, 0.0, 0.0]))
    assert (truth.friction_use, truth.feet_lost, truth.lowest_normal_n) == pytest.approx(
        (0.5, 1, 50.0)
    )
    assert truth.moved_m == pytest.approx(0.002)  # from where the step before ended
    stance[3] = False
    assert truth_of_step(rows, 0.5, stance, np.zeros(3)).feet_lost == 0
    swung = np.ones((2, 4), dtype=bool)
    swung[0, 3] = False  # in the air as it was meant to be, and down again at the end of the step
    swung_truth = truth_of_step(rows, 0.5, swung, np.zeros(3))
    assert (swung_truth.feet_lost, swung_truth.lowest_normal_n) == (0, 4000.0)


def test_wanted_loads_beyond_the_plan_come_about() -> None:
    """+1 on fl and rr, -1 on fr and rl asks for 2 kN more on one diagonal; two seconds later most
    of it is there.
    """
    env = gymnasium.make(SHARE, randomisation=None, duration_s=6.0).unwrapped
    env.reset(seed=1)
    loads = []
    for action in (np.zeros(6), np.array([1.0, -1.0, -1.0, 1.0, 0.0, 0.0])):
        for _ in range(100):
            observation, _, _, _, info = env.step(action.astype(np.float32))
        loads.append(info["loads_n"])
    env.close()
    change = (loads[1] - loads[0]) @ np.array([1, -1, -1, 1]) / 4
    assert 1000.0 < change < 3000.0
    assert in_units(observation, SHARE_TABLE)["orders.share_fl"] == pytest.approx(2000.0)


def test_a_trained_controller_sees_what_its_environment_showed_and_acts_as_it_did(
    tmp_path: Path,
) -> None:
    """A network of known weights moves the environment, and then the benchmark's controller: the
    same orders.
    """
    from testbed.control.distribution.controllers import Learned

    rng, sizes = np.random.default_rng(0), (len(SHARE_TABLE), 8, 8, 6)
    weights = {f"weight_{k}": rng.normal(0.0, 0.3, (sizes[k + 1], sizes[k])) for k in range(3)}
    np.savez(
        tmp_path / "policy.npz",
        **weights,
        **{f"bias_{k}": np.zeros(sizes[k + 1]) for k in range(3)},
    )
    learned = Learned(tmp_path / "policy.npz")
    env = gymnasium.make(SHARE, randomisation=None, duration_s=4.0).unwrapped
    observation, _ = env.reset(seed=1)
    for _ in range(20):
        observation = env.step(learned.action(observation.astype(float)).astype(np.float32))[0]
    wanted = in_units(observation, SHARE_TABLE)
    env.reset(seed=1)
    env._layer.controller = learned  # from here on the controller moves itself
    env._sim.run_block(20 * 20)
    env.close()
    own = learned.beyond_n
    assert [wanted[row.column] for row in SHARE_TABLE[-6:]] == pytest.approx(own, abs=150.0)
    assert np.abs(own).max() > 200.0


@pytest.mark.slow
@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_vector_of_two_resets_itself(mode: AutoresetMode) -> None:
    envs = gymnasium.make_vec(
        "Roboclimber/Stand-v0",
        2,
        vectorization_mode="sync",
        duration_s=0.3,
        vector_kwargs={"autoreset_mode": mode},
    )
    envs.reset(seed=1)
    ended = np.zeros(2, dtype=int)
    for _ in range(40):
        observations, rewards, terminated, truncated, _ = envs.step(
            np.zeros((2, 6), dtype=np.float32)
        )
        assert np.isfinite(observations).all() and np.isfinite(rewards).all()
        ended += terminated | truncated
    envs.close()
    assert ended.min() >= 2


@pytest.mark.slow
def test_two_processes_see_what_one_sees() -> None:
    seen = {}
    for way in ("sync", "async"):
        envs = gymnasium.make_vec("Roboclimber/Drill-v0", 2, vectorization_mode=way, duration_s=2.0)
        envs.reset(seed=[3, 4])
        for _ in range(5):
            seen[way] = envs.step(np.full((2, 6), 0.5, dtype=np.float32))[0].copy()
        envs.close()
    assert np.array_equal(seen["sync"], seen["async"])
