"""An effect at one of several like axes: `sensor.gain_a@fl_vertical` acts on that axis' signals alone."""

from __future__ import annotations

from dataclasses import replace

from testbed.effects.base import Effect, FlowTerms, ForceTerms, Signals, Values

MARK = "@"


def kind_of(name: str) -> str:
    """The effect's own name, without its place."""
    return name.partition(MARK)[0]


def place_of(name: str) -> str | None:
    """The place in an effect's name; None for one that acts everywhere."""
    return name.partition(MARK)[2] or None


def at(effect: Effect, place: str) -> Effect:
    """The effect at one place: its laws leave every other axis as it is."""
    correct, force, flow = effect.correct, effect.force, effect.flow

    def correct_here(signals: Signals, values: Values) -> Signals:
        return (
            correct(signals, values) if correct is not None and signals.place == place else signals
        )

    def force_here(signals: Signals, terms: ForceTerms, values: Values) -> None:
        if force is not None and signals.place == place:
            force(signals, terms, values)

    def flow_here(signals: Signals, terms: FlowTerms, values: Values) -> None:
        if flow is not None and signals.place == place:
            flow(signals, terms, values)

    return replace(
        effect,
        name=f"{effect.name}{MARK}{place}",
        correct=correct_here if correct is not None else None,
        force=force_here if force is not None else None,
        flow=flow_here if flow is not None else None,
    )
