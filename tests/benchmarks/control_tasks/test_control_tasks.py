"""The control benchmark on made-up answers, its search on a known hill, its agents on made-up
readings.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
import pytest

from testbed import envs
from testbed.benchmarks.control_tasks import benchmark, episodes
from testbed.benchmarks.control_tasks.agents import (
    ROPE_N_M,
    STEP_S,
    Hauling,
    Secure,
    Yielding,
    secure_share,
)
from testbed.benchmarks.control_tasks.benchmark import (
    ORACLE,
    SCORING_SEED,
    Case,
    ControlTasks,
    summary,
)
from testbed.benchmarks.control_tasks.climbing import TURN, ClimbPlan
from testbed.benchmarks.control_tasks.drilling import Adaptive, Drill, Reserve
from testbed.benchmarks.control_tasks.episodes import Branches, best_found, episode
from testbed.benchmarks.control_tasks.oracle import KeepPlan, keep_plan_of, search
from testbed.benchmarks.control_tasks.tasks import TASKS, Entrant, Task
from testbed.control.gait import Observed
from testbed.control.layers import SHIFT_SPEED_M_S
from testbed.envs.drill_hole import FEED_N, FEED_RANGE_N
from testbed.envs.observations import HOLE_TABLE, KEEP_TABLE
from testbed.errors import InputError
from testbed.laws.penetration import best_feed, thrust_factor

DRILL = Drill(3.4e-3, 5.5e3, 0.35, 1.5, 2.0, 2.0e4)


def observed(table: tuple[Observed, ...], **readings: float) -> np.ndarray:
    """A flat observation with these readings; the other rows are in the middle of their range."""
    values = [
        (2.0 * readings[row.column] - row.low - row.high) / (row.high - row.low)
        if row.column in readings
        else 0.0
        for row in table
    ]
    return np.array(values, dtype=np.float32)


def _hole(rate: float, feed: float, load_n: float = 5000.0) -> np.ndarray:
    """Bit at work with the full hammer, the same load on every foot."""
    loads = {f"estimate_own_{leg}": load_n for leg in ("fl", "fr", "rl", "rr")}
    known = {"control.drilling": 1.0, "orders.hammer": 1.0}
    return observed(HOLE_TABLE, **{"control.bit_rate": rate, "orders.feed": feed}, **known, **loads)


@pytest.mark.parametrize("energy", [0.4, 1.0, 2.5])
def test_the_adaptive_agent_finds_the_best_feed_of_rock_that_it_does_not_know(
    energy: float,
) -> None:
    """Ten decisions on rock of one strength: the feed comes within 10 % of the best rate there
    is.
    """
    agent, feed = Adaptive(DRILL, share=0.8, most=0.9), FEED_N
    best = best_feed(DRILL.best_feed_n, energy, DRILL.feed_exponent)
    for _ in range(10):
        rate = DRILL.medium_m_s / energy * thrust_factor(feed, best)
        feed = FEED_N + FEED_RANGE_N * float(agent.act(_hole(rate, feed))[0])
    assert thrust_factor(feed, best) > 0.9


def test_the_adaptive_agent_presses_less_where_the_stance_hardly_carries() -> None:
    """Reserve 7 kN: a stance that is even but nearly lost (400 N a foot) bears less thrust than one
    of 5 kN a foot.
    """
    drill, feeds = Drill(3.4e-3, 5.5e3, 0.35, 1.5, 2.0, 7.0e3), {}
    for load in (5000.0, 400.0):
        agent = Adaptive(drill, share=0.7, most=0.7)
        for _ in range(3):
            action = agent.act(_hole(3e-3, 4750.0, load))
        feeds[load] = float(action[0])
    assert feeds[400.0] < feeds[5000.0]


def test_a_fixed_feed_is_held_to_its_share_of_the_reserve() -> None:
    for reserve, feed in ((2.0e4, 4500.0), (6.0e3, 3000.0)):
        drill = Drill(3.4e-3, 5.5e3, 0.35, 1.5, 2.0, reserve)
        action = Reserve(drill, 4500.0, 0.5).act(_hole(0.0, 0.0))
        assert FEED_N + FEED_RANGE_N * float(action[0]) == pytest.approx(feed)


def test_the_rule_hauls_the_rope_that_is_left_for_both() -> None:
    """Loads of 28 kN on 45 degrees: 28 kN are wanted of the right rope, which has 13; the left may
    have slipped only.
    """
    loads = {f"estimate_own_{leg}": 7000.0 for leg in ("fl", "fr", "rl", "rr")}
    still = {"rope_tension_left": 1.3e4, "rope_tension_right": 1.3e4, "attitude_pitch": -np.pi / 4}
    whole = {f"control.pull_change_{side}": 0.0 for side in ("left", "right")}
    cut = whole | {"control.pull_change_left": -1.3e4}
    rule = Hauling()
    assert not rule.act(observed(KEEP_TABLE, **loads, **still, **whole)).any()
    action = rule.act(observed(KEEP_TABLE, **loads, **still, **cut))
    assert action[1] == 1.0 and action[0] > 0.5 and not action[2:].any()
    tight = observed(KEEP_TABLE, **loads, **still, **cut | {"control.pull_change_right": 1.5e4})
    assert rule.act(tight)[1] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("slope_deg", [40, 60])
def test_the_secure_pull_asks_no_more_of_friction_before_a_loss_than_after_it(
    slope_deg: float,
) -> None:
    """Of friction without end 4/3 of the slope's pull: a third too much before, a third too little
    after a rope parts.
    """
    slope = float(np.tan(np.radians(slope_deg)))
    assert secure_share(slope, 10.0) == pytest.approx(4.0 / 3.0)
    held = secure_share(slope, 0.3)
    assert 1.0 < held < 4.0 / 3.0 and (held - 1.0) * slope <= 0.3


def test_the_secure_agent_pulls_before_anything_happens() -> None:
    loads = {f"estimate_own_{leg}": 7000.0 for leg in ("fl", "fr", "rl", "rr")}
    still = {"rope_tension_left": 1.3e4, "rope_tension_right": 1.3e4, "attitude_pitch": -np.pi / 4}
    whole = {f"control.pull_change_{side}": 0.0 for side in ("left", "right")}
    action = Secure().act(observed(KEEP_TABLE, **loads, **still, **whole))
    assert action[0] == pytest.approx(action[1]) and 0.0 < action[0] <= 1.0
    assert not action[2:].any()
    heavy = loads | {"estimate_own_fl": 1.2e4, "estimate_own_rr": 1.2e4}
    evened = Secure().act(observed(KEEP_TABLE, **heavy, **still, **whole))[2:]
    assert evened[0] < 0.0 and not evened[1:].any()


def test_the_yielding_agent_goes_down_as_far_as_the_rope_has_to_stretch() -> None:
    """28 kN on 45 degrees, 13 kN in the rope that is left: what is lacking over its stiffness,
    within a step; nothing while both hold, nothing where the rope bears all.
    """
    loads = {f"estimate_own_{leg}": 7000.0 for leg in ("fl", "fr", "rl", "rr")}
    still = {"rope_tension_left": 1.3e4, "rope_tension_right": 1.3e4, "attitude_pitch": -np.pi / 4}
    shifts = {}
    for right in (0.0, 1.1e4, 1.4e4):
        agent = Yielding(relied_on=0.1)
        whole = {f"control.pull_change_{side}": 0.0 for side in ("left", "right")}
        assert agent.act(observed(KEEP_TABLE, **loads, **still, **whole))[4] == 0.0
        cut = {"control.pull_change_left": -1.3e4, "control.pull_change_right": right}
        shifts[right] = float(agent.act(observed(KEEP_TABLE, **loads, **still, **cut))[4])
    lacking = 2.8e4 - 0.1 * 2.8e4 - 2.4e4
    assert shifts[1.1e4] == pytest.approx(-lacking / ROPE_N_M / STEP_S / SHIFT_SPEED_M_S, rel=0.02)
    assert shifts[0.0] == -1.0 and shifts[1.4e4] == 0.0


def test_the_yielding_agent_pulls_less_where_its_pull_drags_the_feet() -> None:
    """18 kN are wanted of either rope, which had 13: 12 mm of rope that brought 3 kN were stretched
    and more is hauled; of 30 mm that brought 1.5 kN most came from the feet, and some is let out.
    """
    loads = {f"estimate_own_{leg}": 7000.0 for leg in ("fl", "fr", "rl", "rr")}
    still = {"rope_tension_left": 1.3e4, "rope_tension_right": 1.3e4, "attitude_pitch": -np.pi / 4}
    ropes = {}
    for hauled, gained in ((0.012, 3e3), (0.03, 1.5e3)):
        agent = Yielding()
        for way, change in ((0.0, 0.0), (hauled, gained)):
            seen = {f"control.pull_change_{side}": change for side in ("left", "right")}
            seen |= {f"orders.hauled_{side}": way for side in ("left", "right")}
            action = agent.act(observed(KEEP_TABLE, **loads, **still, **seen))
        ropes[hauled] = action[:2]
    assert (ropes[0.012] > 0.0).all() and (ropes[0.03] < 0.0).all()


def test_the_search_climbs_a_hill_and_never_forgets_its_best() -> None:
    """Of a parabola with its top at (1, -2): 200 plans come within a tenth of it."""
    found = search(
        lambda p, _: -float((p[0] - 1.0) ** 2 + (p[1] + 2.0) ** 2),
        ((0.0, 0.0),),
        (1.0, 1.0),
        200,
        1,
    )
    assert found.score > -0.01 and len(found.history) == 200
    assert list(found.history) == sorted(found.history)
    assert found.history[-1] == found.score


def test_a_plan_that_is_given_up_below_the_floor_changes_nothing_of_what_is_found() -> None:
    """A score that is known only where it reaches the floor, against one that always is; the first
    number is the same in each round of eight plans.
    """
    plans: list[tuple[float, ...]] = []

    def whole(plan: np.ndarray, floor: float) -> float:
        plans.append(tuple(plan))
        return -float(((plan - 1.0) ** 2).sum())

    def given_up(plan: np.ndarray, floor: float) -> float:
        true = -float(((plan - 1.0) ** 2).sum())
        return true if true >= floor else floor - 1e-6

    given = (((0.0, 0.0),), (1.0, 1.0), 41, 3, 1)
    assert search(whole, *given) == search(given_up, *given)
    rounds = np.array(plans[1:])[:, 0].reshape(5, 8)
    assert (rounds == rounds[:, :1]).all() and len(set(rounds[:, 0])) == 5


def test_the_plan_of_an_episode_says_what_was_pulled_raised_and_given() -> None:
    """28 kN on 45 degrees: 16.8 kN a rope before the left one parts, 25.2 kN of the right one then;
    the diagonal of the lost rope's front foot raised by 3 mm, the front by 2, the body down by 10,
    20 and 30 mm after 0.1, 0.2 and 0.4 s. Who carries that plan out has nothing to haul there.
    """
    loads = {f"estimate_own_{leg}": 7000.0 for leg in ("fl", "fr", "rl", "rr")}
    still = {"rope_tension_left": 1.4e4, "rope_tension_right": 1.4e4, "attitude_pitch": -np.pi / 4}

    def seen(left: float, right: float, raised_m: tuple[float, float], shift: float) -> np.ndarray:
        pulls = {"control.pull_change_left": left, "control.pull_change_right": right}
        orders = dict(zip(("orders.diagonal", "orders.front"), raised_m, strict=True))
        return observed(KEEP_TABLE, **loads, **still, **pulls, **orders, **{"orders.shift": shift})

    stood = [seen(2.8e3, 2.8e3, (0.001, 0.0), 0.0)]
    lost = [
        seen(-1.4e4, 1.12e4, (0.001 + 0.001 * min(k, 3), 0.001 * min(k, 2)), shift)
        for k, shift in enumerate((0.0, -0.005, -0.01, -0.015, -0.02, -0.02, -0.02, -0.025, -0.03))
    ]
    plan = keep_plan_of(stood + lost)
    assert plan == pytest.approx((1.2, 0.9, STEP_S, 3.0, 2.0, 10.0, 20.0, 30.0), rel=0.02)
    assert keep_plan_of(stood * 5) == ()
    agent = KeepPlan(np.array(plan))
    assert agent.act(stood[0])[:2] == pytest.approx(0.0, abs=0.05)
    assert agent.act(lost[0])[1] == pytest.approx(0.0, abs=0.05)


def test_the_search_begins_again_at_what_an_entrant_did_better(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A hill with its top far from where the first plans lie: an entrant near it is found and
    passed; one that did worse than the first search starts nothing.
    """

    class Hill:
        def __init__(self, *given: object) -> None:
            self.ends = {}

        def score(self, plan: np.ndarray, floor: float) -> float:
            score = -float(np.abs(plan - 100.0).max())
            self.ends[score] = {"score": score}
            return score

    monkeypatch.setattr(episodes, "Branches", Hill)
    alone = best_found(TASKS["keep"], 1, 16)
    near = {"score": -2.0, "plan": (101.9,) * 8}
    led = best_found(TASKS["keep"], 1, 16, [near, {"score": -1.0, "plan": ()}])
    assert alone["score"] < -90.0 and not alone["restarted"]
    assert led["score"] >= -2.0 and led["restarted"]
    worse = best_found(TASKS["keep"], 1, 16, [{"score": -200.0, "plan": (300.0,) * 8}])
    assert worse == alone


