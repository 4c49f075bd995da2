"""Refuses what cannot have an effect or cannot be done: fields that another field of the scenario
puts out of use, and demands beyond what the machine has, reaches or carries.

A field that is given beside what puts it out of use would change nothing and is refused. A file's
own fields are not, where only a change from outside (`--set ropes.enabled=false`) puts them out of
use: they become what they are by default.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from testbed.errors import InputError
from testbed.formats.checked import Numbers
from testbed.machine.model import MOST_RINGING, Machine, fastest_rad_s, least_rate_hz
from testbed.machine.names import LEGS
from testbed.machine.overridden import check_effective, check_kind
from testbed.machine.urdf_check import lacking
from testbed.scenario.left_out import NUMBERS, OF_HYDRAULICS, OF_SENSORS, SENSOR, STUCK
from testbed.scenario.machines import machines_of
from testbed.scenario.parts import TICK_HZ, Hydraulics, Robot
from testbed.scenario.tasks import Chain, Raise

if TYPE_CHECKING:
    from testbed.scenario.scenario import Scenario


@dataclass(frozen=True)
class Rule:
    """Fields that do nothing unless another one, `ruler`, is as `allowed` says."""

    fields: str
    """Pattern of their dotted paths."""
    ruler: str
    allowed: str
    holds: Callable[[Scenario], bool]
    """Whether they do nothing in a scenario."""


OF_SENSOR = rf"{NUMBERS}{SENSOR}"


def _left_out(section: str, part: str, fields: str) -> Rule:
    """Fields of a part that a list `without` leaves out."""
    return Rule(
        fields,
        f"{section}.without",
        f"a list without {part}",
        lambda s: part in getattr(s, section).without,
    )


RULES = (
    Rule(r"ropes\.(?!enabled$)\w+", "ropes.enabled", "true", lambda s: not s.ropes.enabled),
    Rule(r"ropes\.share", "ropes.tension_n", "null", lambda s: s.ropes.tension_n is not None),
    Rule(
        r"hydraulics\.supply_pressure_pa",
        "hydraulics.pump",
        "true",
        lambda s: not s.hydraulics.pump,
    ),
    Rule(r"control\.dither_hz", "control.dither_m", "> 0", lambda s: s.control.dither_m == 0.0),
    Rule(r"control\.thrust_reserve", "task", "one that drills", lambda s: s.drilling is None),
    Rule(r"terrain\.settle_s", "terrain.plastic_n_m", "> 0", lambda s: not s.terrain.loose),
    Rule(
        r"terrain\.(hurst|roughness_seed)",
        "terrain.roughness_m",
        "> 0",
        lambda s: s.terrain.roughness_m == 0.0,
    ),
    Rule(
        r"terrain\.cell_m",
        "terrain.kind",
        "heightfield or elevation",
        lambda s: s.terrain.kind not in ("heightfield", "elevation"),
    ),
    Rule(
        rf"{OF_SENSOR}(\w+_noise|pressure_ripple)_\w+",
        "sensors.noise",
        "true",
        lambda s: not s.sensors.noise,
    ),
    Rule(
        rf"{OF_SENSOR}(encoder|pressure_resolution|temperature_resolution)_\w+",
        "sensors.quantisation",
        "true",
        lambda s: not s.sensors.quantisation,
    ),
    Rule(
        rf"{OF_SENSOR}thermal_\w+",
        "sensors.thermal_drift",
        "true",
        lambda s: not s.sensors.thermal_drift,
    ),
    Rule(
        rf"{OF_SENSOR}pressure_(linearity|hysteresis)_pa",
        "sensors.characteristic",
        "true",
        lambda s: not s.sensors.characteristic,
    ),
    Rule(
        rf"{NUMBERS}traction\.(stroke_m|seat_m|clamp_s|return_speed_m_s)",
        "ropes.strokes",
        "true",
        lambda s: not s.ropes.strokes,
    ),
    *(
        _left_out(section, part, f"{NUMBERS}({numbers})")
        for section, of_parts in (("hydraulics", OF_HYDRAULICS), ("sensors", OF_SENSORS))
        for part, numbers in of_parts.items()
    ),
    *(_left_out("hydraulics", part, r"hydraulics\.stuck_seals") for part in STUCK),
)


def overruled_fields(
    scenario: Scenario, given: Mapping[str, object], changes: Collection[str], file: Path
) -> list[str]:
    """The fields of a file that changes from outside put out of use.

    given: dotted paths of all fields and numbers that are given, with their values; changes: paths
    of what is changed from outside. Raises InputError for a field that was given beside what puts
    it out of use.
    """
    found = []
    for path, rule in _idle(scenario, given):
        if _is_given(path, changes) or not _is_given(rule.ruler, changes):
            raise InputError(
                f"would have no effect: {rule.ruler} rules it",
                file=file,
                field=path,
                value=given[path],
                allowed=f"it where {rule.ruler} is {rule.allowed}",
            )
        found.append(path)
    return found


def _idle(scenario: Scenario, given: Mapping[str, object]) -> Iterator[tuple[str, Rule]]:
    """Fields that do nothing, with what rules them; one that has its default value does no harm."""
    for path, value in given.items():
        for rule in RULES:
            if re.fullmatch(rule.fields, path) and rule.holds(scenario):
                section, _, field = path.partition(".")
                known = type(getattr(scenario, section)).model_fields
                if field not in known or value != known[field].default:
                    yield path, rule
                    break


def _is_given(path: str, changes: Collection[str]) -> bool:
    """Whether one of the changes is of this field, or of a group that holds it."""
    return any(path == change or path.startswith(f"{change}.") for change in changes)


def check_feasible(scenario: Scenario, file: Path) -> None:
    """Refuse what the scenario's machine cannot do, and numbers of it that would change nothing."""
    hydraulics, believed = scenario.hydraulics, scenario.model.parameters
    _check_effect(hydraulics.parameters, file, "hydraulics.parameters")
    _check_one_supply(hydraulics, file)
    _check_effect(believed, file, "model.parameters")
    machines = machines_of(scenario, file)
    truth = machines.truth
    for number, value in hydraulics.parameters.items():
        check_kind(number, value, truth, file, "hydraulics.parameters")
    for number, value in believed.items():
        check_kind(number, value, machines.belief, file, "model.parameters")
    _check_has(scenario, truth, file)
    _check_acts(scenario, truth, file)
    _check_clock(scenario, truth, file)
    _check_recorded(scenario, file)
    _check_store(scenario, truth, file)
    _check_posture(scenario.robot, truth, file)
    _check_raise(scenario, truth, file)


