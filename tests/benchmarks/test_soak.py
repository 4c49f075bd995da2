"""The soak: its mutator is seeded and changes something, its judge sees what is wrong, and a short
one finds nothing.
"""

from __future__ import annotations

import numpy as np
import pytest
import yaml
from testbed.benchmarks.soak.trials import judged

from testbed.benchmarks.harness import answers
from testbed.benchmarks.soak.benchmark import Soak
from testbed.benchmarks.soak.mutations import damaged, mutated

TREE = {"a": 1.5, "b": {"c": [1, 2], "d": "word"}, "e": None}


def test_the_mutator_is_seeded_changes_a_copy_and_writes_what_yaml_can_carry() -> None:
    found = [mutated(TREE, np.random.default_rng(seed)) for seed in range(200)]
    again = [mutated(TREE, np.random.default_rng(seed)) for seed in range(200)]
    assert repr(found) == repr(again) and TREE["a"] == 1.5
    assert sum(tree != TREE for tree in found) > 190 and len({repr(t) for t in found}) > 100
    assert all(yaml.safe_dump(tree) for tree in found)


def test_bytes_are_cut_or_changed() -> None:
    content = bytes(range(256)) * 4
    found = [damaged(content, np.random.default_rng(seed)) for seed in range(50)]
    assert all(bytes(f) != content for f in found)
    assert {len(f) == len(content) for f in found} == {True, False}


@pytest.mark.parametrize(
    ("arguments", "outcome"),
    [(("parameters", "--json"), "served"), (("run", "no_such_scenario"), "refused")],
)
def test_the_judge_knows_service_from_refusal(arguments: tuple[str, ...], outcome: str) -> None:
    assert judged(*arguments) == (outcome, "")


def test_the_judge_sees_a_traceback_and_a_hang(monkeypatch: pytest.MonkeyPatch) -> None:
    assert judged("run", "no_such_scenario", "--debug")[0] == "fell over"
    monkeypatch.setattr("testbed.benchmarks.soak.trials.LIMIT_S", 0.05)
    assert judged("parameters")[0] == "hung"


@pytest.mark.long
def test_a_short_soak_finds_nothing_wrong() -> None:
    soak = Soak(trials=5)
    assert soak.summarise(answers(soak))["wrong"] == {}