def test_a_plan_of_a_climb_is_one_decision_for_each_half_and_within_the_limits() -> None:
    agent, seen = ClimbPlan(np.array([0.1, 0.2, 0.3, -0.4, 0.5, 3.0])), np.zeros(3, np.float32)
    decided = [agent.act(seen) for _ in range(TURN + 2)]
    assert all(action == pytest.approx([0.1, 0.2, 0.3]) for action in decided[:TURN])
    assert all(action == pytest.approx([-0.4, 0.5, 1.0]) for action in decided[TURN:])
    other = agent.with_plan(np.zeros(6))
    assert not other.act(seen).any() and agent.act(seen)[2] == 1.0


@pytest.fixture
def short_climb(monkeypatch: pytest.MonkeyPatch) -> Iterator[Task]:
    """The task of climbing in episodes of 15 s instead of a minute."""
    short, (entry, own) = "Roboclimber/ShortClimb-v1", envs.ENVIRONMENTS["Roboclimber/Climb-v1"]
    monkeypatch.setitem(envs.ENVIRONMENTS, short, (entry, {**own, "duration_s": 15.0}))
    gymnasium.register(id=short, entry_point=entry, kwargs=envs.ENVIRONMENTS[short][1])
    yield replace(TASKS["climb"], environment=short)
    del gymnasium.registry[short]


