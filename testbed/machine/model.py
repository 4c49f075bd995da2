"""The machine as one typed, frozen object: `machine.oil.bulk_modulus_pa`, SI, each number with
unit, source and mark.

The groups are those of `roboclimber.yaml`. What is declared once for all four legs is a shared
group (`cylinder`, `seal`, `valve`, ..., `legs`); `machine.axes["fl_vertical"]` and
`machine.each_leg["fl"]` give the same groups for one axis or one leg, which differ from the shared
ones where the machine says so by a path of its own:

    seal.side_load_coefficient                     all twelve seals
    vertical_cylinder.coulomb_out_n                the four vertical cylinders
    axes.fl_vertical.cylinder.coulomb_out_n        one cylinder
    axes.fl_vertical.seal.side_load_coefficient    one seal
    axes.fl_rotation.linkage.lever_m               one lever
    axes.fl_rotation.limits.upper_rad              one joint's range
    each_leg.fl.radial_offset_m                    one leg
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import PrivateAttr

from testbed.errors import InputError
from testbed.formats.checked import checked
from testbed.machine import frame_groups as frame
from testbed.machine import groups
from testbed.machine.names import AXES, JOINTS, LEGS
from testbed.machine.provenance import Quantity, check_number, nearest
from testbed.machine.scale import Scale

SHIPPED = "roboclimber.yaml"
AXIS_GROUPS = ("cylinder", "linkage", "limits", "seal", "valve", "oil", "end_stop", "sensor")
"""Groups of which each of the twelve axes has its own."""
OF_A_JOINT = ("cylinder", "linkage")
"""Those of them that differ from joint to joint: `vertical_cylinder`, `rotation_linkage`."""


@dataclass(frozen=True)
class Axis:
    """One hydraulic axis: its joint's limits, its cylinder with linkage, seal, stops, valve, oil
    and transducers.
    """

    name: str
    joint: str
    """rotation, radial or vertical."""
    cylinder: groups.Cylinder
    linkage: frame.RotationLinkage | frame.SlideLinkage
    limits: frame.RotationJoint | frame.SlidingJoint
    seal: groups.Seal
    valve: groups.Valve
    oil: groups.Oil
    end_stop: groups.EndStop
    sensor: groups.Sensor

    @property
    def travel_m(self) -> float:
        """Way of a slide; the stroke of its cylinder follows from the linkage."""
        assert isinstance(self.cylinder, groups.SlideCylinder), f"{self.name} turns"
        return self.cylinder.stroke_m

    @property
    def rated_flow_m3_s(self) -> float:
        """Rated flow of the axis' valve."""
        return self.valve.rated_flow_m3_s(self.joint)

    @property
    def encoder_count(self) -> float:
        """One count of the axis' encoder, rad or m."""
        turns = self.joint == "rotation"
        sensor = self.sensor
        return 2.0 * math.pi / sensor.encoder_counts_per_turn if turns else sensor.encoder_linear_m


