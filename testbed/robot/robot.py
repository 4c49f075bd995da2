"""A machine with its bodies: numbers, masses and gravity, leg kinematics and linkages, built once
and handed on.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from testbed.machine.model import Machine
from testbed.robot.kinematics import LegKinematics
from testbed.robot.linkage import Linkages
from testbed.robot.model import Payload, RobotModel


@dataclass(frozen=True)
class Robot:
    """What the world is built from, or what estimators and control believe in."""

    machine: Machine
    model: RobotModel
    legs: LegKinematics
    linkages: Linkages

    @classmethod
    def of(
        cls,
        machine: Machine,
        carried_kg: float = 0.0,
        rope_height_m: float | None = None,
        bodies: Path | None = None,
    ) -> Robot:
        """A machine with `carried_kg` in its rod store; `rope_height_m`: the ropes' attachments,
        else the URDF's.

        `bodies`: a URDF with other masses than the machine's own.

        Raises InputError for a URDF or linkage that cannot be.
        """
        payload = None
        if carried_kg > 0.0:
            payload = Payload(carried_kg, machine.rod_store_body.position_m)
        return cls(
            machine,
            RobotModel(bodies or machine.urdf, payload, rope_height_m),
            LegKinematics.from_machine(machine),
            Linkages.from_machine(machine),
        )
