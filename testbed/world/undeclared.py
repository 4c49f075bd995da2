"""Undeclared effects of a scenario, put into the world's arrays. The model never sees them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from testbed.errors import InputError
from testbed.laws import columns as c
from testbed.machine.names import AXES, LEGS
from testbed.scenario.parts import Undeclared
from testbed.world import sensing

Array = NDArray[np.float64]


@dataclass
class Places:
    """The world's arrays that an effect may change."""

    params: Array
    unit: Array
    transducers: Array
    step_s: float
    leg_mass_kg: dict[int, float]
    """Mass added to a leg's sliding frame, by leg."""


Law = Callable[[Places, int, Mapping[str, float]], None]


def _column(column: int, name: str, factor: float = 1.0) -> Law:
    def put(w: Places, axis: int, p: Mapping[str, float]) -> None:
        w.params[axis, column] = factor * p[name]

    return put


def _added(column: int, name: str) -> Law:
    def put(w: Places, axis: int, p: Mapping[str, float]) -> None:
        w.params[axis, column] += p[name]

    return put


def _columns(**pairs: str) -> Law:
    def put(w: Places, axis: int, p: Mapping[str, float]) -> None:
        for column, name in pairs.items():
            w.params[axis, getattr(c, column)] = p[name]

    return put


def _periodic(w: Places, axis: int, p: Mapping[str, float]) -> None:
    w.params[axis, c.PERIODIC_N] = p["amplitude"]
    w.params[axis, c.PERIODIC_W] = 2 * math.pi * p["frequency"]


def _line_b(w: Places, axis: int, p: Mapping[str, float]) -> None:
    w.params[axis, c.LINE_WN] = 2 * math.pi * p["natural_frequency"]
    w.params[axis, c.LINE_ZETA] = p["damping"]


def _mass(w: Places, axis: int, p: Mapping[str, float]) -> None:
    w.leg_mass_kg[axis // 3] = w.leg_mass_kg.get(axis // 3, 0.0) + p["mass"]


def _gain(offset: int) -> Law:
    def put(w: Places, axis: int, p: Mapping[str, float]) -> None:
        w.transducers[axis + offset, sensing.GAIN] = 1.0 + p["gain_error"]

    return put


def _drift_a(w: Places, axis: int, p: Mapping[str, float]) -> None:
    w.transducers[axis, sensing.DRIFT] = p["rate"]


def _delay(w: Places, axis: int, p: Mapping[str, float]) -> None:
    steps = round(p["delay"] / w.step_s)
    if steps >= sensing.DELAY_LENGTH:
        raise InputError(
            "is longer than the world can hold back",
            field="undeclared sensor.delay.delay",
            value=p["delay"],
            allowed=f"< {sensing.DELAY_LENGTH * w.step_s:g} s",
        )
    w.transducers[[axis, axis + len(AXES)], sensing.DELAY_STEPS] = steps


def _droop(w: Places, axis: int, p: Mapping[str, float]) -> None:
    w.unit[c.DROOP], w.unit[c.DROOP_TIME] = p["droop"], p["time"]


LAWS: dict[str, Law] = {
    "friction.position": _column(c.FR_POSITION, "slope"),
    "friction.pressure": _added(c.FR_PRESSURE, "coefficient"),
    "friction.load": _added(c.FR_LOAD, "coefficient"),
    "friction.presliding": _columns(BRISTLE_K="stiffness", BRISTLE_D="damping"),
    "friction.temperature": _column(c.EXTRA_VISC_RATE, "rate"),
    "inertia.mass": _mass,
    "force.spring": _columns(SPRING_K="stiffness", SPRING_REST="rest"),
    "force.periodic": _periodic,
    "force.cushion": _columns(XCUSHION_K="stiffness", XCUSHION_START="start"),
    "sensor.gain_a": _gain(0),
    "sensor.gain_b": _gain(len(AXES)),
    "sensor.drift_a": _drift_a,
    "sensor.line_b": _line_b,
    "sensor.delay": _delay,
    "leakage.internal": _added(c.LEAK_I, "coefficient"),
    "hydraulics.air": _added(c.AIR, "fraction"),
    "hydraulics.hose": _columns(HOSE_CAP="capacity", HOSE_TIME="time"),
    "valve.deadband": _added(c.DEADBAND, "deadband"),
    "supply.droop": _droop,
}
"""Name of an effect -> how the world takes it on at one axis."""


class _Asked(dict[str, float]):
    """Parameters that know which of them a law has asked for."""

    def __init__(self, values: Mapping[str, float]) -> None:
        super().__init__(values)
        self.names: set[str] = set()

    def __getitem__(self, name: str) -> float:
        self.names.add(name)
        return super().__getitem__(name)


def apply_undeclared(entries: Sequence[Undeclared], places: Places) -> None:
    """Put every entry into the arrays. A leg stands for its vertical joint, `body` and `supply` for all axes.

    Raises InputError for an effect, parameter or place that cannot be.
    """
    from testbed import effects

    for k, entry in enumerate(entries):
        field = f"undeclared.{k}"
        if entry.effect not in LAWS:
            raise InputError(
                "no such effect",
                field=f"{field}.effect",
                value=entry.effect,
                allowed=", ".join(LAWS),
            )
        effect = effects.by_name(entry.effect)
        values = _Asked(effect.complete(entry.parameters, field=f"{field}.parameters"))
        for axis in axes_of(entry.at, f"{field}.at"):
            LAWS[entry.effect](places, axis, values)
        for spec in effect.parameters:
            if (
                spec.default is not None
                and spec.name not in values.names
                and values[spec.name] != spec.default
            ):
                raise InputError(
                    "is a shape that the simulated machine does not have",
                    field=f"{field}.parameters.{spec.name}",
                    value=values[spec.name],
                    allowed=f"{spec.default:g}",
                )


def axes_of(place: str, field: str) -> list[int]:
    """Axis indices of a place: `fl_vertical`, `fl` (its vertical joint), `body` or `supply` (all twelve)."""
    if place in AXES:
        return [AXES.index(place)]
    if place in LEGS:
        return [AXES.index(f"{place}_vertical")]
    if place in ("body", "supply"):
        return list(range(len(AXES)))
    raise InputError(
        "no effect of a cylinder can sit there",
        field=field,
        value=place,
        allowed=", ".join([*AXES, *LEGS, "body", "supply"]),
    )
