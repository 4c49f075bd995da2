"""The soak: its mutator is seeded and changes something, its judge sees what is wrong, what was
killed goes on to the same bits, and a short one finds nothing.
"""

from __future__ import annotations

import importlib.util
import os
import signal
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
import yaml

from testbed.benchmarks.harness import answers
from testbed.benchmarks.soak import interrupted, sandbox, spoilt_files
from testbed.benchmarks.soak.bad_conditions import _broken, _with_clock
from testbed.benchmarks.soak.benchmark import KINDS, Soak, growth_mb, split
from testbed.benchmarks.soak.sandbox import Ended, forked
from testbed.benchmarks.soak.spoilt_files import damaged, mutated
from testbed.errors import InputError, SimulationFault

TREE = {"a": 1.5, "b": {"c": [1, 2], "d": "word"}, "e": None}
HAS_RL = importlib.util.find_spec("stable_baselines3") is not None


def test_the_mutator_is_seeded_changes_a_copy_and_writes_what_yaml_can_carry() -> None:
    found = [mutated(TREE, np.random.default_rng(seed)) for seed in range(200)]
    again = [mutated(TREE, np.random.default_rng(seed)) for seed in range(200)]
    assert repr(found) == repr(again) and TREE["a"] == 1.5
    assert sum(tree != TREE for tree in found) > 190 and len({repr(t) for t in found}) > 100
    assert all(yaml.safe_dump(tree) for tree in found)
    numbers_alone = [tree for tree in found if tree.keys() == TREE.keys() and tree["e"] is None]
    assert 60 < sum(isinstance(t["b"], dict) and len(t["b"]) == 2 for t in numbers_alone) < 190


def test_bytes_are_cut_or_changed() -> None:
    content = bytes(range(256)) * 4
    found = [damaged(content, np.random.default_rng(seed)) for seed in range(50)]
    assert all(bytes(f) != content for f in found)
    assert {len(f) == len(content) for f in found} == {True, False}


@pytest.mark.parametrize(
    ("status", "said", "outcome", "wrong"),
    [
        (0, "", "served", False),
        (3, "", "served", False),
        (2, "testbed: a.yaml: no such file\n", "refused", False),
        (1, "testbed: broke down\n", "fault of the simulation", False),
        (2, "", "unclear", True),
        (1, "testbed: a fault of ours: KeyError: 1\n", "fell over", True),
        (1, "Traceback (most recent call last):\n", "fell over", True),
        (-11, "", "fell over", True),
        (None, "", "hung", True),
    ],
)
def test_the_judge_knows_service_refusal_and_a_fall(
    status: int | None, said: str, outcome: str, wrong: bool
) -> None:
    found = Ended(status, said).judged
    assert found[0] == outcome and bool(found[1]) == wrong


