"""A correction of the secure pull: what it adds, and how it is learnt, on made-up readings and a
known hill.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from testbed.benchmarks.control_tasks import evolution
from testbed.benchmarks.control_tasks.agents import STEP_S, Secure
from testbed.benchmarks.control_tasks.corrected import FEATURES, OVER, REACH, Corrected
from testbed.benchmarks.control_tasks.episodes import episode
from testbed.benchmarks.control_tasks.evolution import SHAPE, correction, evolve
from testbed.benchmarks.control_tasks.tasks import TASKS, Entrant, trained
from testbed.cli.models import train
from testbed.envs.observations import KEEP_TABLE
from testbed.errors import InputError
from testbed.formats.networks import read_network, write_network
from tests.benchmarks.control_tasks.test_control_tasks import observed

LOADS = {f"estimate_own_{leg}": 7000.0 for leg in ("fl", "fr", "rl", "rr")}
STILL = {"rope_tension_left": 1.3e4, "rope_tension_right": 1.3e4, "attitude_pitch": -np.pi / 4}
WHOLE = {f"control.pull_change_{side}": 0.0 for side in ("left", "right")}


def lost(side: str, **further: float) -> np.ndarray:
    cut = {f"control.pull_change_{side}": -1.3e4}
    return observed(KEEP_TABLE, **{**LOADS, **STILL, **WHOLE, **cut, **further})


def both() -> np.ndarray:
    return observed(KEEP_TABLE, **LOADS, **STILL, **WHOLE)


def test_weights_of_zero_are_the_secure_pull() -> None:
    rule, agent = Secure(), Corrected(correction(np.zeros(SHAPE)))
    for seen in (
        both(),
        both(),
        lost("left"),
        lost("left"),
        lost("left", **{"orders.shift": 0.02}),
    ):
        assert agent.act(seen) == pytest.approx(rule.act(seen), abs=1e-7)


def test_nothing_is_corrected_while_both_ropes_hold() -> None:
    agent = Corrected(correction(np.ones(SHAPE)))
    assert agent.act(both()) == pytest.approx(Secure().act(both()), abs=1e-7)


def test_a_loss_on_the_right_is_answered_as_the_mirrored_one_on_the_left() -> None:
    weights = 0.2 * np.random.default_rng(0).standard_normal(SHAPE)
    actions = {}
    for side, turn in (("left", 1.0), ("right", -1.0)):
        agent = Corrected(correction(weights))
        uneven = {"angular_rate_z": 0.02 * turn}
        uneven |= {
            "estimate_own_fl": 7000.0 + 900.0 * turn,
            "estimate_own_fr": 7000.0 - 900.0 * turn,
        }
        agent.act(both())
        actions[side] = agent.act(lost(side, **uneven))
    left, right = actions["left"], actions["right"]
    assert right[[0, 1]] == pytest.approx(left[[1, 0]], abs=1e-6)
    assert right[2:] == pytest.approx(left[2:] * [-1.0, 1.0, 1.0], abs=1e-6)
    assert abs(left[2]) > 0.0 and left[4] != 0.0


def _hill(task: str, case: int, weights: list[np.ndarray]) -> tuple[list[float], int]:
    """A paraboloid with its top where every weight is 0.5, raised or lowered by the case."""
    del task
    return [case / 1e4 - float(((each - 0.5) ** 2).sum()) for each in weights], 100


def test_the_mean_climbs_a_hill_whatever_the_cases_are_worth(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(evolution, "_scores", _hill)
    policy = evolve("keep", tmp_path / "t", 400 * 150)
    found, words = read_network(policy)
    (weight, bias), *_ = found.layers
    assert np.abs(np.column_stack([weight, bias]) - 0.5).max() < 0.2
    assert words["over"] == OVER and words["task"] == "keep"


def test_a_training_that_was_killed_at_any_generation_ends_with_the_same_weights(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(evolution, "_scores", _hill)
    whole = evolve("keep", tmp_path / "whole", 2000, seed=3)
    calls = 0

    def dies(task: str, case: int, weights: list[np.ndarray]) -> tuple[list[float], int]:
        nonlocal calls
        calls += 1
        if calls == 7:
            raise KeyboardInterrupt
        return _hill(task, case, weights)

    monkeypatch.setattr(evolution, "_scores", dies)
    with pytest.raises(KeyboardInterrupt):
        evolve("keep", tmp_path / "killed", 2000, seed=3)
    again = evolve("keep", tmp_path / "killed", 2000)
    for name in ("weight_0", "bias_0"):
        assert np.array_equal(np.load(whole)[name], np.load(again)[name])
    episodes = [(tmp_path / name / "episodes.csv").read_text() for name in ("whole", "killed")]
    assert episodes[0] == episodes[1] and episodes[0].count("\n") == 21


@pytest.mark.slow
def test_a_try_that_goes_on_from_the_fault_is_the_whole_episode_to_the_last_bit() -> None:
    """Weights of zero score what the secure pull does in one go; others score something else."""
    some = np.zeros(SHAPE)
    some[3, -1] = -0.5
    (rule, other, again), steps = evolution._scores("keep", 50_001, [np.zeros(SHAPE), some, some])
    assert rule == episode(TASKS["keep"], Entrant(lambda env: Secure()), 50_001)["score"]
    assert other == again != rule
    assert 1.4 / STEP_S < steps < 3 * 80


def test_what_cannot_be_learnt_so_is_refused_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(InputError, match=r"task = 'drill-hole'.*has no rule.*keep"):
        train("drill-hole", tmp_path / "t", method="evolution")
    with pytest.raises(InputError, match=r"--workers.*one process"):
        train("keep", tmp_path / "t", workers=2, method="evolution")
    with pytest.raises(InputError, match=r"--method = 'luck'.*ppo, evolution"):
        train("keep", tmp_path / "t", method="luck")
    assert not (tmp_path / "t").exists()
    monkeypatch.setattr(evolution, "_scores", _hill)
    evolve("keep", tmp_path / "mine", 100, seed=1)
    with pytest.raises(InputError, match="holds another training, of seed 1"):
        evolve("keep", tmp_path / "mine", 100, seed=2)
    (tmp_path / "mine" / "state.npz").write_bytes(b"no archive")
    with pytest.raises(InputError, match=r"state\.npz.*no state of a training"):
        evolve("keep", tmp_path / "mine", 1000)


def test_a_policy_that_does_not_fit_the_rule_is_no_entrant(tmp_path: Path) -> None:
    def written(name: str, inputs: int, over: str) -> Path:
        arrays = {"weight_0": np.zeros((len(REACH), inputs)), "bias_0": np.zeros(len(REACH))}
        write_network(tmp_path / name, arrays, task="keep", over=over)
        return tmp_path / name

    fits = trained(written("fits.npz", len(FEATURES), OVER), "keep")
    assert isinstance(fits.make(None), Corrected)
    for file in (written("narrow.npz", 3, OVER), written("other.npz", len(FEATURES), "luck")):
        with pytest.raises(InputError, match="corrects no rule"):
            trained(file, "keep")
