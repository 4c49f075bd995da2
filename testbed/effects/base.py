"""What an effect is: everything that anyone asks of one is answered by its object.

An effect is one file of this folder with one class (or two like ones) and a tuple `EFFECTS` of its
objects. Only what differs from the answers given here is written there. Who asks: a world that has
the effect, the estimators that believe in it, the diagnosis that looks for it, the pages that
explain it.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
import numpy.typing as npt

from testbed.effects.parameter_spec import ParameterSpec
from testbed.effects.signature import Change, Course, RobotSeen, Signature
from testbed.effects.terms import (
    Coordinate,
    FlowTerms,
    ForceTerms,
    Hidden,
    Observed,
    Signals,
    Values,
)
from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.machine.model import Machine
from testbed.machine.names import AXES
from testbed.machine.scale import Scale
from testbed.recording.leg_model import Friction

MARK = "@"
"""Between an effect's name and its place: `sensor.gain_a@fl_vertical`."""
EXPECTED_WITHIN = 1.2
"""Half of the expected range in standard deviations: sizes at its end are nothing unusual."""


class Effect:
    """A named effect: a law that a machine may have and its published model lacks."""

    kind: ClassVar[str]
    """The name, without a place."""
    equation: ClassVar[str]
    text: ClassVar[str]
    """What it is, for a reader who knows machines."""
    parameters: ClassVar[tuple[ParameterSpec, ...]]
    places: ClassVar[tuple[str, ...]] = AXES
    """Where on the robot it may sit."""

    @property
    def places_on_robot(self) -> tuple[str, ...]:
        """Those of them at which a diagnosis of the whole robot looks for it."""
        return self.places

    # -- what recordings can show of it ------------------------------------------------------------
    rigs: ClassVar[tuple[str, ...]] = ("vertical-leg", "cylinder", "drive")
    """Kinds of rig on which it can exist."""
    needs: ClassVar[tuple[str, ...]] = ("position",)
    """Channels without which nothing is seen of it."""
    needs_known: ClassVar[tuple[str, ...]] = ()
    """Declared numbers of a rig (fields of `Known`) that its law is made of."""
    seen_in: ClassVar[tuple[str, ...]] = ("force",)
    """Residuals that it moves: `force`, `flow`, `supply`."""
    shapes: ClassVar[tuple[str, ...]] = ()
    """Further parameters that bend its law, tried together before another effect is called in."""
    far_from_linear: ClassVar[bool] = False
    """One linear step does not tell what it could explain: it is always tried."""
    replaces_friction: ClassVar[bool] = False
    """It holds the friction's shape itself, with a memory, and takes long to compute."""
    relative_to: ClassVar[tuple[str, ...]] = ()
    """Numbers of friction (5) of whose mean its size is a share: where they are unsure, so is the
    share, though their product may be sure.
    """
    looked_for: ClassVar[float] = 1.0
    """Among so many alternatives its signature was picked as the best: its evidence is worth that
    much less.
    """
    is_tolerance: ClassVar[bool] = False
    """Every machine has it within a workshop's tolerance; the robot's diagnosis does not name it
    beyond.
    """
    band_amplitude: ClassVar[str | None] = None
    """The parameter that is the amplitude of a narrow band: measured from the band, never
    fitted.
    """
    declared_as: ClassVar[str | None] = None
    """The declared number of a rig that it changes: where nobody declares it, it is fitted and no
    finding.
    """
    within_a_sample: ClassVar[bool] = False
    """Of a size within one sample of a drive's recorder it is the recorder's, and no finding."""
    usual_on_legs: ClassVar[tuple[float, float] | None] = None
    """Between which sizes, SI, of its first parameter a sound leg has it, too; see `usual_on`."""
    shows_at_speed: ClassVar[bool] = False
    """It moves the force of every motion: one that only slow motion shows is not it."""
    telling_motion: ClassVar[str] = ""
    """The experiment that shows it alone."""
    alike: ClassVar[Mapping[str, str]] = {}
    """Effects that it is easily taken for -> what would tell them apart."""

    bends: ClassVar[tuple[str, ...]] = ()
    """Parameters in which the robot's balances are far from linear: once it is named they are found
    by `made`.
    """
    lowest: ClassVar[float | None] = None
    """Below which no number of its signature can lie; None: as its parameters' bounds have it."""
    by_travel: ClassVar[bool] = False
    """What the numbers of its signature mean depends on how far its piston went."""
    usual: ClassVar[float | None] = None
    """How large they may be expected to be, where the parameters' priors do not tell."""

    # -- what a world that has it hides ------------------------------------------------------------
    hides: ClassVar[Mapping[str, str]] = {}
    """Parameter -> number that it takes the place of: one that a world hides at the effect's place
    (`effects/terms.py`), or one of a cylinder, by its path in `AxisParameters`.
    """
    adds: ClassVar[Mapping[str, str]] = {}
    """Parameter -> number, likewise, that it is added to."""

    # -- what the live estimators know of it -------------------------------------------------------
    live: ClassVar[Mapping[str, str]] = {}
    """Parameter -> number of the believed leg (`estimation/live/believed.py`) that it is added
    to.
    """

    place: str | None = None

    @property
    def name(self) -> str:
        """`sensor.gain_a`, or `sensor.gain_a@fl_vertical` for one at a place."""
        return self.kind if self.place is None else f"{self.kind}{MARK}{self.place}"

    def at(self, place: str) -> Self:
        """The effect at one place: every other axis is left as it is."""
        placed = copy.copy(self)
        placed.place = place
        return placed

    def concerns(self, signals: Signals) -> bool:
        """Whether it acts on the axis that these signals are of."""
        return self.place is None or self.place == signals.place

    # -- what the whole robot shows of it ----------------------------------------------------------
    def signature(self, seen: RobotSeen, place: str) -> Signature:
        """By how much the robot's balances miss for one unit of each of its (linear) numbers;
        nothing: they cannot show it.
        """
        return {}

    def courses(self, seen: RobotSeen, place: str) -> tuple[Course, ...]:
        """The signatures of an effect with a course in time of which nobody knows beforehand when
        or how far it goes: its recording tells which one it is.
        """
        return (Course(self.signature(seen, place)),)

    def from_linear(self, linear: Values, seen: RobotSeen, place: str) -> dict[str, float]:
        """Its parameters from the numbers of its signature."""
        return dict(linear)

    def made(self, seen: RobotSeen, place: str, values: Values) -> Change:
        """What the balances miss by these values of the parameters in `bends`, by its law; nothing
        where none bends.
        """
        return Change()

    def lies_within(self, name: str, seen: RobotSeen, place: str) -> tuple[float, float]:
        """Between what the build of the machine at its place leaves a parameter in `bends`, beside
        its bounds: least and greatest, SI; -inf and inf: anything.
        """
        return -math.inf, math.inf

    def robot_price(self, seen: RobotSeen, place: str, values: Values) -> float:
        """What values that would make it another effect cost in log-likelihood, by what one
        recording of the robot shows of them: its `price` there.
        """
        return 0.0

    def least(self, number: str) -> float:
        """Below which a number of its signature cannot lie, or is no such effect; -inf: it may be
        any.
        """
        if self.lowest is not None:
            return self.lowest
        above_zero = any(spec.name == number and spec.low >= 0.0 for spec in self.parameters)
        return 0.0 if above_zero else -math.inf

    def possible(self, numbers: Mapping[str, Array], scale: Scale) -> npt.NDArray[np.bool_]:
        """(n,) which of n draws of its signature's numbers, (n,) each, could be such an effect on a
        machine of this size.
        """
        return np.ones(len(next(iter(numbers.values()))), dtype=bool)

    def to_linear(self, values: Values) -> dict[str, float]:
        """The numbers of its signature from its parameters: the other way round, as far as there is
        one.
        """
        return dict(values)

    def spread(self, number: str) -> float:
        """How large a number of its signature may be expected to be: standard deviation about 0."""
        if self.usual is not None:
            return self.usual
        low, high = self.spec(number).prior
        return max(abs(low), abs(high)) / EXPECTED_WITHIN

    def grows(self, number: str, scale: Scale) -> float:
        """By what `spread` is multiplied on a machine of this size: the units of the parameters
        whose product the number is. Metres or radians count as radians, which do not grow.
        """
        units = {spec.name: spec.unit.rpartition(" or ")[2] for spec in self.parameters}
        return math.prod(scale.times(units[part]) for part in number.split() if part in units)

    # -- its laws ----------------------------------------------------------------------------------
    def correct(self, signals: Signals, values: Values) -> Signals:
        """What the sensors should have read: measured signals without the effect."""
        return signals

    def force(self, signals: Signals, terms: ForceTerms, values: Values) -> None:
        """Change the believed force balance."""

    def flow(self, signals: Signals, terms: FlowTerms, values: Values) -> None:
        """Change the believed flow balance."""

    def overrides(self, method: str) -> bool:
        """Whether the effect has an answer of its own: `overrides("correct")` for one of the
        sensors.
        """
        return getattr(type(self), method) is not getattr(Effect, method)

    # -- its fit -----------------------------------------------------------------------------------
    def usual_on(self, kind: str, sample_s: float) -> tuple[float, float] | None:
        """Between which sizes, SI, of its first parameter a sound rig of this kind has it, too: the
        base model has as much of it as the recordings say, and it is no finding. None: a sound one
        has none. `sample_s`: time between two samples, s.
        """
        return self.usual_on_legs if kind == "vertical-leg" else None

    def unseen(self, observed: Observed) -> str | None:
        """Why these recordings cannot show it, though its channels are there; None where they
        can.
        """
        return None

    def starts(self, observed: Observed) -> list[dict[str, float]]:
        """Starting values; several where the residual has several valleys."""
        return [dict.fromkeys(self.required, 0.0)]

    def coordinates(
        self, start: Values | None = None, shapes: Sequence[str] = ()
    ) -> list[Coordinate]:
        """Its parameters, and the further shapes asked for, as numbers to be fitted."""
        given = start or {}
        return [
            spec.coordinate(self.name, given.get(spec.name, spec.start), self.seen_in)
            for spec in self.parameters
            if (spec.default is None or spec.name in shapes) and spec.name != self.band_amplitude
        ]

    def narrowed(self, coordinate: Coordinate, observed: Observed) -> Coordinate:
        """One of its coordinates with the bounds that these recordings call for."""
        return coordinate

    def promise(self, observed: Observed) -> float | None:
        """Fall of the fit's cost that it could bring; None: one linear step tells it."""
        return None

    def price(self, values: Values, observed: Observed) -> float:
        """What its flexibility, or values that would make it another effect, cost in
        log-likelihood.
        """
        return 0.0

    may_be_another_law: ClassVar[bool] = False
    """Whether its further shapes can make a law of another kind of it; see `another_law`."""

    def another_law(self, values: Values, observed: Observed) -> str | None:
        """The law without a name on an axis that its shapes stand for at these values: its kind;
        None where they are one of its own.
        """
        return None

    def floor_n(self, values: Values, friction: Friction, encoder_m: float) -> float:
        """What the encoder's rounding (standard deviation, m) does to its force, N."""
        return 0.0

    def declared_by(self, machine: Machine) -> Values | None:
        """Its values where the machine's own numbers declare it for all cylinders alike; None: they
        do not.
        """
        return None

    # -- a world that has it -----------------------------------------------------------------------
    def hide(self, world: Hidden, place: str, values: Values) -> None:
        """Write down what a world has that has the effect at this place, one of `places`."""
        if not self.in_worlds:
            raise InputError("no simulated machine has this effect", field=self.name)
        part = world.at(place)
        for parameter, number in self.hides.items():
            if hasattr(part, number):
                setattr(part, number, values[parameter])
            else:
                part.replaced[number] = self._of_laws(parameter, values[parameter])
        for parameter, number in self.adds.items():
            if hasattr(part, number):
                setattr(part, number, getattr(part, number) + values[parameter])
            else:
                more = self._of_laws(parameter, values[parameter])
                part.added[number] = part.added.get(number, 0.0) + more

    def _of_laws(self, parameter: str, value: float) -> float:
        """A value in the laws' unit: their frequencies are angular ones."""
        return 2.0 * math.pi * value if self.spec(parameter).unit == "Hz" else value

    @property
    def in_worlds(self) -> bool:
        """Whether a simulated machine can have it."""
        return bool(self.hides or self.adds) or self.overrides("hide")

    def hidden_shapes(self) -> tuple[str, ...]:
        """Parameters that a simulated machine cannot have other than by default: shapes of real
        machines.
        """
        return tuple(
            parameter.name for parameter in self.parameters if parameter.default is not None
        )

    # -- its parameters ----------------------------------------------------------------------------
    def spec(self, parameter: str) -> ParameterSpec:
        """The specification of a parameter. Raises InputError for an unknown one."""
        for spec in self.parameters:
            if spec.name == parameter:
                return spec
        raise InputError(
            f"effect {self.name} has no such parameter",
            field=parameter,
            allowed=self._parameter_names,
        )

    @property
    def required(self) -> tuple[str, ...]:
        """Names of the parameters of the contract's formula."""
        return tuple(parameter.name for parameter in self.parameters if parameter.default is None)

    @property
    def _parameter_names(self) -> str:
        return ", ".join(parameter.name for parameter in self.parameters)

    def complete(
        self, values: Mapping[str, Any], file: str | Path | None = None, field: str | None = None
    ) -> dict[str, float]:
        """`values` checked against the bounds, with defaults for further shapes.

        Raises InputError; `field` is where in `file` the values are.
        """
        group = self.name if field is None else field
        for name in values:
            if name not in {parameter.name for parameter in self.parameters}:
                raise InputError(
                    "unknown parameter",
                    file=file,
                    field=f"{group}.{name}",
                    allowed=self._parameter_names,
                )
        out: dict[str, float] = {}
        for spec in self.parameters:
            value = values.get(spec.name, spec.default)
            if value is None:
                raise InputError(
                    f"effect {self.name} lacks parameter {spec.name!r}",
                    file=file,
                    field=field,
                    allowed=spec.text,
                )
            number = isinstance(value, (int, float)) and not isinstance(value, bool)
            if not number or not spec.low <= value <= spec.high:
                raise InputError(
                    "out of bounds",
                    file=file,
                    field=f"{group}.{spec.name}",
                    value=value,
                    allowed=f"{spec.low:g} to {spec.high:g} {spec.unit}",
                )
            out[spec.name] = float(value)
        return out
