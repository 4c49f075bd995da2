"""The one list of named effects: the simulator, the estimators and the diagnosis all read it.

Every file of this folder with a tuple `EFFECTS` adds to the list: a new effect is one new file.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

from testbed.effects.active import Active
from testbed.effects.base import MARK, Effect
from testbed.effects.unnamed import UNNAMED
from testbed.errors import InputError
from testbed.machine.model import Machine
from testbed.recording.axis import Recording
from testbed.recording.leg_model import EffectEntry, LegModel, Parameter, read_model


def _found() -> Iterator[Effect]:
    for module in iter_modules(__path__, f"{__name__}."):
        yield from getattr(import_module(module.name), "EFFECTS", ())


ALL: tuple[Effect, ...] = tuple(_found())
"""Every effect that has a name, by alphabet."""

OF_A_CYLINDER: tuple[Effect, ...] = tuple(effect for effect in ALL if effect.rigs)
"""Those that recordings of a single axis can show: the names that the diagnosis of a rig may
give.
"""

_TABLE: dict[str, Effect] = {effect.kind: effect for effect in (*ALL, UNNAMED)}


def kind_of(name: str) -> str:
    """The effect's own name, without its place."""
    return name.partition(MARK)[0]


def place_of(name: str) -> str | None:
    """The place in an effect's name; None for one that acts everywhere."""
    return name.partition(MARK)[2] or None


def by_name(name: str, file: str | Path | None = None, field: str = "name") -> Effect:
    """The effect of that name, `name@place` for one axis alone. Raises InputError with the names
    there are.
    """
    kind, place = kind_of(name), place_of(name)
    if kind not in _TABLE:
        raise InputError(
            "no effect has that name", file=file, field=field, value=name, allowed=", ".join(_TABLE)
        )
    return _TABLE[kind].at(place) if place else _TABLE[kind]


def of_declared(number: str) -> Effect:
    """The effect by which a declared number of a rig (a field of `Known`) may be other than
    declared.
    """
    return next(effect for effect in ALL if effect.declared_as == number)


def declared_by(machine: Machine) -> tuple[Active, ...]:
    """Effects that the machine's own numbers declare for all cylinders alike: they are no
    findings.
    """
    given = [(effect, effect.declared_by(machine)) for effect in ALL]
    return tuple(
        Active(effect, effect.complete(values)) for effect, values in given if values is not None
    )


def build(entries: Iterable[EffectEntry], file: str | Path | None = None) -> tuple[Active, ...]:
    """A model file's effects, checked. Raises InputError for an unknown name, parameter or a value
    out of bounds.
    """
    return tuple(_active(entry, f"effects.{index}", file) for index, entry in enumerate(entries))


def _active(entry: EffectEntry, field: str, file: str | Path | None) -> Active:
    effect = by_name(entry.name, file, f"{field}.name")
    if not effect.rigs:
        raise InputError(
            "is an effect that worlds have and no model can believe in",
            file=file,
            field=f"{field}.name",
            value=entry.name,
            allowed=", ".join(e.name for e in (*OF_A_CYLINDER, UNNAMED)),
        )
    return Active(effect, complete(effect, entry.parameters, file, f"{field}.parameters"))


def complete(
    effect: Effect,
    parameters: Mapping[str, Parameter],
    file: str | Path | None = None,
    field: str | None = None,
) -> dict[str, float]:
    """A file's parameters of an effect, checked against its bounds and units, with defaults for
    further shapes. Raises InputError.
    """
    values = {name: parameter.value for name, parameter in parameters.items()}
    found = effect.complete(values, file, field)
    for name, parameter in parameters.items():
        unit = effect.spec(name).unit
        if parameter.unit not in (None, unit, *unit.split(" or ")):
            raise InputError(
                "wrong unit",
                file=file,
                field=f"{field or effect.name}.{name}.unit",
                value=parameter.unit,
                allowed=unit,
            )
    return found


def check_channels(model: LegModel, recording: Recording) -> None:
    """Refuse a recording without a channel that an effect of the model's forces needs: the effect
    would be left out without a word.
    """
    for active in build(model.effects):
        missing = [name for name in active.effect.needs if name not in recording.header.channels]
        if missing and "force" in active.effect.seen_in:
            raise InputError(
                f"is not recorded: {active.effect.name} of the model needs it",
                file=recording.folder / "recording.yaml",
                field=f"channels.{missing[0]}",
            )


def read_believed(path: str | Path) -> LegModel:
    """Read a model file whose effects are checked too. Raises InputError naming file, entry and
    value.
    """
    model = read_model(path)
    for active in build(model.effects, path):
        for number in active.effect.needs_known:
            if getattr(model.known, number) is None:
                raise InputError(
                    f"is missing: {active.effect.name} needs it",
                    file=path,
                    field=f"known.{number}",
                )
    return model
