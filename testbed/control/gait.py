"""The interfaces of motion control: a gait commands joints and ropes, layers modify its command.

    command = gait.command(t, dt, measured)
    for layer in layers: command = layer.over(command, t, dt, measured)

Both are called once a tick (100 Hz) and get measurements only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from testbed.formats.arrays import Array, Columns, Flags
from testbed.formats.records import from_columns
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.recording.rows import DataRow
from testbed.robot.model import RobotModel
from testbed.robot.robot import LegKinematics, Robot
from testbed.robot.rope_bearings import SurveyedRopes

REST_1_S = 1.0e-7
"""A set point slower than this, rad/s or m/s, counts as resting: the valve loop may then close its
valve.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Command:
    """A command for the tick from t to t + dt: set points, ropes, stance and drill. Immutable; its
    arrays are read-only copies.

    A gait returns a command, each layer returns a new one, and the simulation loop alone turns the
    last one into moving set points. Returning the same object again means that nothing has changed.
    """

    joints: Array
    """(12) set points of the joints' position loops at the end of the tick, AXES order, rad
    (rotation) and m."""
    joint_rates: Array | None = None
    """(12) rates of the set points during the tick, rad/s and m/s; they then start from `joints -
    joint_rates * dt`. None, the usual case: they move at a constant rate from where the last
    command left them. Force feedback sets it."""
    rope_rates_m_s: Array = field(default_factory=lambda: np.zeros(len(SIDES)))
    """(2) rate of the ropes' unstrained lengths, left and right: negative hauls in."""
    stance: Flags = field(default_factory=lambda: np.ones(len(LEGS), dtype=bool))
    """(4) whether each foot is meant to carry load, LEGS order; the others swing."""
    hold_drill: bool = False
    """True: the drill stops pushing, pulling and turning, and waits."""
    feed_n: float | None = None
    """Feed force of the drill while it drills, N; None: that of its task."""
    hammer: float = 1.0
    """Energy of the hammer's blows, as a share of the full one, 0 to 1."""

    def __post_init__(self) -> None:
        """Copy and freeze the arrays."""
        object.__setattr__(self, "joints", _frozen(self.joints))
        if self.joint_rates is not None:
            object.__setattr__(self, "joint_rates", _frozen(self.joint_rates))
        object.__setattr__(self, "rope_rates_m_s", _frozen(self.rope_rates_m_s))
        object.__setattr__(self, "stance", _frozen(self.stance, np.bool_))

    def moved(self, offset: Array, offset_rate: Array) -> Command:
        """The same command with `offset` (12) added to the set points at the end of the tick, and
        `offset_rate` (12) to their rates where these are given.
        """
        rates = self.joint_rates
        return replace(
            self,
            joints=self.joints + offset,
            joint_rates=None if rates is None else rates + offset_rate,
        )


class SetPoints:
    """The set points of the position loops; nothing else integrates their rates."""

    def __init__(self, joints: Array) -> None:
        self.joints: Array = np.array(joints, dtype=np.float64)
        """(12) at the end of the last tick."""

    def follow(self, command: Command, dt: float) -> tuple[Array, Array]:
        """Advance by a tick of dt s; returns the set points (12) at its start, and their rates (12)
        during it.
        """
        rates = command.joint_rates
        if rates is not None:
            self.joints = command.joints
            return command.joints - rates * dt, rates
        begin = self.joints
        rates = (command.joints - begin) / dt
        rates[np.abs(rates) < REST_1_S] = 0.0
        self.joints = begin + rates * dt
        return begin, rates


def along_vertical(per_leg: ArrayLike) -> Array:
    """(12) joints: `per_leg` (4) at the vertical ones, zero elsewhere."""
    out = np.zeros(len(AXES))
    out[2::3] = per_leg
    return out


def _frozen(values: ArrayLike, kind: type = np.float64) -> NDArray[np.generic]:
    if isinstance(values, np.ndarray) and values.dtype == kind and not values.flags.writeable:
        return values
    out: NDArray[np.generic] = np.array(values, dtype=kind)
    out.flags.writeable = False
    return out


