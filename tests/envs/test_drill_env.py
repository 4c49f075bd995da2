"""The drilling environment: its table, its seeds, its actions."""

from __future__ import annotations

import ctypes
import gc
import math
from pathlib import Path

import gymnasium
import numpy as np
import pytest

import testbed.envs  # noqa: F401  (registers the environments)
from testbed.envs.observations import TABLE, Observer, as_markdown, in_units
from testbed.envs.randomisation import draw_overrides, named_set, sets
from testbed.errors import InputError
from testbed.scenario.scenario import load_scenario

DRILL = "Roboclimber/Drill-v0"


def _steps(env: gymnasium.Env, count: int, seed: int) -> list[np.ndarray]:
    env.action_space.seed(seed)
    seen = [env.reset(seed=seed)[0]]
    for _ in range(count):
        seen.append(env.step(env.action_space.sample())[0])
    return seen


def test_same_seed_same_bits_other_seed_others() -> None:
    env = gymnasium.make(DRILL, duration_s=5.0, randomisation="drill").unwrapped
    first, again, other = _steps(env, 8, 7), _steps(env, 8, 7), _steps(env, 8, 8)
    env.close()
    assert np.array_equal(np.array(first), np.array(again))
    assert not np.array_equal(np.array(first), np.array(other))


def test_observations_of_two_calls_share_no_memory() -> None:
    env = gymnasium.make(DRILL, duration_s=5.0).unwrapped
    first, info_first = env.reset(seed=1)
    second, _, _, _, info_second = env.step(np.zeros(6, dtype=np.float32))
    env.close()
    assert not np.shares_memory(first, second)
    assert not np.shares_memory(info_first["loads_n"], info_second["loads_n"])


def test_an_observation_is_what_the_table_says() -> None:
    """At rest on 45 degrees: pitch -45 degrees, 4 t standing with 27.7 kN on the slope less the
    ropes' pull into it.
    """
    env = gymnasium.make(DRILL, duration_s=5.0).unwrapped
    observation, info = env.reset(seed=3)
    env.close()
    values = in_units(observation)
    assert len(TABLE) == len(observation) == env.observation_space.shape[0]
    assert values["attitude_pitch"] == pytest.approx(-np.pi / 4, abs=2e-3)
    assert values["position_fl_vertical"] == pytest.approx(0.25, abs=2e-3)
    assert info["loads_n"].sum() == pytest.approx(4000 * 9.81 * np.cos(np.pi / 4), rel=0.05)
    loads = sum(values[f"estimate_own_{leg}"] for leg in ("fl", "fr", "rl", "rr"))
    assert loads == pytest.approx(info["loads_n"].sum(), rel=0.1)
    assert as_markdown().count("\n") == len(TABLE) + 1


def test_the_observer_maps_each_range_to_minus_one_and_one() -> None:
    names = [row.column for row in TABLE if not row.column.startswith("orders.")]
    observer = Observer(names)
    for end, wanted in (("low", -1.0), ("high", 1.0)):
        values = np.array(
            [getattr(row, end) for row in TABLE if not row.column.startswith("orders.")]
        )
        orders = {r.column: getattr(r, end) for r in TABLE if r.column.startswith("orders.")}
        assert observer.observe(values, orders) == pytest.approx(np.full(len(TABLE), wanted))


def test_truth_is_in_no_row_of_the_table() -> None:
    from testbed.world.simulation import DATA_COLUMNS, TRUTH_COLUMNS

    names = {row.column for row in TABLE if not row.column.startswith("orders.")}
    assert names <= set(DATA_COLUMNS)
    assert not names & (set(TRUTH_COLUMNS) - {"t", "supply_pressure", "oil_temperature"})


def test_the_rope_follows_its_wanted_pull() -> None:
    """Ten actions of +1 ask for 2000 N more; the traction device has brought most of them a second
    later.
    """
    env = gymnasium.make(DRILL, duration_s=5.0).unwrapped
    before = in_units(env.reset(seed=1)[0])["rope_tension_left"]
    for k in range(60):
        pull = 1.0 if k < 10 else 0.0
        observation = env.step(np.array([0, 0, 0, 0, pull, 0], dtype=np.float32))[0]
    env.close()
    assert in_units(observation)["orders.pull_left"] == pytest.approx(before + 2000, abs=30)
    assert in_units(observation)["rope_tension_left"] == pytest.approx(before + 2000, abs=300)


