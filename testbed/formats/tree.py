"""Nested mappings as flat ones: dotted paths of their leaves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def flattened(
    tree: Mapping[str, Any], prefix: str = "", lists: bool = False
) -> list[tuple[str, Any]]:
    """(dotted path, value) of every leaf of nested mappings.

    Lists are left out, or with `lists` go on with the number of each entry.
    """
    out: list[tuple[str, Any]] = []
    for key, value in tree.items():
        path = f"{prefix}{key}"
        if isinstance(value, Mapping):
            out += flattened(value, f"{path}.", lists)
        elif not isinstance(value, (list, tuple)):
            out.append((path, value))
        elif lists:
            out += flattened(
                {str(index): entry for index, entry in enumerate(value)}, f"{path}.", lists
            )
    return out