@pytest.mark.slow
def test_a_plan_of_a_climb_scores_the_same_again_and_beats_the_shipped_gait(
    short_climb: Task,
) -> None:
    task, seed = short_climb, 203
    assert task.plans is not None
    branches = Branches(task, task.plans, seed)
    as_it_is, longer = (np.array(plan) for plan in task.plans.starts[:2])
    first, other, again = (branches.score(p, -math.inf) for p in (as_it_is, longer, as_it_is))
    assert first == again != other
    assert first == episode(task, task.entrants["brisk crawl"], seed)["score"]
    assert first > 2.0 * episode(task, task.entrants["flowing crawl"], seed)["score"] > 10.0


@pytest.mark.slow
def test_plans_that_part_at_the_fault_score_as_whole_episodes_do() -> None:
    """Two plans with the same pull before the fault, tried one after the other, score what each
    scores alone from the beginning; a floor that is out of reach ends an episode below it.
    """
    task, seed = TASKS["keep"], 203
    assert task.plans is not None
    first, second = (np.array(plan) for plan in task.plans.starts[:2])
    branches = Branches(task, task.plans, seed)
    found = [branches.score(plan, -math.inf) for plan in (first, second)]
    alone = [Branches(task, task.plans, seed).score(plan, -math.inf) for plan in (first, second)]
    assert found == alone and found[0] != found[1]
    assert max(found) <= branches.score(first, max(found) + 0.1) < max(found) + 0.1
    entrant = task.entrants["yielding legs"]
    assert episode(task, entrant, seed) == episode(task, entrant, seed)


