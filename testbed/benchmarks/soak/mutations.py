"""What a careless or hostile hand does to a file: a seeded mutator of trees and of bytes."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np

VALUES: tuple[Any, ...] = (
    *(0, -1, 1, 1e-30, 1e30, 10**400, float("nan"), float("inf"), True, None, ""),
    *("a" * 5000, "a<script>", "../../x", "mine.py:Mine", [], {}, [1, 2, 3], {"a": 1}, [[[[]]]]),
)
"""What stands in for a value."""
FACTORS = (-1.0, 0.0, 1e-3, 0.9, 1.1, 1e3, 1e9)
"""What a number is multiplied by."""
NEAR = (0.5, 0.8, 0.95, 1.05, 1.3, 2.0)
"""What a careless hand multiplies it by; most of it can be used, and shows what follows."""
Tree = dict[str, Any]


def mutated(tree: Tree, rng: np.random.Generator) -> Tree:
    """A copy of the tree with one to three changes: of numbers alone in half the trials; in the
    others another value, another size, a key less or one too many.
    """
    found = copy.deepcopy(tree)
    careless = rng.random() < 0.5
    for _ in range(int(rng.integers(1, 4))):
        holders = _holders(found)
        numbers = [held for held in holders if _is_number(held[0][held[1]])]
        if careless and numbers:
            holder, key = numbers[int(rng.integers(len(numbers)))]
            holder[key] *= NEAR[int(rng.integers(len(NEAR)))]
        else:
            _spoil(*holders[int(rng.integers(len(holders)))], rng)
    return found


def _spoil(holder: Any, key: Any, rng: np.random.Generator) -> None:
    """Change one value of a mapping or list beyond what anybody means."""
    way, value = rng.random(), holder[key]
    if _is_number(value) and way < 0.5:
        holder[key] = value * FACTORS[int(rng.integers(len(FACTORS)))]
    elif way < 0.85:
        holder[key] = copy.deepcopy(VALUES[int(rng.integers(len(VALUES)))])
    elif isinstance(holder, dict) and way < 0.92:
        holder[f"{key}x"] = value
    else:
        del holder[key]


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and abs(value) < 1e200


def _holders(tree: Any) -> list[tuple[Any, Any]]:
    """(mapping or list, key) of every value of the tree; of an emptied one, a new key of it."""
    found: list[tuple[Any, Any]] = []
    keys = tree.keys() if isinstance(tree, dict) else range(len(tree))
    for key in list(keys):
        found.append((tree, key))
        if isinstance(tree[key], dict | list):
            found += _holders(tree[key])
    if not found and isinstance(tree, dict):
        tree["x"] = 1
        found.append((tree, "x"))
    return found


def damaged(content: bytes, rng: np.random.Generator) -> bytes:
    """The bytes cut off somewhere, or with some of them changed."""
    if rng.random() < 0.4:
        return content[: int(rng.integers(len(content)))]
    found = bytearray(content)
    for place in rng.integers(len(found), size=int(rng.integers(1, 20))):
        found[place] = int(rng.integers(256))
    return bytes(found)
