"""Undeclared effects of a scenario, put into the world's arrays. The model never sees them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.effects import by_name
from testbed.effects.base import Effect
from testbed.effects.terms import Hidden, HiddenCylinder
from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.formats.records import get, put
from testbed.laws.oil import ATMOSPHERE_PA
from testbed.machine.names import AXES, LEGS
from testbed.machine.urdf_check import read_urdf
from testbed.robot.urdf.merge import ballasted, rehung
from testbed.scenario.parts import Undeclared
from testbed.world.sensing import DELAY_LENGTH


def hidden_of(entries: Sequence[Undeclared]) -> Hidden:
    """What a scenario's world has and its model lacks.

    A leg stands for its vertical joint; `body` and `supply` for all twelve cylinders where the
    effect is one of a cylinder. Raises InputError for an effect, parameter or place that cannot be.
    """
    world = Hidden()
    for index, entry in enumerate(entries):
        field = f"undeclared.{index}"
        effect = by_name(entry.effect, field=f"{field}.effect")
        values = effect.complete(entry.parameters, field=f"{field}.parameters")
        _refuse_shapes(effect, values, f"{field}.parameters")
        for place in places_of(effect, entry.at, f"{field}.at"):
            effect.hide(world, place, values)
    return world


def hidden_beside(drawn: Sequence[Undeclared], declared: Sequence[Undeclared]) -> Hidden:
    """What the world of a `drawn` machine has that a scenario declares more of.

    Raises InputError as hidden_of, and for an effect of the scenario that another one of it puts
    out of use: of two that replace the same number the later one counts, those that add up both do.
    """
    whole = hidden_of(declared)
    for index, entry in enumerate(declared):
        others = [*declared[:index], *declared[index + 1 :]]
        if others and hidden_of(others) == whole and hidden_of([entry]) != Hidden():
            raise InputError(
                "would have no effect: another undeclared effect replaces what it changes",
                field=f"undeclared.{index}",
                value=f"{entry.effect} at {entry.at}",
                allowed="each such effect once at a place",
            )
    return hidden_of((*drawn, *declared))


def _refuse_shapes(effect: Effect, values: Mapping[str, float], field: str) -> None:
    for name in effect.hidden_shapes():
        default = effect.spec(name).default
        if values[name] != default:
            raise InputError(
                "is a shape that the simulated machine does not have",
                field=f"{field}.{name}",
                value=values[name],
                allowed=f"{default:g}",
            )


def places_of(effect: Effect, place: str, field: str) -> tuple[str, ...]:
    """Where an effect sits that a scenario puts at `place`. Raises InputError where it cannot
    be.
    """
    if place in effect.places:
        return (place,)
    if f"{place}_vertical" in effect.places:
        return (f"{place}_vertical",)
    if effect.places == AXES and place in ("body", "supply"):
        return AXES
    short = LEGS if effect.places == AXES else ()
    whole = ("body", "supply") if effect.places == AXES else ()
    raise InputError(
        f"{effect.name} cannot sit there",
        field=field,
        value=place,
        allowed=", ".join([*effect.places, *short, *whole]),
    )


def put_into_cylinders(world: Hidden, params: NDArray[Any]) -> None:
    """Change the AxisParameters (12,) of the cylinders, in place."""
    for axis, cylinder in world.cylinders.items():
        row = params[AXES.index(axis)]
        for path, value in cylinder.added.items():
            put(row, path, get(row, path) + value)
        for path, value in cylinder.replaced.items():
            put(row, path, value)


def put_into_supply(world: Hidden, unit: Any) -> None:
    """Change the PowerUnit, in place."""
    unit["pump_flow"] *= world.pump_flow_factor
    if world.pump_pressure_factor != 1.0:
        gauge = unit["set_pressure"] - ATMOSPHERE_PA
        unit["set_pressure"] = world.pump_pressure_factor * gauge + ATMOSPHERE_PA
    if world.droop_pa_s_m3 is not None:
        unit["droop"], unit["droop_time"] = world.droop_pa_s_m3, world.droop_s


def put_into_other_sensors(world: Hidden, other: Any) -> None:
    """Change OtherSensors, in place: how the inertial unit sits, encoders' zeros, load pins."""
    other["mounted_roll"] += world.unit_roll_rad
    other["mounted_pitch"] += world.unit_pitch_rad
    other["joint_offset"] += [cylinder.encoder_offset for cylinder in world.cylinders.values()]
    other["play"] = [cylinder.play_rad for cylinder in world.cylinders.values()]
    other["rope_gain"] += [rope.tension_gain_error for rope in world.ropes.values()]
    other["rope_zero"] += [rope.tension_zero_n for rope in world.ropes.values()]