def test_headroom_and_what_is_closed_of_it_by_hand() -> None:
    """Rule 2, oracle 4 (and 3 where an entrant did better): means 2 and 3.5, headroom 75 %; 3
    closes two thirds.
    """
    scores = {
        "hauling rule": (2.0, 2.0),
        "secure pull": (1.0, 1.0),
        "other": (3.0, 3.0),
        ORACLE: (4.0, 2.5),
    }
    end = {"verdict": "stood", "held": False, "caught_s": 0.5, "history": (3.0, 3.25)}
    answers = [
        {"task": "keep", "entrant": name, "seed": k, "score": value, **end}
        for name, values in scores.items()
        for k, value in enumerate(values)
    ]
    found = summary("keep", answers)
    assert found["headroom"] == pytest.approx(0.75) and found["beaten"] == 0.5
    assert found["entrants"]["other"]["closed"] == pytest.approx(2.0 / 3.0)
    assert found["entrants"][ORACLE]["closed"] == pytest.approx(1.0)
    assert found["doubling"] == pytest.approx(3.25 / 3.0 - 1.0) and found["left"] == 0
    fewer = summary("keep", [a for a in answers if (a["entrant"], a["seed"]) != ("other", 1)])
    other = fewer["entrants"]["other"]
    assert (other["cases"], other["mean"]) == (1, 3.0) and other["closed"] == pytest.approx(0.5)
    sure = found["entrants"]["other"]
    assert sure["closed_low"] <= sure["closed"] <= sure["closed_high"] and sure["caught_s"] is None
    held = [answer | {"held": answer["seed"] == 1} for answer in answers]
    fewer = summary("keep", held)
    assert (fewer["cases"], fewer["left"]) == (1, 1)
    assert fewer["entrants"]["other"]["closed"] == pytest.approx(0.5)


