"""The robot that estimators and control believe in: its drawing, and what a model file of the whole
robot adds.

The same means as on the other side of the wall: numbers of the machine by path, effects by name and
place. Only what a belief can hold is taken.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.effects import by_name, complete, read_believed
from testbed.effects.robot_attitude import Attitude
from testbed.effects.robot_centre_of_mass import CentreOfMass
from testbed.effects.robot_payload import HiddenPayload
from testbed.effects.rope_attachment import RopeAttachment
from testbed.effects.rope_direction import RopeDirection
from testbed.effects.rope_tension_gain import TensionGain
from testbed.effects.terms import Hidden
from testbed.errors import InputError, naming
from testbed.estimation.live.believed import Believed
from testbed.estimation.live.body_belief import body_of
from testbed.estimation.live.own_tuning import OwnTuning
from testbed.estimation.live.uncertainty import Uncertainty
from testbed.formats.intervals import sd_of
from testbed.machine.model import Machine
from testbed.machine.names import AXES, LEGS
from testbed.machine.overridden import check_effective
from testbed.recording.leg_model import EffectEntry, LegModel
from testbed.recording.robot_model import (
    RobotModelFile,
    check_drawing,
    is_robot_model,
    read_robot_model,
)
from testbed.robot.model import RobotModel
from testbed.robot.rope_bearings import SurveyedRopes
from testbed.scenario.machines import WORKSHOP
from testbed.world.undeclared import attachments_of, bodies_of, hidden_of

OF_THE_BODY = tuple(
    effect.kind
    for effect in (
        HiddenPayload,
        CentreOfMass,
        Attitude,
        TensionGain,
        RopeDirection,
        RopeAttachment,
    )
)
"""Effects that are no cylinder's and that a belief can hold."""


@dataclass(frozen=True)
class BelievedRobot:
    """The machine as believed, and effects believed beside its numbers."""

    machine: Machine
    of_leg: LegModel | None = None
    """A model of one leg, which then holds for all four instead of the machine's numbers."""
    of_cylinders: tuple[EffectEntry, ...] = ()
    of_body: Hidden | None = None
    file: Path = Path()
    """Where the model was read."""
    sure: Uncertainty = field(default_factory=lambda: Uncertainty(WORKSHOP))
    """How far the machine may be from all that."""

    @cached_property
    def expected(self) -> Machine:
        """The machine that estimates start from: where tolerances do not lie evenly about the
        drawing, their mean.
        """
        return self.machine.replaced(self.sure.expected(self.machine))

    def unsure_of_ropes(self, sd_rad: float) -> BelievedRobot:
        """The same where the ropes' directions may be off by so much, standard deviation either
        way.
        """
        ropes = RopeDirection()
        numbers = [
            f"{ropes.name}@{place}.{way}"
            for place in ropes.places_on_robot
            for way in ("azimuth", "elevation")
        ]
        found = {**self.sure.found, **dict.fromkeys(numbers, sd_rad)}
        return replace(self, sure=replace(self.sure, found=found))

    @contextmanager
    def bodies(self) -> Iterator[Path]:
        """The believed URDF, masses included, for as long as it is read."""
        with bodies_of(self.of_body or Hidden(), self.machine.urdf) as urdf:
            yield urdf

    def legs(self, dt_s: float) -> Believed:
        """What the chain is built from, the body not yet in it."""
        if self.of_leg is not None:
            with naming(self.file):
                return Believed.from_model(self.of_leg, dt_s, self.machine)
        vertical = [
            cylinder for cylinder in self.of_cylinders if str(cylinder.place).endswith("_vertical")
        ]
        return Believed.from_machine(self.machine, dt_s, vertical)

    def with_body(
        self,
        belief: Believed,
        model: RobotModel,
        surveyed: SurveyedRopes,
        tuning: OwnTuning | None = None,
    ) -> Believed:
        """`belief` with the whole machine in it, sensors' errors included; surveyed: in the world
        frame.
        """
        hidden = self.of_body or Hidden()
        ropes = list(hidden.ropes.values())
        body = body_of(
            self.expected,
            model,
            belief.legs,
            belief.dt_s,
            replace(surveyed, directions=turned_ropes(surveyed.directions, hidden)),
            tuning,
            sure=self.sure,
            effects=self.of_cylinders,
        )
        body["unit_roll"], body["unit_pitch"] = hidden.unit_roll_rad, hidden.unit_pitch_rad
        body["pin_gain"] = [1.0 + rope.tension_gain_error for rope in ropes]
        body["pin_zero"] = [rope.tension_zero_n for rope in ropes]
        body["rope_point"] = attachments_of(hidden, model.rope_attachments_m)
        return replace(belief, body=body)


