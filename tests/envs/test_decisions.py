"""The environments with decisions: what an action does, what is paid, and that idleness and excess
pay badly.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import gymnasium
import numpy as np
import pytest

import testbed.envs  # noqa: F401  (registers the environments)
from testbed.benchmarks.control_tasks.agents import Constant, Yielding
from testbed.control.layers import SHIFT_SPEED_M_S
from testbed.envs.climb import STRIDE_M
from testbed.envs.drill_hole import FEED_N, FEED_RANGE_N, HANDBOOK
from testbed.envs.keep import HAUL_M_S
from testbed.envs.randomisation import draw_overrides, named_set
from testbed.errors import InputError
from testbed.machine.names import SIDES
from testbed.scenario.scenario import load_scenario

Action = np.ndarray
CUT = "events=[{kind: cut_rope, at_s: 0.6, rope: left}]"
GAMMAS = (1.0, 0.999, 0.99)


@pytest.fixture
def hole() -> Iterator[gymnasium.Env]:
    made = gymnasium.make("Roboclimber/DrillHole-v0", duration_s=12.0, randomisation=None).unwrapped
    yield made
    made.close()


def _keep(*overrides: str, seconds: float = 4.0, **options: object) -> gymnasium.Env:
    changes = ["rates.record_hz=100", *overrides]
    made = gymnasium.make(
        "Roboclimber/Keep-v0",
        overrides=changes,
        duration_s=seconds,
        **{"randomisation": None, **options},
    )
    return made.unwrapped


def _returns(env: gymnasium.Env, act: Callable[[dict], Action]) -> dict[float, float]:
    """Return of one episode at each discount."""
    rewards, over = [], False
    _, info = env.reset(seed=1)
    while not over:
        _, reward, lost, ended, info = env.step(act(info))
        assert reward == pytest.approx(sum(info["reward_terms"].values()))
        rewards.append(reward)
        over = lost or ended
    return {gamma: float(np.polyval(rewards[::-1], gamma)) for gamma in GAMMAS}


def test_feed_and_hammer_come_about_and_the_mask_says_when_they_cannot(hole: gymnasium.Env) -> None:
    _, info = hole.reset(seed=1)
    assert info["action_mask"].all()
    hole.step(np.array([0.2, -1.0, 0.0, 0.0, 0.0], dtype=np.float32))
    _, _, _, _, info = hole.step(np.array([0.2, -1.0, 0.0, 0.0, 0.0], dtype=np.float32))
    assert hole._sim.machine.drill.loads.blow == 0.0
    assert hole._orders.feed_n == pytest.approx(FEED_N + 0.2 * FEED_RANGE_N)
    hole._sim.machine.drill.phase = "jam"
    assert hole.action_masks().tolist() == [False, False, True, True, True]


@pytest.mark.slow
def test_neither_idleness_nor_leaning_on_the_limits_drills_as_well_as_the_handbook(
    hole: gymnasium.Env,
) -> None:
    size = hole.action_space.shape
    handbook = _returns(hole, lambda _: HANDBOOK)
    idle = _returns(hole, lambda _: -np.ones(size, np.float32))
    limit = _returns(hole, lambda _: np.ones(size, np.float32))
    for gamma in GAMMAS:
        assert max(idle[gamma], limit[gamma]) < 0.7 * handbook[gamma]


@pytest.mark.slow
def test_nobody_is_paid_more_than_a_bit_that_minds_no_foot(hole: gymnasium.Env) -> None:
    """One who knows the rock comes near to it, the handbook less so; asking changes nothing."""
    hole.reset(seed=1)
    begun, most = hole.save(), hole.most_paid()
    paid = {}
    for knows in (True, False):
        hole.restore(begun)
        depth, over, action = 0.0, False, HANDBOOK.copy()
        while not over:
            if knows:
                action[0] = (hole.best_feed_n - FEED_N) / FEED_RANGE_N
            _, _, lost, ended, info = hole.step(action)
            depth += info["reward_terms"]["depth"]
            over = lost or ended
            assert depth + hole.most_paid() <= most + 1e-6
        paid[knows] = depth
    assert paid[False] < paid[True] <= most and paid[True] > 0.95 * most


def test_a_rope_is_hauled_at_the_speed_that_is_ordered_and_one_that_is_cut_is_masked() -> None:
    env = _keep(CUT)
    _, info = env.reset(seed=1)
    assert info["action_mask"].all() and info["fault_s"] == 0.6
    before = env._sim.machine.board.ropes["unstrained"].copy()
    right = np.zeros(5, dtype=np.float32)
    right[SIDES.index("right")] = 0.5
    for _ in range(4):
        env.step(right)
    hauled = before - env._sim.machine.board.ropes["unstrained"]
    assert hauled == pytest.approx([0.0, 0.5 * HAUL_M_S * 0.2], abs=1e-3)
    for _ in range(8):
        _, _, _, _, info = env.step(np.zeros(5, dtype=np.float32))
    env.close()
    assert info["action_mask"].tolist() == [False, *4 * [True]]


def test_the_body_goes_down_the_slope_over_feet_that_stay() -> None:
    env = _keep("events=[]", "terrain.friction=0.8", seconds=2.0)
    env.reset(seed=1)
    body = env._sim.machine.origin_in_world
    up = env._sim.machine.ground.rotation_slope_to_world[:, 0]
    before = body() @ up
    for _ in range(2):
        env.step(np.array([0.0, 0.0, 0.0, 0.0, -1.0], dtype=np.float32))
    for _ in range(12):
        _, _, _, _, info = env.step(np.zeros(5, dtype=np.float32))
    way = before - body() @ up
    env.close()
    assert way == pytest.approx(2 * SHIFT_SPEED_M_S * 0.05, abs=6e-3)
    assert info["slip_m"] < 2e-3


def test_a_stance_is_paid_from_the_fault_on_and_only_while_its_feet_stay() -> None:
    env = _keep("events=[{kind: set_rope, at_s: 0.55, rope: left, pay_out_m: 0.001}]", seconds=1.0)
    whole = _returns(env, lambda _: np.zeros(5, np.float32))[1.0]
    env.close()
    assert whole == pytest.approx(0.45, abs=0.03)


@pytest.mark.slow
def test_neither_idleness_nor_leaning_on_the_limits_keeps_as_well_as_the_agent_that_yields() -> (
    None
):
    """On two drawn machines, the left rope of one and the right rope of the other cut as early as
    faults are drawn: nothing, and every action at either limit all the time. No end comes early to
    anybody's gain: the score only grows.
    """
    env, each = _keep(randomisation="keep"), np.eye(5)
    poor = [np.zeros(5), *each, *-each, each[0] + each[1], each[0] + each[1] - each[4]]
    earned = np.zeros((len(poor) + 1, len(GAMMAS)))
    for seed, side in zip((203, 201), SIDES, strict=True):
        cut = f"events=[{{kind: cut_rope, at_s: 1.4, rope: {side}}}]"
        env.reset(seed=seed, options={"overrides": [cut]})
        start = env.save()
        agents = [Yielding(), *(Constant(action) for action in poor)]
        for agent, sums in zip(agents, earned, strict=True):
            (seen, _), rewards, over = env.restore(start), [], False
            while not over:
                seen, reward, lost, ended, _ = env.step(agent.act(seen))
                rewards.append(reward)
                over = lost or ended
            assert min(rewards) >= 0.0
            sums += [float(np.polyval(rewards[::-1], gamma)) for gamma in GAMMAS]
    env.close()
    assert (earned[1:] < 0.8 * earned[0]).all(), earned


def test_an_episode_goes_on_from_a_saved_instant_to_the_last_bit() -> None:
    """Three steps after a save, and after going back to it; the same machine again has other
    noise.
    """
    env = _keep(CUT, seconds=2.0)
    env.reset(seed=1)
    act = np.array([0.3, -0.2, 0.5, 0.1, -0.4], np.float32)
    env.step(act)
    saved = env.save()
    first = [env.step(act) for _ in range(3)]
    _, info = env.restore(saved)
    again = [env.step(act) for _ in range(3)]
    for one, other in zip(first, again, strict=True):
        assert np.array_equal(one[0], other[0]) and one[1] == other[1]
        assert one[4]["slip_m"] == other[4]["slip_m"]
    assert info["t_s"] < first[0][4]["t_s"]
    _, info = env.reset(options={"same_machine": True})
    assert info["t_s"] == pytest.approx(0.05, abs=1e-3)
    first_seen = env.step(act)[0]
    env.reset(options={"same_machine": True})
    other_seen = env.step(act)[0]
    assert not np.array_equal(first_seen, other_seen)
    env.reset(seed=2)
    with pytest.raises(InputError, match="another draw"):
        env.restore(saved)
    env.close()


@pytest.mark.slow
def test_a_walk_that_has_made_its_steps_ends_the_episode() -> None:
    env = gymnasium.make("Roboclimber/Climb-v1", randomisation=None, duration_s=60.0).unwrapped
    env.reset(seed=1, options={"overrides": ["task.steps=1"]})
    for _ in range(3):
        *_, lost, over, info = env.step(np.zeros(3, dtype=np.float32))
        if lost or over:
            break
    assert over and not lost and info["verdict"] == "stood" and info["t_s"] < 40.0
    env.close()


@pytest.mark.slow
def test_a_longer_stride_goes_further_in_a_step_and_the_step_is_a_group_of_swings() -> None:
    """Strides of 0.4 m take the body 0.2 m in a group of two swings, 0.3 m take it 0.15 m, from
    the second group on.
    """
    ways = {}
    for action in (0.0, -0.1 / STRIDE_M):
        env = gymnasium.make("Roboclimber/Climb-v1", randomisation=None, duration_s=60.0).unwrapped
        env.reset(seed=1)
        on_the_way = []
        for _ in range(3):
            _, reward, lost, _, info = env.step(np.array([action, 0.0, 0.0], dtype=np.float32))
            assert not lost and reward == pytest.approx(sum(info["reward_terms"].values()))
            assert info["feet_lost"] < 2, "both have swung, which loses no foot"
            on_the_way.append(info["way_m"])
        assert env._gait.steps_done == 6
        ways[action] = on_the_way[2] - on_the_way[0]
        env.close()
    assert ways[0.0] == pytest.approx(0.4, abs=0.04)
    assert ways[-0.1 / STRIDE_M] == pytest.approx(0.3, abs=0.04)


def test_an_observation_by_name_holds_the_numbers_of_the_flat_one() -> None:
    seen = {}
    for form in ("flat", "dict"):
        env = _keep(seconds=1.0, observations=form)
        seen[form] = env.reset(seed=1)[0]
        assert env.observation_space.contains(seen[form])
        table = env.table
        env.close()
    for row, value in zip(table, seen["flat"], strict=True):
        middle, half = (row.high + row.low) / 2, (row.high - row.low) / 2
        assert seen["dict"][row.column][0] == pytest.approx(
            middle + half * value, rel=1e-5, abs=1e-9
        )


def test_faults_are_one_or_two_of_their_kinds_at_their_times() -> None:
    kinds = {"first": ["cut_rope"], "second": ["set_rope", "patch"]}
    chosen = {"faults": {"at_s": [2.0, 3.0], "two": 0.5, **kinds}}
    rng, seen, twice = np.random.default_rng(0), set(), 0
    for _ in range(100):
        spec = load_scenario("stand_slope_45", draw_overrides(named_set(chosen), rng))
        faults = [event.kind for event in spec.events] + len(spec.terrain.patches) * ["patch"]
        assert all(2.0 <= event.at_s <= 3.0 for event in spec.events)
        assert faults[0] == "cut_rope" and len(faults) == len(set(faults))
        seen |= set(faults)
        twice += len(faults) == 2
    assert seen == {"cut_rope", "set_rope", "patch"} and 35 <= twice <= 65


@pytest.mark.slow
def test_the_machine_is_drawn_anew_at_every_reset_unless_nothing_is_to_vary() -> None:
    for name, resets in (("Keep-v0", 2), ("DrillHole-v0", 1), ("Climb-v1", 1)):
        env = gymnasium.make(f"Roboclimber/{name}", duration_s=3.0).unwrapped
        drawn = []
        for seed in range(resets):
            env.reset(seed=seed)
            drawn.append(env._sim.scenario.machine)
        env.close()
        assert all(machine.draw == "workshop" for machine in drawn)
        assert len({machine.seed for machine in drawn}) == resets
