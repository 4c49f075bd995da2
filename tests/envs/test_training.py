"""Training: names, checkpoints, resuming, one-line refusals."""

from __future__ import annotations

import importlib.util
import io
import os
import pickle
from collections.abc import Callable
from pathlib import Path
from zipfile import ZipFile

import gymnasium
import numpy as np
import pytest
from PIL import Image, ImageSequence

from testbed.control.distribution.controllers import Learned
from testbed.control.distribution.corrected import VIEW
from testbed.envs import ENVIRONMENTS, NAMES, named
from testbed.envs.policies import OPTIMISER, WEIGHTS, play, read_policy, read_tensors
from testbed.envs.training import MANY_STEPS, Session, latest, settings_of, train
from testbed.errors import InputError
from testbed.formats.files import read_json
from testbed.formats.networks import write_network

HAS_RL = importlib.util.find_spec("stable_baselines3") is not None


def test_every_environment_has_a_name_and_the_newest_version_the_plain_one() -> None:
    assert set(NAMES.values()) == set(ENVIRONMENTS)
    assert named("force-distribution") == "Roboclimber/ForceDistribution-v0"
    assert named("stand-v0") == named("stand") == named("Roboclimber/Stand-v0")
    with pytest.raises(InputError, match=r"task = .dance.*force-distribution"):
        named("dance", "task")


@pytest.mark.parametrize(
    ("numbers", "said"),
    [({"steps": -5}, "--steps = -5"), ({"steps": 5, "workers": 0}, "--workers = 0")],
)
def test_numbers_that_cannot_be_are_refused_before_anything_is_made(
    tmp_path: Path, numbers: dict[str, int], said: str
) -> None:
    with pytest.raises(InputError, match=said):
        train("stand", tmp_path / "t", **numbers)
    assert not (tmp_path / "t").exists()


def test_rounds_of_a_training_have_episodes_of_their_own_whatever_the_session() -> None:
    first, second, other = (
        Session(Path("t"), "stand", seed, number, 2) for seed, number in ((0, 0), (0, 1), (1, 0))
    )
    assert len({first.seed_at(0), first.seed_at(64), other.seed_at(0)}) == 3
    assert first.seed_at(64) == second.seed_at(64)
    assert len({session.episodes(k) for session in (first, second) for k in range(2)}) == 4


def _checkpoint() -> bytes:
    """A checkpoint as the library makes it: an archive whose parts are archives."""
    part, whole = io.BytesIO(), io.BytesIO()
    with ZipFile(part, "w") as file:
        file.writestr("archive/data.pkl", "1")
    with ZipFile(whole, "w") as file:
        for name in (OPTIMISER, WEIGHTS):
            file.writestr(name, part.getvalue())
    return whole.getvalue()


def test_the_latest_checkpoint_has_the_most_steps_not_the_last_name(tmp_path: Path) -> None:
    assert latest(tmp_path) is None
    (tmp_path / "checkpoints").mkdir()
    for steps in (9000, 10_000, 500):
        (tmp_path / "checkpoints" / f"policy_{steps}_steps.zip").write_bytes(_checkpoint())
    found = latest(tmp_path)
    assert found is not None and found.name == "policy_10000_steps.zip"


@pytest.mark.parametrize("name", [".policy_8000_steps.zip", "policy_8000_steps.zip"])
def test_a_checkpoint_killed_at_any_byte_leaves_the_one_before(tmp_path: Path, name: str) -> None:
    folder, whole = tmp_path / "checkpoints", _checkpoint()
    folder.mkdir()
    (folder / "policy_4000_steps.zip").write_bytes(whole)
    for length in range(len(whole)):
        (folder / name).write_bytes(whole[:length])
        found = latest(tmp_path)
        assert found is not None and found.name == "policy_4000_steps.zip", length


@pytest.mark.skipif(HAS_RL, reason="the extra `rl` is installed")
def test_without_the_library_the_command_that_installs_it_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="pip install"):
        train("stand", tmp_path, 1)


