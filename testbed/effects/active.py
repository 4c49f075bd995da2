"""An effect with the values that a model believes in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from testbed.effects.base import Effect
from testbed.effects.terms import FlowTerms, ForceTerms, Signals


@dataclass(frozen=True)
class Active:
    """An effect with its checked parameters, further shapes filled with their defaults.

    As a model believes in it: where it does not sit, nothing changes.
    """

    effect: Effect
    values: Mapping[str, float]

    def correct(self, signals: Signals) -> Signals:
        """What the sensors of this axis should have read."""
        here = self.effect.concerns(signals)
        return self.effect.correct(signals, self.values) if here else signals

    def force(self, signals: Signals, terms: ForceTerms) -> None:
        """Change the believed force balance of this axis."""
        if self.effect.concerns(signals):
            self.effect.force(signals, terms, self.values)

    def flow(self, signals: Signals, terms: FlowTerms) -> None:
        """Change the believed flow balance of this axis."""
        if self.effect.concerns(signals):
            self.effect.flow(signals, terms, self.values)
