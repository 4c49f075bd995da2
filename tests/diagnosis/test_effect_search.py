"""How two sets of effects are compared in the search."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from testbed.diagnosis.leg.evidence import Evidence
from testbed.diagnosis.leg.search import _ahead

KEY = ("force", "sine")


def tried(log_likelihood: float, memory: float, price: float = 0.0) -> Any:
    """A set of effects: held-out log-likelihood, its own correlation time in bins, its price."""
    known = Evidence({KEY: log_likelihood}, {KEY: 1.0}, {KEY: 1.0}, {KEY: memory}, {KEY: 1000})
    return SimpleNamespace(evidence=known, cost=price)


STATE: Any = SimpleNamespace(price=lambda candidate: candidate.cost)


@pytest.mark.parametrize(
    ("candidate", "ahead"),
    [
        (tried(9000.0, 1.0), True),
        (tried(5000.0, 80.0), False),  # 3000 / 80 behind, and 400 cheaper
        (tried(8003.0, 1.0, 400.0), False),
    ],
)
def test_a_cheaper_set_that_leaves_long_memories_is_not_ahead_of_a_good_description(
    candidate: Any, ahead: bool
) -> None:
    assert _ahead(candidate, tried(8000.0, 1.0, 400.0), STATE) is ahead