class Machine(groups.Group):
    """Every number of one machine, and the URDF of its bodies. Made by `testbed.machine.build`."""

    total_mass_kg: groups.Positive
    body: frame.Body
    power_unit_body: frame.PowerUnitBody
    drill_body: frame.DrillBody
    rod_store_body: frame.RodStoreBody
    traction_body: frame.TractionBody
    legs: frame.Leg
    joints: frame.Joints
    rotation_linkage: frame.RotationLinkage
    radial_linkage: frame.SlideLinkage
    vertical_linkage: frame.SlideLinkage
    vertical_cylinder: groups.SlideCylinder
    radial_cylinder: groups.SlideCylinder
    rotation_cylinder: groups.Cylinder
    seal: groups.Seal
    end_stop: groups.EndStop
    oil: groups.Oil
    valve: groups.Valve
    power_unit: groups.PowerUnit
    sensor: groups.Sensor
    rope: groups.Rope
    traction: groups.Traction
    ground: groups.Ground
    drill: groups.Drill
    rock: groups.Rocks
    control: groups.Control

    _quantities: dict[str, Quantity] = PrivateAttr(default_factory=dict)
    _urdf: Path = PrivateAttr(default=Path())
    _axes: dict[str, Axis] = PrivateAttr(default_factory=dict)
    _each_leg: dict[str, frame.Leg] = PrivateAttr(default_factory=dict)

    @classmethod
    def of(
        cls,
        quantities: Mapping[str, Quantity],
        urdf: Path,
        file: str | Path = SHIPPED,
        section: str = "",
    ) -> Machine:
        """The machine of quantities by their dotted paths. Raises InputError for a number that
        cannot be.
        """
        shared = {path: q.value for path, q in quantities.items() if not _is_individual(path)}
        machine: Machine = _group(cls, _nested(shared), file, section)
        machine._quantities, machine._urdf = dict(quantities), urdf
        own = {path: q.value for path, q in quantities.items() if _is_individual(path)}
        for axis in AXES:
            machine._axes[axis] = machine._axis(axis, own, file, section)
        for leg in LEGS:
            prefix = f"each_leg.{leg}."
            machine._each_leg[leg] = _changed(machine.legs, own, prefix, file, section)
        return machine

    @property
    def urdf(self) -> Path:
        """The URDF that describes the bodies of this machine."""
        return self._urdf

    @property
    def scale(self) -> Scale:
        """How large it is beside ROBOCLIMBER."""
        return Scale.of(self.total_mass_kg)

    @property
    def axes(self) -> Mapping[str, Axis]:
        """The twelve axes by name, in AXES order."""
        return self._axes

    @property
    def each_leg(self) -> Mapping[str, frame.Leg]:
        """Geometry and masses of each leg."""
        return self._each_leg

    def of_joint(self, joint: str, group: str) -> Any:
        """The group of AXIS_GROUPS that the four axes of a joint share."""
        if group == "limits":
            return getattr(self.joints, joint)
        return getattr(self, f"{joint}_{group}" if group in OF_A_JOINT else group)

    def quantity(self, path: str, file: str | Path = SHIPPED, field: str = "") -> Quantity:
        """Value, unit, mark and source at a dotted path; one axis' or leg's path counts back to
        what is shared.

        Raises InputError, naming `file` and `field`, if there is none.
        """
        found = self._quantities.get(path)
        if found is None:
            shared = shared_path(path)
            found = None if shared is None else self._quantities.get(shared)
        if found is None:
            allowed = nearest(path, list(self._quantities))
            raise InputError("no such parameter", file=file, field=field or path, allowed=allowed)
        return found

    def leaves(self) -> Iterator[tuple[str, Quantity]]:
        """All (dotted path, quantity) pairs: what is shared in the file's order, then what is one
        axis' or leg's own.
        """
        yield from self._quantities.items()

    def replaced(
        self,
        changes: Mapping[str, Any],
        file: str | Path = SHIPPED,
        section: str = "",
        source: str = "",
    ) -> Machine:
        """This machine with some numbers changed by path; a changed number is marked E with what it
        was.

        Raises InputError, naming `section` of `file`, for an unknown path or a value that cannot
        be.
        """
        if not changes:
            return self
        quantities = dict(self._quantities)
        for path, value in changes.items():
            field = f"{section}.{path}" if section else path
            quantities[path] = self._changed_quantity(path, value, file, field, source)
        return Machine.of(quantities, self._urdf, file, section)

    def with_urdf(self, urdf: Path) -> Machine:
        """The same numbers with another URDF."""
        machine: Machine = self.model_copy()
        machine._urdf = urdf
        return machine

    def _changed_quantity(
        self, path: str, value: Any, file: str | Path, field: str, source: str
    ) -> Quantity:
        old = self.quantity(path, file, field)
        check_number(value, str(file), field)
        value = tuple(value) if isinstance(value, list) else value
        if isinstance(value, tuple) != isinstance(old.value, tuple) or (
            isinstance(value, tuple) and len(value) != len(old.value)
        ):
            allowed = f"like {old.value!r}"
            raise InputError(
                "has another shape", file=file, field=field, value=value, allowed=allowed
            )
        return Quantity(value, old.unit, "E", source or f"changed from {old.value}")

    def _axis(self, name: str, own: Mapping[str, Any], file: str | Path, section: str) -> Axis:
        joint = name.split("_")[1]
        parts = {
            part: _changed(self.of_joint(joint, part), own, f"axes.{name}.{part}.", file, section)
            for part in AXIS_GROUPS
        }
        return Axis(name=name, joint=joint, **parts)