def test_a_case_is_a_drawn_machine_and_its_mark_says_who_tries_it_and_the_budget() -> None:
    tasks = ControlTasks(("keep",), number=2)
    cases = tasks.cases()
    assert {case.seed - SCORING_SEED for case in cases.values()} == {0, 1}
    assert f"keep {SCORING_SEED}" in cases
    case = Case("keep", SCORING_SEED)
    policies = ("some/learned/policy.npz",)
    made = {
        ControlTasks(("keep",), oracle_episodes=budget, policies=files).made_from(case)
        for budget in (8, 16)
        for files in ((), policies)
    }
    assert len(made) == 4
    with pytest.raises(InputError, match="no such task"):
        ControlTasks(("dance",))


def test_a_case_that_the_simple_rule_solves_is_tried_by_nobody_else(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tried: list[str] = []

    def played(task: Task, entrant: Entrant, seed: int) -> dict[str, Any]:
        name = next(name for name, each in task.entrants.items() if each is entrant)
        tried.append(name)
        return {"score": 1.0, "verdict": "stood", "held": seed == 5, "caught_s": 0.1}

    best = {"score": 2.0, "held": True, "caught_s": 0.1, "plan": (), "history": (2.0,)}
    monkeypatch.setattr(benchmark, "episode", played)
    monkeypatch.setattr(benchmark, "best_found", lambda task, seed, budget, others: best)
    tasks = ControlTasks(("keep",))
    names = [[a["entrant"] for a in tasks.work(Case("keep", seed))] for seed in (5, 10)]
    assert names[0] == ["hauling rule"]
    assert (
        set(names[1]) == {*TASKS["keep"].entrants, ORACLE} and len(tried) == 1 + len(names[1]) - 1
    )