class Measured:
    """What control may use: the readings, estimates and last commands of one tick, by name; a copy,
    which the next tick does not change.

    The names are those of the recording (recording/rows.py), so that whatever runs live runs over
    a recording as well. Every field of DataRow is an attribute; declared here are those that are
    asked for most.
    """

    __slots__ = ("_row",)
    t: float
    """Time, s."""
    position: Array
    """(12) encoders, AXES order, rad (rotation) and m."""
    pressure_a: Array
    """(12) piston sides, Pa, gauge."""
    pressure_b: Array
    """(12) rod sides, Pa, gauge."""
    supply_pressure: float
    """Pa, gauge."""
    rope_tension: Array
    """(2) load pins of the left and right rope, N."""
    attitude: Array
    """(3) roll, pitch, yaw by the inertial unit, rad."""
    contact: Array
    """(4) contact state by the detector: 1 loaded, 0 contact lost."""

    def __init__(self, row: NDArray[Any]) -> None:
        """row: one DataRow, as an array of one record."""
        self._row = np.frombuffer(bytearray(row.tobytes()), DataRow.dtype)[0]

    @classmethod
    def of(cls, **readings: Any) -> Measured:
        """A row of zeros with these readings: fields of DataRow, or `load`."""
        return cls(DataRow.zeros(1)).but(**readings)

    def but(self, **readings: Any) -> Measured:
        """The same row with other readings."""
        row = np.array([self._row], DataRow.dtype)
        for name, value in readings.items():
            if name == "load":
                row["estimate"]["own"] = value
            else:
                row[name] = value
        return Measured(row)

    def __getattr__(self, name: str) -> Any:
        """A field of the row."""
        if name in DataRow.fields:
            return self._row[name]
        raise AttributeError(f"a row of data has no {name}")

    @property
    def load(self) -> Array:
        """(4) estimated load of each foot along its vertical joint, N."""
        load: Array = self._row["estimate"]["own"]
        return load

    @property
    def drill(self) -> Any:
        """What the drill's own controls know: a record with the fields of DrillKnown."""
        return self._row


def rows_of(columns: Columns) -> NDArray[Any]:
    """Recorded columns, each (n,), as n rows (DataRow); what was not recorded is zero."""
    return from_columns(DataRow, columns, len(next(iter(columns.values()))))


# One number that an agent or a trained controller sees: what it is, and the range that becomes -1
# to 1.


@dataclass(frozen=True)
class Observed:
    """A row of an observation's table."""

    column: str
    """Column of the run's data, or a name under `orders.` or `control.`: what control itself
    ordered or worked out.
    """
    meaning: str
    unit: str
    frame: str
    low: float
    high: float

    def times(self, factor: float) -> Observed:
        """The same row with a range so many times as large."""
        return replace(self, low=factor * self.low, high=factor * self.high)


def amounts(shares: Array, table: Sequence[Observed]) -> Array:
    """What numbers (n,) in [-1, 1], one a row, mean in the rows' units."""
    low, high = (np.array([getattr(row, end) for row in table]) for end in ("low", "high"))
    return np.asarray((high + low) / 2.0 + shares * (high - low) / 2.0)


class Gait(Protocol):
    """A motion of the machine as commands over time. One of a user's own is made from a
    BelievedStart.
    """

    def command(self, t: float, dt: float, measured: Measured) -> Command:
        """What is wanted in the tick from t to t + dt, s."""
        ...


class Layer(Protocol):
    """Something laid over a gait: a function of the inner command."""

    def over(self, command: Command, t: float, dt: float, measured: Measured) -> Command:
        """The command with this layer's say in it."""
        ...


@dataclass(frozen=True)
class Layered:
    """A gait with layers over it, the innermost first."""

    gait: Gait
    layers: tuple[Layer, ...]

    def command(self, t: float, dt: float, measured: Measured) -> Command:
        """See Gait."""
        command = self.gait.command(t, dt, measured)
        for layer in self.layers:
            command = layer.over(command, t, dt, measured)
        return command


@dataclass(frozen=True)
class BelievedStart:
    """The machine on its slope when a run begins, as control knows it. Body frame: x up the slope,
    y left, z away. Its arrays are copies: a gait may go on from them in place.
    """

    robot: Robot
    """Its numbers, masses and leg kinematics as believed."""
    joints: Array
    """(12) AXES order, rad (rotation) and m, as the encoders have them."""
    load_n: Array
    """(4) normal loads of the feet, LEGS order."""
    rope_tension_n: Array
    """(2) left, right; zeros without ropes."""
    rope_directions_in_body: Array
    """(2, 3) unit vectors from the attachments towards the anchors."""
    anchors_in_body_m: Array
    """(2, 3) as surveyed."""
    rope_strokes: bool = True
    """Whether there are traction devices that pull in strokes; else winches, or no ropes."""

    def __post_init__(self) -> None:
        """Copy the arrays: nothing of the world's own start is handed out."""
        object.__setattr__(self, "joints", self.joints.copy())
        object.__setattr__(self, "load_n", self.load_n.copy())
        object.__setattr__(self, "rope_tension_n", self.rope_tension_n.copy())
        object.__setattr__(self, "rope_directions_in_body", self.rope_directions_in_body.copy())
        object.__setattr__(self, "anchors_in_body_m", self.anchors_in_body_m.copy())

    @property
    def legs(self) -> LegKinematics:
        """Feet from joints and joints from feet."""
        return self.robot.legs

    @property
    def ropes_in_body(self) -> SurveyedRopes:
        """The ropes as surveyed."""
        ways = self.anchors_in_body_m - self.model.rope_attachments_m
        return SurveyedRopes(self.rope_directions_in_body, np.linalg.norm(ways, axis=1))

    @property
    def model(self) -> RobotModel:
        """Masses and geometry, declared payload included."""
        return self.robot.model