def shared_path(path: str) -> str | None:
    """The shared path that a path of one axis or leg counts back to; None if it is not such a
    path.
    """
    words = path.split(".")
    if words[0] == "each_leg" and len(words) == 3 and words[1] in LEGS:
        return f"legs.{words[2]}"
    if words[0] == "axes" and len(words) == 4 and words[1] in AXES and words[2] in AXIS_GROUPS:
        joint = words[1].split("_")[1]
        if words[2] == "valve" and words[3] in {
            f"rated_flow_{other}_m3_s" for other in JOINTS if other != joint
        }:
            return None
        group = f"{joint}_{words[2]}" if words[2] in OF_A_JOINT else words[2]
        return f"joints.{joint}.{words[3]}" if group == "limits" else f"{group}.{words[3]}"
    return None


def _is_individual(path: str) -> bool:
    return path.startswith(("axes.", "each_leg."))


def _nested(values: Mapping[str, Any]) -> dict[str, Any]:
    tree: dict[str, Any] = {}
    for path, value in values.items():
        *parents, last = path.split(".")
        node = tree
        for key in parents:
            node = node.setdefault(key, {})
        node[last] = value
    return tree


def _changed(
    group: groups.GroupT, own: Mapping[str, Any], prefix: str, file: str | Path, section: str
) -> groups.GroupT:
    """A group with the numbers whose paths begin with `prefix`; the shared object itself where
    there are none.
    """
    changes = {
        name.removeprefix(prefix): value for name, value in own.items() if name.startswith(prefix)
    }
    if not changes:
        return group
    place = f"{section}.{prefix}" if section else prefix
    changed: groups.GroupT = _group(
        type(group), group.model_dump() | changes, file, place.rstrip(".")
    )
    return changed


def _group(
    kind: type[groups.GroupT], values: Mapping[str, Any], file: str | Path, section: str
) -> Any:
    try:
        return checked(kind, values, file)
    except InputError as error:
        field = ".".join(filter(None, [section, error.field]))
        # A whole group says nothing.
        value = None if isinstance(error.value, Mapping) else error.value
        raise InputError(
            error.problem, file=file, field=field or None, value=value, allowed=error.allowed
        ) from error


# How fast the sliding masses of a machine ring on oil and seals, and what clock that takes.

RINGING, MOST_RINGING = 1.4, 2.0
"""Largest angle of a ringing mass in a step: advised (E), and where leapfrog steps end. The quarter
model's seals chattered from step to step at 2.1.
"""


def fastest_rad_s(machine: Machine) -> float:
    """Angular frequency of the fastest vertical cylinder's oil and seal, half out, with the mass
    that slides.
    """
    fastest = 0.0
    for leg, numbers in machine.each_leg.items():
        axis = machine.axes[f"{leg}_vertical"]
        cylinder, half_m = axis.cylinder, 0.5 * axis.travel_m
        whole = math.pi / 4.0 * cylinder.bore_m**2
        ring = whole - math.pi / 4.0 * cylinder.rod_m**2
        columns = whole**2 / (cylinder.dead_volume_a_m3 + whole * half_m)
        columns += ring**2 / (cylinder.dead_volume_b_m3 + ring * half_m)
        stiffness = axis.oil.bulk_modulus_pa * columns + axis.seal.bristle_stiffness_n_m
        fastest = max(fastest, math.sqrt(stiffness / numbers.sliding_mass_kg))
    return fastest


def least_rate_hz(machine: Machine) -> int:
    """Rate of the physics, in whole thousands, at which engine and hydraulics take turns often
    enough.
    """
    return max(1000 * math.ceil(fastest_rad_s(machine) / RINGING / 1000.0), 1000)