def _check_effect(changes: Numbers, file: Path, section: str) -> None:
    """Refuse a change of a number that does nothing."""
    for name, value in changes.items():
        check_effective(name, value, section.startswith("model."), file, section)


def _check_one_supply(hydraulics: Hydraulics, file: Path) -> None:
    """Refuse two set pressures of the pump."""
    path = "power_unit.supply_pressure_pa"
    if hydraulics.supply_pressure_pa is not None and path in hydraulics.parameters:
        raise InputError(
            "would have no effect: hydraulics.supply_pressure_pa rules it",
            file=file,
            field=f"hydraulics.parameters.{path}",
            value=hydraulics.parameters[path],
            allowed="one of both",
        )


def _check_clock(scenario: Scenario, machine: Machine, file: Path) -> None:
    """Refuse steps between which oil and seals of a light leg would ring without end."""
    rate_hz, fastest = scenario.rates.physics_hz, fastest_rad_s(machine)
    if fastest > MOST_RINGING * rate_hz:
        raise InputError(
            f"is too slow: a leg's sliding mass rings on its oil and seal at {fastest:.0f} rad/s",
            file=file,
            field="rates.physics_hz",
            value=rate_hz,
            allowed=f"at least {least_rate_hz(machine)}",
        )


def _check_recorded(scenario: Scenario, file: Path) -> None:
    """Refuse a run that is over before its first row."""
    ticks = math.ceil(TICK_HZ * scenario.duration_s)  # a run ends with a whole one
    if ticks * scenario.rates.record_hz < TICK_HZ:
        raise InputError(
            "records no row in the scenario's duration",
            file=file,
            field="rates.record_hz",
            value=scenario.rates.record_hz,
            allowed=f"at least {math.ceil(TICK_HZ / ticks)}",
        )