def turned_ropes(directions: NDArray[Any], hidden: Hidden) -> NDArray[Any]:
    """Unit vectors (2, 3) towards the anchors, world frame, turned as `rope.direction` has it.

    The slope that it speaks of is the one in which both ropes lie.
    """
    turned = [(rope.azimuth_rad, rope.elevation_rad) for rope in hidden.ropes.values()]
    if not np.any(turned):
        return directions
    up = directions.sum(axis=0) / np.linalg.norm(directions.sum(axis=0))
    left = np.cross((0.0, 0.0, 1.0), up)
    left /= np.linalg.norm(left)
    slope = np.column_stack([up, left, np.cross(up, left)])
    out = []
    for direction, (azimuth, elevation) in zip(directions, turned, strict=True):
        x, y, z = direction @ slope
        heading, rise = math.atan2(y, x) + azimuth, math.asin(z) + elevation
        level = math.cos(rise)
        out.append(slope @ [level * math.cos(heading), level * math.sin(heading), math.sin(rise)])
    return np.array(out)


def believed_robot(
    machine: Machine, model: str | Path | None, tolerances: str | None = WORKSHOP
) -> BelievedRobot:
    """What a model file, of the whole robot or of one leg, makes of a believed machine.

    Effects of the robot on which no estimate depends (oil, ground, supply, ...) are checked and
    left to the diagnosis, which looks for what is missing beside them.

    `tolerances`: how far the machine may be from it; what the file gives with an interval is known
    that well. None: all is believed as it is.

    Raises InputError, naming the file, for what cannot be believed.
    """
    if model is None:
        return BelievedRobot(machine, sure=Uncertainty(tolerances))
    if not is_robot_model(model):
        of_leg = read_believed(model)
        with naming(model):
            sure = Uncertainty(tolerances, spreads_of_leg(of_leg))
        return BelievedRobot(machine, of_leg, file=Path(model), sure=sure)
    file = read_robot_model(model)
    check_drawing(file, machine.total_mass_kg, model)
    for path, value in file.numbers.items():
        check_effective(path, value, True, model, "machine")
    of_cylinders, of_body = [], []
    for index, entry in enumerate(file.effects):
        effect = by_name(entry.name, model, f"effects.{index}.name")
        complete(effect, entry.parameters, model, f"effects.{index}.parameters")
        if effect.live and entry.place in AXES:
            of_cylinders.append(
                EffectEntry(name=entry.name, place=entry.place, parameters=entry.parameters)
            )
        elif entry.name in OF_THE_BODY:
            of_body.append(entry.hidden())
        else:
            # No estimate depends on it: the diagnosis alone grants it. Its place must be one all
            # the same.
            hidden_of([entry.hidden()])
    with naming(model):
        return BelievedRobot(
            machine.replaced(file.numbers, model, "machine"),
            None,
            tuple(of_cylinders),
            hidden_of(of_body),
            Path(model),
            Uncertainty(tolerances, spreads_of(file)),
        )


OF_TOLERANCES = {
    "bore_m": "axes.{}_vertical.cylinder.bore_m",
    "moving_mass_kg": "inertia.mass@{}_vertical.mass",
}
"""Number of a leg's model whose tolerance an estimate knows -> its name beside a robot's."""


def spreads_of_leg(model: LegModel) -> dict[str, float]:
    """Standard deviations that the tolerances of a leg's model tell of all four, by the robot's
    names.

    Raises InputError for the tolerance of a number that every live estimate takes as it is.
    """
    found: dict[str, float] = {}
    for name, share in model.known.tolerances.items():
        if name not in OF_TOLERANCES:
            raise InputError(
                "would have no effect: no live estimate knows how far the number may be off",
                field=f"known.tolerances.{name}",
                value=share,
                allowed=f"left out, or one of {', '.join(OF_TOLERANCES)}",
            )
        spread = share * (getattr(model.known, name) or 0.0)
        found |= {OF_TOLERANCES[name].format(leg): spread for leg in LEGS}
    return found


def spreads_of(file: RobotModelFile) -> dict[str, float]:
    """Standard deviations that a model file's intervals tell, by path, or
    effect@place.parameter.
    """
    numbers = dict(file.machine)
    for entry in file.effects:
        for name, parameter in entry.parameters.items():
            numbers[f"{entry.name}@{entry.place}.{name}"] = parameter
    return {
        name: sd_of(number.interval90)
        for name, number in numbers.items()
        if number.interval90 is not None
    }