def put_into_sensors(world: Hidden, transducers: NDArray[Any], step_s: float) -> None:
    """Change the pressure transducers (Transducer, (2, 12)), sampled every `step_s`, in place."""
    for axis, cylinder in world.cylinders.items():
        a, b = transducers[:, AXES.index(axis)]
        a["gain"] += cylinder.gain_error_a
        b["gain"] += cylinder.gain_error_b
        a["zero"] += cylinder.zero_a_pa
        b["zero"] += cylinder.zero_b_pa
        for each in (a, b):
            each["hysteresis"] += cylinder.hysteresis_pa
            each["bow"] += cylinder.bow_pa
        if cylinder.drift_a_pa_s is not None:
            a["drift"] = cylinder.drift_a_pa_s
        if cylinder.pressure_delay_s:
            a["delay_steps"] = b["delay_steps"] = _delay_steps(cylinder, step_s)


@contextmanager
def bodies_of(world: Hidden, urdf: Path) -> Iterator[Path]:
    """The URDF of what the world has, for as long as it is read: the machine's own where its body
    hides nothing.
    """
    if not (world.body_masses or world.hinges_m or any(world.centre_of_mass_m)):
        yield urdf
        return
    masses = [(mass.mass_kg, mass.position_m) for mass in world.body_masses]
    with TemporaryDirectory() as folder:
        path = Path(folder) / urdf.name
        hung = rehung(read_urdf(urdf), world.hinges_m)
        path.write_text(ballasted(hung, masses, world.centre_of_mass_m))
        yield path


def attachments_of(world: Hidden, drawn_m: Array) -> Array:
    """Where the ropes pull (2, 3) that were drawn elsewhere, body frame, m."""
    attachments = drawn_m.copy()
    attachments[:, 2] += [rope.attachment_height_m for rope in world.ropes.values()]
    return attachments


def anchors_of(world: Hidden, surveyed_m: Array, points_m: Array, slope: Array) -> Array:
    """Where the ropes' anchors (2, 3) are that were surveyed elsewhere, world frame, m.

    `points_m` (2, 3): where the ropes pull; `slope` (3, 3): from the slope's frame (x up, y left, z
    off it) to the world. An anchor is turned about the point at the same distance.
    """
    anchors = surveyed_m.copy()
    for index, rope in enumerate(world.ropes.values()):
        if rope.azimuth_rad == 0.0 and rope.elevation_rad == 0.0:
            continue
        x, y, z = slope.T @ (surveyed_m[index] - points_m[index])
        distance = math.hypot(x, y, z)
        azimuth = math.atan2(y, x) + rope.azimuth_rad
        elevation = math.asin(z / distance) + rope.elevation_rad
        level = distance * math.cos(elevation)
        chord = [
            level * math.cos(azimuth),
            level * math.sin(azimuth),
            distance * math.sin(elevation),
        ]
        anchors[index] = points_m[index] + slope @ np.array(chord)
    return anchors


def _delay_steps(cylinder: HiddenCylinder, step_s: float) -> int:
    steps = round(cylinder.pressure_delay_s / step_s)
    if steps >= DELAY_LENGTH:
        raise InputError(
            "is longer than the world can hold back",
            field="undeclared: delay of the pressures",
            value=cylinder.pressure_delay_s,
            allowed=f"< {DELAY_LENGTH * step_s:g} s",
        )
    return steps