def test_raising_one_cylinder_loads_its_diagonal() -> None:
    """The four loads have one free direction, an internal force: +0.5 mm on fl and rr takes load
    off fr and rl.
    """
    env = gymnasium.make(DRILL, duration_s=5.0).unwrapped
    before = env.reset(seed=1)[1]["loads_n"]
    for k in range(25):
        share = 1.0 if k < 5 else 0.0
        info = env.step(np.array([share, -share, -share, share, 0, 0], dtype=np.float32))[4]
    env.close()
    change = info["loads_n"] - before
    assert change[[0, 3]].min() > 500.0
    assert change[[1, 2]].max() < -500.0


def test_wrong_arguments_are_refused_in_one_line() -> None:
    for wrong in (
        {"scenario": "no_such"},
        {"overrides": ["terrain.slope_deg=95"]},
        {"randomisation": "no_such"},
        {"step_ms": 15},
        {"randomisation": {"terrain.slope_deg": {"normal": [0, 1]}}},
    ):
        with pytest.raises(InputError) as caught:
            gymnasium.make(DRILL, **wrong)
        assert "\n" not in str(caught.value)


def test_an_action_that_is_not_finite_is_refused() -> None:
    env = gymnasium.make(DRILL, duration_s=2.0).unwrapped
    env.reset(seed=1)
    with pytest.raises(InputError, match="finite"):
        env.step(np.full(6, np.nan, dtype=np.float32))
    env.close()


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[] if name == "climb" else pytest.mark.slow)
        for name in sorted(sets())
    ],
)
def test_every_draw_of_a_set_is_a_scenario(name: str) -> None:
    """And an effect as often as the set says, give or take 4 standard deviations."""
    rng = np.random.default_rng(0)
    draws = [draw_overrides(named_set(name), rng) for _ in range(300)]
    scenario = {"climb": "crawl_slope_45", "drill_hole": "drill_unknown_rock"}
    for drawn in draws[:20]:
        load_scenario(scenario.get(name, "drill_slope_45"), drawn)
    with_effect = sum("undeclared=[]" not in drawn for drawn in draws)
    if "undeclared" in sets()[name]:
        share = sets()[name]["undeclared"]["probability"]
        assert abs(with_effect - 300 * share) <= 4.0 * math.sqrt(300 * share * (1.0 - share))


def _memory_mb() -> float:
    """What this process occupies, MB, after what it freed was given back: a leak hides in that."""
    gc.collect()
    ctypes.CDLL("libc.so.6").malloc_trim(0)
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 1e6


@pytest.mark.slow
def test_a_draw_that_does_not_stand_is_drawn_again() -> None:
    """Half of the draws have ropes that are off on 60 degrees: no episode begins with them."""
    varied = {"ropes.enabled": {"one_of": [True, False]}, "terrain.slope_deg": {"one_of": [60.0]}}
    env = gymnasium.make(
        "Roboclimber/ForceDistribution-v0", randomisation=varied, duration_s=4.0
    ).unwrapped
    assert {env.reset(seed=seed)[1]["verdict"] for seed in range(2)} == {"stood"}
    with pytest.raises(InputError, match="never stands"):
        env.reset(seed=0, options={"overrides": ["ropes.enabled=false"]})
    env.close()


def _steady_growth_mb(occupied_mb: list[float]) -> float:
    """What the memory grew by in every ten resets at least, after the first fifteen, MB.

    An allocator takes half a megabyte at once now and then: what leaks grows in every ten.
    """
    return float(np.diff(occupied_mb[15::10]).min())


@pytest.mark.slow
def test_memory_does_not_grow_over_resets() -> None:
    """Twenty megabytes in a thousand resets at most; an engine that is left open is 27."""
    env, occupied = gymnasium.make(DRILL, duration_s=2.0).unwrapped, []
    for k in range(46):
        env.reset(seed=k)
        occupied.append(_memory_mb())
    env.close()
    assert _steady_growth_mb(occupied) < 10 * 0.02


def test_a_leak_grows_steadily_and_an_allocators_step_does_not() -> None:
    assert _steady_growth_mb([400.0 + 0.04 * k for k in range(46)]) == pytest.approx(0.4)
    assert _steady_growth_mb([400.0 + 5.0 * (k > 30) for k in range(46)]) == 0.0


@pytest.mark.parametrize("count", [50, pytest.param(4_000, marks=pytest.mark.slow)])
def test_random_actions_never_give_a_number_that_is_not_finite(count: int) -> None:
    env = gymnasium.make(DRILL, step_ms=10).unwrapped
    env.action_space.seed(0)
    env.reset(seed=0)
    for _ in range(count):
        observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
        assert (
            np.isfinite(observation).all()
            and np.isfinite(reward)
            and np.isfinite(info["loads_n"]).all()
        )
        if terminated or truncated:
            env.reset()
    env.close()