def _check_has(scenario: Scenario, machine: Machine, file: Path) -> None:
    """Refuse ropes, a drill or a load where the machine has nothing to hold them."""
    lacks = lacking(machine.urdf)
    wanted = (
        (
            "traction_left",
            scenario.ropes.enabled,
            "ropes.enabled",
            "false: the machine has no ropes",
        ),
        ("drill_mast", scenario.drilling is not None, "task", "one that does not drill"),
        ("rod_store", scenario.carried_kg > 0.0, "robot.payload_kg", "0: it has no rod store"),
    )
    for link, asked, field, allowed in wanted:
        if asked and link in lacks:
            raise InputError(f"the machine has no {link}", file=file, field=field, allowed=allowed)


def _check_acts(scenario: Scenario, machine: Machine, file: Path) -> None:
    """Refuse events where there is nothing that they act on."""
    needs = {
        "cut_rope": ("ropes.enabled: true", scenario.ropes.enabled),
        "set_rope": ("ropes.enabled: true", scenario.ropes.enabled),
        "set_supply": ("hydraulics.pump: true", scenario.hydraulics.pump),
        "payload": ("a machine with a rod store", "rod_store" not in lacking(machine.urdf)),
    }
    for number, event in enumerate(scenario.events):
        allowed, there = needs.get(event.kind, ("", True))
        if not there:
            raise InputError(
                "would have no effect",
                file=file,
                field=f"events.{number}",
                value=event.kind,
                allowed=allowed,
            )


def _check_store(scenario: Scenario, machine: Machine, file: Path) -> None:
    """Refuse to take more off the rod store than it weighs."""
    taken, held = scenario.taken_kg, scenario.carried_kg + machine.rod_store_body.mass_kg
    if taken >= held:
        raise InputError(
            f"{taken:g} kg are taken off a rod store of {held:g} kg",
            file=file,
            allowed="less of it, or a larger robot.payload_kg",
        )


def _check_posture(robot: Robot, machine: Machine, file: Path) -> None:
    """Refuse a start posture beyond the machine's strokes and ranges."""
    for leg, radial_m, vertical_m, angle_deg in zip(
        LEGS, robot.radial_m, robot.vertical_m, robot.rotation_deg, strict=True
    ):
        for joint, extension_m in (("radial", radial_m), ("vertical", vertical_m)):
            travel_m = machine.axes[f"{leg}_{joint}"].travel_m
            if not 0.0 <= extension_m <= travel_m:
                raise InputError(
                    f"is outside the cylinder's stroke at {leg}",
                    file=file,
                    field=f"robot.{joint}_m",
                    value=extension_m,
                    allowed=f"0 to {travel_m:g} m",
                )
        ends = machine.axes[f"{leg}_rotation"].limits.ends
        lower_deg, upper_deg = (math.degrees(end) for end in ends)
        if not lower_deg - 1e-9 <= angle_deg <= upper_deg + 1e-9:
            raise InputError(
                f"is outside the joint's range at {leg}",
                file=file,
                field="robot.rotation_deg",
                value=angle_deg,
                allowed=f"{lower_deg:g} to {upper_deg:g} deg",
            )


def _check_raise(scenario: Scenario, machine: Machine, file: Path) -> None:
    """Refuse to raise the body further than the vertical cylinders go, or no further than it
    stands.
    """
    task = scenario.task
    tasks = task.tasks if isinstance(task, Chain) else (task,)
    stroke_m = min(machine.axes[f"{leg}_vertical"].travel_m for leg in LEGS)
    stands_m = min(scenario.robot.vertical_m)
    for part in tasks:
        if not isinstance(part, Raise):
            continue
        if not stands_m < part.to_m <= stroke_m:
            beyond = part.to_m > stroke_m
            raise InputError(
                "is beyond the vertical cylinders' stroke" if beyond else "raises nothing",
                file=file,
                field="task.to_m",
                value=part.to_m,
                allowed=f"more than {stands_m:g} m, at most {stroke_m:g} m",
            )
        stands_m = part.to_m
