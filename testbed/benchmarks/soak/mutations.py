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
Tree = dict[str, Any]


def mutated(tree: Tree, rng: np.random.Generator) -> Tree:
    """A copy of the tree with one to three changes: another value, another size, a key less or one
    too many.
    """
    found = copy.deepcopy(tree)
    for _ in range(int(rng.integers(1, 4))):
        holders = _holders(found)
        holder, key = holders[int(rng.integers(len(holders)))]
        way, value = rng.random(), holder[key]
        if isinstance(value, int | float) and abs(value) < 1e200 and way < 0.5:
            holder[key] = value * FACTORS[int(rng.integers(len(FACTORS)))]
        elif way < 0.85:
            holder[key] = copy.deepcopy(VALUES[int(rng.integers(len(VALUES)))])
        elif isinstance(holder, dict) and way < 0.92:
            holder[f"{key}x"] = value
        else:
            del holder[key]
    return found


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
