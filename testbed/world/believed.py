"""The robot that estimators and control believe in: its drawing, and what a model file of the whole robot adds.

The same means as on the other side of the wall: numbers of the machine by path, effects by name and place. Only what a
belief can hold is taken.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from testbed.effects import by_name, read_believed
from testbed.effects.hidden import Hidden
from testbed.effects.robot_attitude import Attitude
from testbed.effects.robot_centre_of_mass import CentreOfMass
from testbed.effects.robot_payload import HiddenPayload
from testbed.effects.rope_tension_gain import TensionGain
from testbed.errors import naming
from testbed.estimation.live.believed import Believed
from testbed.estimation.live.body_belief import body_of
from testbed.machine.model import Machine
from testbed.machine.ruled import check_effective
from testbed.recording.leg_model import EffectEntry, LegModel
from testbed.recording.robot_model import is_robot_model, read_robot_model
from testbed.robot.model import RobotModel
from testbed.world.undeclared import bodies_of, hidden_of

OF_THE_BODY = (HiddenPayload.kind, CentreOfMass.kind, Attitude.kind, TensionGain.kind)
"""Effects that are no cylinder's and that a belief can hold."""


@dataclass(frozen=True)
class OwnBelief:
    """The machine as believed, and effects believed beside its numbers."""

    machine: Machine
    of_leg: LegModel | None = None
    """A model of one leg, which then holds for all four instead of the machine's numbers."""
    of_cylinders: tuple[EffectEntry, ...] = ()
    of_body: Hidden | None = None
    file: Path = Path()
    """Where the model was read."""

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
        return Believed.from_machine(self.machine, dt_s, self.of_cylinders)

    def with_body(
        self, belief: Believed, model: RobotModel, rope_directions_in_world: NDArray[Any]
    ) -> Believed:
        """`belief` with the whole machine in it, sensors' errors included."""
        body = body_of(self.machine, model, belief.legs, belief.dt_s, rope_directions_in_world)
        if self.of_body is not None:
            hidden = self.of_body
            body["unit_roll"], body["unit_pitch"] = hidden.unit_roll_rad, hidden.unit_pitch_rad
            ropes = hidden.ropes.values()
            body["pin_gain"] = [1.0 + rope.tension_gain_error for rope in ropes]
            body["pin_zero"] = [rope.tension_zero_n for rope in ropes]
        return replace(belief, body=body)


def own_belief(machine: Machine, model: str | Path | None) -> OwnBelief:
    """What a model file, of the whole robot or of one leg, makes of a believed machine.

    Effects of the robot on which no estimate depends (oil, ground, supply, ...) are checked and left to the diagnosis,
    which looks for what is missing beside them.

    Raises InputError, naming the file, for what cannot be believed.
    """
    if model is None:
        return OwnBelief(machine)
    if not is_robot_model(model):
        return OwnBelief(machine, read_believed(model), file=Path(model))
    file = read_robot_model(model)
    for path, value in file.numbers.items():
        check_effective(path, value, True, model, "machine")
    of_cylinders, of_body = [], []
    for k, entry in enumerate(file.effects):
        effect = by_name(entry.name, model, f"effects.{k}.name")
        values = {name: p.value for name, p in entry.parameters.items()}
        effect.complete(values, model, f"effects.{k}.parameters")
        if effect.live and entry.place.endswith("_vertical"):
            of_cylinders.append(
                EffectEntry(name=entry.name, place=entry.place, parameters=entry.parameters)
            )
        elif entry.name in OF_THE_BODY:
            of_body.append(entry.hidden())
        else:
            # No estimate depends on it: the diagnosis alone grants it. Its place must be one all the same.
            hidden_of([entry.hidden()])
    with naming(model):
        return OwnBelief(
            machine.replaced(file.numbers, model, "machine"),
            None,
            tuple(of_cylinders),
            hidden_of(of_body),
        )