@pytest.mark.rl
@pytest.mark.slow
@pytest.mark.skipif(not HAS_RL, reason="the extra `rl` is not installed")
def test_training_goes_on_where_it_was_and_the_policy_plays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(MANY_STEPS, "n_steps", 128)
    monkeypatch.setitem(MANY_STEPS, "batch_size", 64)
    policy = train("stand", tmp_path / "t", 128)
    first = latest(tmp_path / "t")
    assert first is not None and first.name == "policy_128_steps.zip"
    train("stand", tmp_path / "t", 200)
    second = latest(tmp_path / "t")
    assert second is not None and second.name == "policy_256_steps.zip"
    (tmp_path / "short.yaml").write_text(
        "format: roboclimber-scenario/1\nduration_s: 2\nrobot: {vertical_m: 0.25}\n"
    )
    assert policy.name == "policy.npz"
    arrays, tensors = (read_policy(policy.with_suffix(end))[1] for end in (".npz", ".zip"))
    view = np.linspace(-1.0, 1.0, arrays.inputs)
    assert arrays.answer(view) == pytest.approx(tensors.answer(view), abs=1e-12)
    played = play(policy, str(tmp_path / "short.yaml"), video=tmp_path / "seen.gif")
    assert played["simulated_s"] > 1.0 and played["verdict"] in ("stood", "slid", "fell")
    with Image.open(tmp_path / "seen.gif") as video:
        assert video.size == (480, 360)
        lasts_s = sum(frame.info["duration"] for frame in ImageSequence.Iterator(video)) / 1000.0
        assert abs(lasts_s - played["simulated_s"]) <= 0.4  # frames that are alike are one
    with pytest.raises(InputError, match="another training"):
        train("drill", tmp_path / "t", 512)


@pytest.mark.rl
@pytest.mark.slow
@pytest.mark.skipif(not HAS_RL, reason="the extra `rl` is not installed")
def test_several_workers_train_new_episodes_after_a_resume_and_the_plotter_reads_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Episodes of 0.2 s: two sessions of two workers leave four files, and no reward twice."""
    pytest.importorskip("pandas", reason="the plotter of stable_baselines3 needs it")
    from stable_baselines3.common.results_plotter import load_results

    monkeypatch.setitem(MANY_STEPS, "n_steps", 32)
    monkeypatch.setitem(MANY_STEPS, "batch_size", 32)
    out = tmp_path / "t"
    for steps in (64, 128):
        train("stand", out, steps, seed=3 if steps == 64 else None, workers=2, duration_s=0.2)
    training = read_json(out / "training.json")
    assert training["seed"] == 3 and training["sessions"] == 2 * [{"workers": 2}]
    assert len(list((out / "episodes").glob("*.monitor.csv"))) == 4
    told = load_results(str(out / "episodes"))
    assert len(told) >= 8 and told["r"].nunique() == len(told)
    assert (told["t"].diff().dropna() >= 0.0).all()
    with pytest.raises(InputError, match="holds another training, of seed 3"):
        train("stand", out, 192, seed=4)


@pytest.mark.rl
@pytest.mark.slow
@pytest.mark.skipif(not HAS_RL, reason="the extra `rl` is not installed")
def test_an_interrupted_training_is_saved_and_goes_on_to_the_bits_of_one_that_was_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rounds of 64 steps; interrupted in the second and in the third of them."""
    monkeypatch.setitem(MANY_STEPS, "n_steps", 64)
    monkeypatch.setitem(MANY_STEPS, "batch_size", 64)
    monkeypatch.setattr("testbed.envs.training.ROUND_STEPS", 64)

    def interrupt(at: int) -> Callable[[int], None]:
        def report(steps: int) -> None:
            if steps == at:
                raise KeyboardInterrupt

        return report

    out = tmp_path / "t"
    for at, kept in ((100, 64), (170, 128)):
        with pytest.raises(KeyboardInterrupt):
            train("stand", out, 256, progress=interrupt(at))
        saved = latest(out)
        assert saved is not None and saved.name == f"policy_{kept}_steps.zip"
        assert read_policy(out / "policy.npz")[0] == "stand"
    train("stand", out, 256)
    train("stand", tmp_path / "whole", 256)
    assert (out / "policy.npz").read_bytes() == (tmp_path / "whole" / "policy.npz").read_bytes()
    weights = [
        read_tensors(place / "checkpoints" / "policy_256_steps.zip", OPTIMISER)["state"]
        for place in (out, tmp_path / "whole")
    ]
    for mine, theirs in zip(*(w.values() for w in weights), strict=True):
        assert np.array_equal(mine["exp_avg"].numpy(), theirs["exp_avg"].numpy())


@pytest.mark.rl
@pytest.mark.slow
@pytest.mark.skipif(not HAS_RL, reason="the extra `rl` is not installed")
def test_the_written_arrays_act_as_the_trained_policy_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from stable_baselines3 import PPO

    monkeypatch.setitem(MANY_STEPS, "n_steps", 64)
    monkeypatch.setitem(MANY_STEPS, "batch_size", 64)
    policy = train("force-distribution", tmp_path / "t", 64)
    model, learned = PPO.load(policy.with_suffix(".zip"), device="cpu"), Learned(policy)
    rng = np.random.default_rng(0)
    for _ in range(5):
        view = rng.uniform(-1.0, 1.0, len(VIEW)).astype(np.float32)
        assert learned.action(view.astype(float)) == pytest.approx(
            model.predict(view, deterministic=True)[0], abs=1e-5
        )


