"""A ledger over groups of a test's own making."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from testbed.diagnosis.robot.evidence import RawGroup
from testbed.diagnosis.robot.groups import Balances, Candidate
from testbed.diagnosis.robot.hypotheses import Ledger
from testbed.effects import by_name, kind_of, place_of
from testbed.effects.signature import Change
from testbed.machine.names import AXES


def ledger_of(
    raw: Mapping[str, RawGroup], names: Sequence[str], spread: float | None = None
) -> Ledger:
    """The ledger of gains at cylinders: each a force of 1 at its place; `spread`: their prior size,
    else their own.
    """
    found = {}
    for name in names:
        effect = by_name(kind_of(name))
        place = place_of(name) or ""
        if spread is not None:
            effect = cast(Any, _Wide(effect, spread))
        change = Change(force={AXES.index(place): np.ones(1)})
        found[name] = Candidate(effect, place, {"gain_error": change})
    signatures = {name: candidate.signature for name, candidate in found.items()}
    groups = {key: group.whitened(signatures) for key, group in raw.items()}
    return Ledger(cast(Balances, SimpleNamespace(raw=raw, groups=groups, candidates=found)))


def ledger_of_numbers(raw: RawGroup, name: str, numbers: np.ndarray) -> Ledger:
    """The ledger of one effect with several numbers of size 20: of each the change by `numbers`
    (k, ...), a force that `raw` makes rows of.
    """
    effect = cast(Any, _Wide(by_name(kind_of(name)), 20.0))
    signature = {str(k): Change(force={0: row}) for k, row in enumerate(numbers)}
    found = {name: Candidate(effect, place_of(name) or "", signature)}
    groups = {"forces": raw.whitened({name: signature})}
    balances = SimpleNamespace(raw={"forces": raw}, groups=groups, candidates=found)
    return Ledger(cast(Balances, balances))


def ledger_of_columns(raw: RawGroup, columns: Mapping[str, np.ndarray]) -> Ledger:
    """The ledger of effects, or errors of any course, with one number each: of each the rows
    (rows,) that `raw` misses by one unit, which may be expected to be 1.
    """
    made: dict[int, np.ndarray] = {}
    found = {}
    for name, rows in columns.items():
        place = place_of(name) or ""
        change = Change(force={AXES.index(place): rows})
        made[id(change)] = rows
        found[name] = Candidate(cast(Any, _OfSizeOne()), place, {"number": change})
    whole = replace(raw, rows_of=lambda change: made[id(change)])
    groups = {"forces": whole.whitened({n: c.signature for n, c in found.items()})}
    balances = SimpleNamespace(raw={"forces": whole}, groups=groups, candidates=found)
    return Ledger(cast(Balances, balances))


class _OfSizeOne:
    """An effect whose numbers may be expected to be 1, of either sign."""

    looked_for = 1.0

    def spread(self, number: str) -> float:
        """One."""
        return 1.0

    def grows(self, number: str, scale: object) -> float:
        """Nothing."""
        return 1.0

    def least(self, number: str) -> float:
        """None."""
        return -np.inf

    def overrides(self, method: str) -> bool:
        """Any number is possible."""
        return False


class _Wide:
    """An effect with another prior."""

    def __init__(self, effect: Any, spread: float) -> None:
        self._effect, self._spread = effect, spread

    def __getattr__(self, name: str) -> Any:
        return getattr(self._effect, name)

    def spread(self, number: str) -> float:
        """The prior."""
        return self._spread