@pytest.fixture
def cold(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is imported beforehand: these trials need nothing."""
    monkeypatch.setattr(sandbox, "_warm", lambda: None)


def _raise(error: BaseException) -> None:
    raise error


@pytest.mark.usefixtures("cold")
@pytest.mark.parametrize(
    ("work", "outcome"),
    [
        (lambda: None, "served"),
        (lambda: _raise(InputError("no\nsuch thing")), "refused"),
        (lambda: _raise(SimulationFault("not finite")), "fault of the simulation"),
        (lambda: _raise(KeyError("x")), "fell over"),
        (lambda: os.kill(os.getpid(), signal.SIGTERM), "fell over"),
        (lambda: sys.exit(4), "fell over"),
        (lambda: bytearray(sandbox.MOST_MEMORY + 1), "fell over"),
    ],
)
def test_a_fork_is_judged_by_how_it_ends(work: sandbox.Work, outcome: str) -> None:
    assert forked(work).judged[0] == outcome


@pytest.mark.usefixtures("cold")
def test_a_fork_that_hangs_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sandbox, "LIMIT_S", 0.05)
    assert forked(lambda: time.sleep(60)).judged[0] == "hung"


@pytest.mark.usefixtures("cold")
def test_a_patched_clock_jumps_both_ways_and_only_there() -> None:
    def work() -> None:
        seen = [time.time() for _ in range(50)]
        steps = np.diff(seen)
        assert steps.min() < -3600.0 < 3600.0 < steps.max()

    assert forked(lambda: _with_clock(1, work)).judged == ("served", "")
    assert abs(time.time() - time.time()) < 60.0


def test_a_file_that_is_half_there_is_seen(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text('{"a": 1')
    (tmp_path / "b.json").write_text('{"a": 1}')
    assert "half there" in _broken(tmp_path / "a.json") and not _broken(tmp_path / "b.json")


def test_growth_is_what_comes_after_the_warm_up() -> None:
    assert growth_mb([100.0, 180.0, *[180.0] * 98]) == 0.0
    assert growth_mb([180.0] * 50 + [180.0 + k for k in range(20)]) == 19.0
    assert growth_mb([100.0, 180.0]) == 0.0


def test_what_the_report_takes_is_no_growth_of_the_run() -> None:
    """The first part of the recording begins what is counted, the last one ends it."""
    assert split([1.0, 2.0, 3.0, 90.0, 99.0], [0, 1, 2, 2, 0]) == ([2.0, 3.0], [90.0, 99.0])
    assert split([1.0, 2.0], [0, 0]) == ([1.0, 2.0], [])


def test_kinds_take_turns_and_one_that_there_is_not_is_refused() -> None:
    soak = Soak(trials=100, hours=0.0)
    names = list(soak.cases())
    assert {name.rpartition(" ")[0] for name in names[: len(KINDS) + 1]} >= set(KINDS)
    assert sum(name.startswith("scenario") for name in names) == 100
    assert list(Soak(trials=2, hours=12.0, only=("hours of drilling",)).cases()) == [
        "hours of drilling 12"
    ]
    with pytest.raises(InputError, match="--only = 'kill': no such kind"):
        Soak(only=("kill",))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["run", "sweep", "benchmark"])
def test_what_was_killed_goes_on_to_the_same_bits(kind: str, tmp_path: Path) -> None:
    work = KINDS[f"killed {kind}"][0]
    assert work(tmp_path, np.random.default_rng(7)) == ("killed, same bits", "")


@pytest.mark.rl
@pytest.mark.slow
@pytest.mark.skipif(not HAS_RL, reason="the extra `rl` is not installed")
def test_a_training_that_was_killed_goes_on_to_the_same_bits(tmp_path: Path) -> None:
    assert interrupted.killed_training(tmp_path, np.random.default_rng(7)) == (
        "killed, same bits",
        "",
    )


@pytest.mark.long
def test_a_commissioning_that_was_killed_goes_on_to_the_same_bits(tmp_path: Path) -> None:
    found = interrupted.killed_commissioning(tmp_path, np.random.default_rng(7))
    assert found == ("killed, same bits", "")


@pytest.mark.slow
def test_a_short_soak_finds_nothing_wrong() -> None:
    """Of every kind but those that take minutes; 0.005 h of drilling are 18 s."""
    only = tuple(kind for kind in KINDS if kind not in ("killed training", "killed commissioning"))
    soak = Soak(trials=1, hours=0.005, only=(*only, "random actions", "hours of drilling"))
    assert soak.summarise(answers(soak))["wrong"] == {}


@pytest.mark.slow
def test_what_is_spoilt_is_served_before(tmp_path: Path) -> None:
    """Of files that are refused as they are, nothing would be tried by changing them."""
    whole = tmp_path / "whole.yaml"
    whole.write_text(yaml.safe_dump(spoilt_files.SWEEP))
    spoilt_files._unfolds(whole)
    served = []
    for name, tree in (("robot", spoilt_files.ROBOT_MODEL), ("leg", spoilt_files.LEG_MODEL)):
        whole.write_text(yaml.safe_dump(tree))
        with suppress(InputError):
            spoilt_files._runs("stand_slope_45", whole)
            served.append(name)
    assert served == ["robot", "leg"]
