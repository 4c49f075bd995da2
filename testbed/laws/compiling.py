"""How the laws of the hydraulics are compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from testbed.compiled import njit

FAST = frozenset({"contract", "arcp", "nsz"})
"""Fused multiply-add, reciprocals, no care for the sign of zero: nothing that lets NaN or infinity
get lost.
"""


def njit_law(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """`njit` for a law: arithmetic as FAST allows."""
    return njit(function, fastmath=set(FAST), **options)