@pytest.mark.rl
@pytest.mark.slow
@pytest.mark.skipif(not HAS_RL, reason="the extra `rl` is not installed")
def test_training_that_goes_on_takes_over_weights_optimiser_and_steps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The next step of a training that was taken up again is that of one whose library unpickled
    everything.
    """
    from stable_baselines3 import PPO

    from testbed.envs.training import _take_over

    monkeypatch.setitem(MANY_STEPS, "n_steps", 64)
    monkeypatch.setitem(MANY_STEPS, "batch_size", 64)
    train("force-distribution", tmp_path / "t", 64)
    checkpoint = latest(tmp_path / "t")
    assert checkpoint is not None
    whole = PPO.load(checkpoint, device="cpu")
    ours = PPO(
        "MlpPolicy", named("force-distribution"), device="cpu", **settings_of("force-distribution")
    )
    _take_over(ours, checkpoint)
    assert ours.num_timesteps == whole.num_timesteps == 64
    for wanted, found in zip(whole.policy.parameters(), ours.policy.parameters(), strict=True):
        assert np.array_equal(wanted.detach().numpy(), found.detach().numpy())
    states = [list(m.policy.optimizer.state_dict()["state"].values()) for m in (whole, ours)]
    for wanted, found in zip(*states, strict=True):
        assert np.array_equal(wanted["exp_avg"].numpy(), found["exp_avg"].numpy())


@pytest.mark.rl
@pytest.mark.skipif(not HAS_RL, reason="the extra `rl` is not installed")
def test_a_zip_with_a_pickled_object_is_refused_and_does_not_run(tmp_path: Path) -> None:
    import torch

    from testbed.formats.files import write_json

    class Evil:
        def __reduce__(self) -> tuple[object, tuple[str]]:
            return os.mkdir, (str(tmp_path / "ran"),)

    inside = io.BytesIO()
    torch.save({"action_net.weight": Evil()}, inside)
    with ZipFile(tmp_path / "policy.zip", "w") as archive:
        archive.writestr("policy.pth", inside.getvalue())
        archive.writestr("data", pickle.dumps(Evil()))
    write_json(tmp_path / "training.json", {"task": "stand"})
    with pytest.raises(InputError, match=r"policy\.zip: is no policy: it has no safe"):
        play(tmp_path / "policy.zip", "stand_flat")
    assert not (tmp_path / "ran").exists()


def test_a_policy_of_arrays_plays_without_the_library_and_one_of_another_task_is_refused(
    tmp_path: Path,
) -> None:
    write_network(
        tmp_path / "policy.npz",
        {"weight_0": np.zeros((3, 4)), "bias_0": np.zeros(3)},
        task="stand",
    )
    with pytest.raises(InputError, match="is no policy of this task"):
        play(tmp_path / "policy.npz", "stand_flat")
    env = gymnasium.make(named("stand"))
    sizes = env.action_space.shape[0], env.observation_space.shape[0]
    env.close()
    arrays = {"weight_0": np.zeros(sizes), "bias_0": np.zeros(sizes[0])}
    write_network(tmp_path / "policy.npz", arrays, task="stand")
    (tmp_path / "short.yaml").write_text("format: roboclimber-scenario/1\nduration_s: 0.2\n")
    assert play(tmp_path / "policy.npz", str(tmp_path / "short.yaml"))["simulated_s"] > 0.1


@pytest.mark.parametrize("task", ["keep", "climb"])
@pytest.mark.slow
def test_a_policy_plays_a_scenario_as_long_as_it_is_written(task: str, tmp_path: Path) -> None:
    """Not as long, nor with as many steps, as its training's episodes."""
    env = gymnasium.make(named(task))
    inputs, outputs = env.observation_space.shape[0], env.action_space.shape[0]
    env.close()
    arrays = {"weight_0": np.zeros((outputs, inputs)), "bias_0": np.zeros(outputs)}
    write_network(tmp_path / "policy.npz", arrays, task=task)
    kind = "{kind: crawl, steps: 1, start_s: 0.3}" if task == "climb" else "{kind: stand}"
    text = "format: roboclimber-scenario/1\nterrain: {slope_deg: 45}\nduration_s: 5\n"
    (tmp_path / "mine.yaml").write_text(f"{text}task: {kind}\n")
    told = play(tmp_path / "policy.npz", str(tmp_path / "mine.yaml"))
    assert told["verdict"] == "stood"
    assert told["simulated_s"] == pytest.approx(5.0, abs=0.1)
