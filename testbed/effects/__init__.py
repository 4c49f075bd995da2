"""The one list of named effects: the simulator, the estimators and the diagnosis all read it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from testbed.effects import (
    force_cushion,
    force_periodic,
    force_spring,
    friction_load,
    friction_position,
    friction_presliding,
    friction_pressure,
    friction_temperature,
    hydraulics_air,
    hydraulics_hose,
    inertia_mass,
    leakage_internal,
    sensor_delay,
    sensor_drift_a,
    sensor_gain,
    sensor_line_b,
    supply_droop,
    unnamed,
    valve_deadband,
)
from testbed.effects.base import Effect, FlowTerms, ForceTerms, ParameterSpec, Signals
from testbed.effects.placed import at, kind_of, place_of
from testbed.errors import InputError
from testbed.recording.leg_model import EffectEntry, LegModel, read_model

ALL: tuple[Effect, ...] = (
    friction_position.EFFECT,
    friction_pressure.EFFECT,
    friction_load.EFFECT,
    friction_presliding.EFFECT,
    friction_temperature.EFFECT,
    inertia_mass.EFFECT,
    force_spring.EFFECT,
    force_periodic.EFFECT,
    force_cushion.EFFECT,
    sensor_gain.GAIN_A,
    sensor_gain.GAIN_B,
    sensor_drift_a.EFFECT,
    sensor_line_b.EFFECT,
    sensor_delay.EFFECT,
    leakage_internal.EFFECT,
    hydraulics_air.EFFECT,
    hydraulics_hose.EFFECT,
    valve_deadband.EFFECT,
    supply_droop.EFFECT,
)
"""The names that a diagnosis may give, in the contract's order."""

NAMES: tuple[str, ...] = tuple(effect.name for effect in ALL)
_TABLE: dict[str, Effect] = {effect.name: effect for effect in (*ALL, unnamed.EFFECT)}


@dataclass(frozen=True)
class Active:
    """An effect with its checked parameters, further shapes filled with their defaults."""

    effect: Effect
    values: Mapping[str, float]


def by_name(name: str, file: str | Path | None = None, field: str = "name") -> Effect:
    """The effect of that name, `name@place` for one axis alone. Raises InputError with the names there are."""
    kind, place = kind_of(name), place_of(name)
    if kind not in _TABLE:
        raise InputError(
            "no effect has that name", file=file, field=field, value=name, allowed=", ".join(_TABLE)
        )
    return at(_TABLE[kind], place) if place else _TABLE[kind]


def check(entry: Mapping[str, Any], file: str | Path | None = None) -> Active:
    """A `{name, parameters}` mapping (a scenario's `undeclared:` entry) as a checked effect. Raises InputError.

    A parameter may be a plain number or a mapping with `value`; keys `leg`, `joint`, `place` are the caller's.
    """
    unknown = set(entry) - {"name", "parameters", "leg", "joint", "place"}
    if unknown:
        raise InputError(
            f"unknown key {sorted(unknown)[0]!r}",
            file=file,
            field="effects",
            allowed="name, parameters, place",
        )
    if "name" not in entry:
        raise InputError("an effect needs a name", file=file, allowed=", ".join(_TABLE))
    effect = by_name(str(entry["name"]), file)
    given = entry.get("parameters") or {}
    if not isinstance(given, Mapping):
        raise InputError(
            "must be a mapping", file=file, field=f"{effect.name}.parameters", value=given
        )
    values = {str(k): v.get("value") if isinstance(v, Mapping) else v for k, v in given.items()}
    return Active(effect, effect.complete(values, file))


def build(entries: Iterable[EffectEntry], file: str | Path | None = None) -> tuple[Active, ...]:
    """A model file's effects, checked. Raises InputError for an unknown name, parameter or a value out of bounds."""
    return tuple(_active(entry, f"effects.{k}", file) for k, entry in enumerate(entries))


def _active(entry: EffectEntry, field: str, file: str | Path | None) -> Active:
    effect = by_name(entry.name, file, f"{field}.name")
    return Active(effect, effect.complete(entry.values, file, f"{field}.parameters"))


def read_believed(path: str | Path) -> LegModel:
    """Read a model file whose effects are checked too. Raises InputError naming file, entry and value."""
    model = read_model(path)
    build(model.effects, path)
    return model


__all__ = [
    "ALL",
    "NAMES",
    "Active",
    "Effect",
    "FlowTerms",
    "ForceTerms",
    "ParameterSpec",
    "Signals",
    "at",
    "build",
    "by_name",
    "check",
    "kind_of",
    "place_of",
    "read_believed",
]
