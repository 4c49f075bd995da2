"""What an agent sees: one table, each row with its meaning, unit, frame and range.

An observation is the vector of all rows, each mapped from [low, high] to [-1, 1] and clipped there.
Everything in it is a measurement, an estimate or an order of control itself, never a truth of the
world. Rows that a run records take name, unit and meaning from where the recording declares them
(recording/rows.py). The tables have ROBOCLIMBER's ranges; `fitted` gives them another machine's.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from testbed.control.distribution.corrected import VIEW
from testbed.control.gait import Observed
from testbed.control.layers import Trim
from testbed.errors import InputError
from testbed.formats.arrays import Array
from testbed.machine.model import Machine
from testbed.machine.names import AXES, LEGS, SIDES
from testbed.recording.rows import DataRow

COLUMNS = {column.name: column for column in DataRow.columns()}
"""What a run records, by name."""
OWN = ("orders.", "control.")
"""Rows under these names are control's own; all others are columns of the run's data."""
PRESSURE_PA = (0.0, 1.0e7)
"""Range of a pressure: that of ROBOCLIMBER's transducers."""
LOAD_N = (-2.0e3, 4.0e4)
"""Range of a foot load."""
PULL_N = (0.0, 5.0e4)
"""Range of a rope's tension."""
JOINTS = {"rotation": (-0.62, 0.62), "radial": (0.0, 0.4), "vertical": (0.0, 0.5)}
"""Range of each kind of joint, rad or m."""
REACH = {"rotation": math.radians(35.0), "radial": 0.4, "vertical": 0.5}
"""How far each kind of joint of ROBOCLIMBER goes, rad or m."""
ALONG_VERTICAL = "vertical joint, + ground pushes the foot up"
"""Frame of the foot loads."""


def seen(names: Iterable[str], span: tuple[float, float], frame: str = "-") -> list[Observed]:
    """Rows for recorded columns of one range."""
    found = [COLUMNS[name] for name in names]
    return [Observed(column.name, column.meaning, column.unit, frame, *span) for column in found]


def _each(name: str, labels: Sequence[str]) -> list[str]:
    return [f"{name}_{label}" for label in labels]


_SEEN = (
    *(
        row
        for axis in AXES
        for row in seen([f"position_{axis}"], JOINTS[axis.split("_")[1]], "joint")
    ),
    *seen([*_each("pressure_a", AXES), *_each("pressure_b", AXES)], PRESSURE_PA, "gauge"),
    *seen(["supply_pressure"], PRESSURE_PA, "gauge"),
    *seen(["oil_temperature"], (-20.0, 100.0)),
    *seen(_each("rope_tension", SIDES), PULL_N, "along it"),
    *seen(["attitude_roll"], (-0.5, 0.5), "body to world"),
    *seen(["attitude_pitch"], (-math.pi / 2, 0.2), "body to world"),
    *seen(["attitude_yaw"], (-0.5, 0.5), "body to world"),
    *seen(_each("angular_rate", "xyz"), (-0.2, 0.2), "body"),
    *seen(_each("estimate_own", LEGS), LOAD_N, ALONG_VERTICAL),
    *seen(_each("own_low", LEGS), LOAD_N, ALONG_VERTICAL),
    *seen(_each("own_high", LEGS), LOAD_N, ALONG_VERTICAL),
    *seen(_each("contact", LEGS), (0.0, 1.0)),
    *seen(_each("expected", LEGS), LOAD_N, ALONG_VERTICAL),
)
_OFFSETS = tuple(
    Observed(f"orders.offset_{leg}", f"set point offset, {leg}_vertical", "m", "joint", -0.02, 0.02)
    for leg in LEGS
)
_PULLS = (
    Observed(f"orders.pull_{side}", f"wanted pull of the {side} rope", "N", "along it", *PULL_N)
    for side in SIDES
)
_DRILL = (
    Observed("orders.thrust", "feed ordered, + lifts the body", "N", "body z", -2e4, 2e4),
    Observed("orders.torque", "torque ordered: its reaction", "N m", "body z", -2e3, 2e3),
)
TABLE: tuple[Observed, ...] = (
    *_SEEN,
    *_OFFSETS,
    *_PULLS,
    *_DRILL,
    *seen(_each("carrying", LEGS), (0.0, 1.0)),
)
"""The observation of the environments that move set points, index by index."""
_NEAR_LOAD_N = (0.0, 1.5e4)
"""Range of a foot load of a machine that stands."""
_STANDING = (
    *seen(_each("estimate_own", LEGS), _NEAR_LOAD_N, ALONG_VERTICAL),
    *seen(_each("contact", LEGS), (0.0, 1.0)),
    *seen(["attitude_pitch"], (-math.pi / 2, 0.0), "body to world"),
)
KEEP_TABLE: tuple[Observed, ...] = (
    *seen(_each("rope_tension", SIDES), (0.0, 3.5e4), "along it"),
    *(
        Observed(
            f"control.pull_change_{side}",
            f"tension of the {side} rope at the end of the step less that at the start of the run",
            "N",
            "along it",
            -2e4,
            2e4,
        )
        for side in SIDES
    ),
    *seen(_each("estimate_own", LEGS), _NEAR_LOAD_N, ALONG_VERTICAL),
    *seen(["attitude_pitch"], (-1.1, -0.6), "body to world"),
    *seen(["attitude_roll", "attitude_yaw"], (-0.05, 0.05), "body to world"),
    *seen(_each("angular_rate", "xyz"), (-0.05, 0.05), "body"),
    *(
        Observed(
            f"orders.hauled_{side}",
            f"way hauled of the {side} rope as ordered",
            "m",
            "along it",
            -0.15,
            0.15,
        )
        for side in SIDES
    ),
    Observed("orders.diagonal", "fl and rr raised over fr and rl", "m", "joint", -0.02, 0.02),
    Observed("orders.front", "fl and fr raised over rl and rr", "m", "joint", -0.02, 0.02),
    Observed("orders.shift", "body moved up the slope over its feet", "m", "slope", -0.12, 0.12),
)
"""The observation where a stance is to be kept."""
HOLE_TABLE: tuple[Observed, ...] = (
    Observed("control.bit_rate", "way of the bit in the last step", "m/s", "hole", 0.0, 0.03),
    Observed("orders.feed", "feed ordered while drilling", "N", "body z", 0.0, 1.2e4),
    Observed("orders.hammer", "share of the hammer's energy ordered", "1", "-", 0.0, 1.0),
    Observed("control.drilling", "the bit is at work", "1", "-", 0.0, 1.0),
    Observed("control.jammed", "the bit is jammed and turned free", "1", "-", 0.0, 1.0),
    Observed(
        "control.thrust_reserve",
        "thrust at which a foot would leave, as reckoned at the start",
        "N",
        "body z",
        0.0,
        3.0e4,
    ),
    *_STANDING,
    *seen(_each("rope_tension", SIDES), (0.0, 3.5e4), "along it"),
    Observed(
        "orders.diagonal", "load wanted on fl and rr beyond the plan's", "N", "body z", -2e3, 2e3
    ),
)
"""The observation where a hole is drilled."""
CLIMB_TABLE: tuple[Observed, ...] = (
    Observed("orders.stride", "stride of the last group of swings", "m", "slope", 0.0, 0.6),
    Observed("orders.height", "height of its swings", "m", "slope", 0.0, 0.12),
    Observed("orders.haste", "share of pump and valves over the usual", "1", "-", 0.5, 1.5),
    Observed("control.margin", "planned wrench margin of the next group", "N", "-", 0.0, 8e3),
    Observed("control.time", "time that the last group took", "s", "-", 0.0, 20.0),
    *_STANDING,
    *seen(_each("rope_tension", SIDES), (0.0, 3.5e4), "along it"),
    *seen(["supply_pressure"], (5.0e6, 1.0e7), "gauge"),
    *seen(["attitude_roll", "attitude_yaw"], (-0.1, 0.1), "body to world"),
)
"""The observation where a gait is decided on."""
SHARE_TABLE: tuple[Observed, ...] = VIEW
"""The observation where wanted loads are moved: what a controller that shares the load sees."""


class Observer:
    """Reads the table's rows off a run's data columns and control's orders."""

    def __init__(self, data_columns: Sequence[str], table: Sequence[Observed] = TABLE) -> None:
        """data_columns: names of the data rows' columns, in their order."""
        columns = {name: index for index, name in enumerate(data_columns)}
        own = [row.column.startswith(OWN) for row in table]
        data = [index for index in range(len(table)) if not own[index]]
        self._data_to, self._data_from = data, [columns[table[place].column] for place in data]
        self._orders = {row.column: index for index, row in enumerate(table) if own[index]}
        self._middle = np.array([(row.high + row.low) / 2 for row in table])
        self._half = np.array([(row.high - row.low) / 2 for row in table])
        self._raw = np.zeros(len(table))

    def observe(self, data_row: Array, orders: Mapping[str, float]) -> NDArray[np.float32]:
        """A new observation (len(table),) in [-1, 1] of a data row and the orders by their names in
        the table.
        """
        self._raw[self._data_to] = data_row[self._data_from]
        for name, place in self._orders.items():
            self._raw[place] = orders[name]
        clipped = np.clip((self._raw - self._middle) / self._half, -1.0, 1.0)
        return np.asarray(clipped, dtype=np.float32)


def rows_in(step_s: float, record_hz: int) -> int:
    """Recorded rows that an observation is the mean of. Raises InputError where no whole number of
    them makes a step.
    """
    rows = round(step_s * record_hz)
    if rows < 1 or not math.isclose(rows, step_s * record_hz):
        raise InputError(
            f"makes no whole rows of a step of {1000.0 * step_s:g} ms",
            field="rates.record_hz",
            value=record_hz,
            allowed="a whole multiple of 100",
        )
    return rows


def in_units(
    observation: NDArray[np.float32], table: Sequence[Observed] = TABLE
) -> dict[str, float]:
    """Column -> value in its unit, from a normalised observation (clipped rows stay clipped)."""
    return {
        row.column: float((row.high + row.low) / 2 + value * (row.high - row.low) / 2)
        for row, value in zip(table, observation, strict=True)
    }


def fitted(table: Sequence[Observed], machine: Machine) -> tuple[Observed, ...]:
    """The rows with the ranges of a machine: joints by how far they go, pressures by its
    transducers, all else by its size and the row's unit.
    """
    return tuple(row.times(_larger(row, machine)) for row in table)


def _larger(row: Observed, machine: Machine) -> float:
    """How many times as large the row's range is on this machine; exactly 1 on ROBOCLIMBER."""
    axis = machine.axes.get(row.column.removeprefix("position_"))
    if axis is not None:
        return max(map(abs, axis.limits.ends)) / REACH[axis.joint]
    if row.unit == "Pa":
        return machine.sensor.pressure_range_pa / PRESSURE_PA[1]
    return machine.scale.times(row.unit)


def as_markdown(table: Sequence[Observed] = TABLE) -> str:
    """The table as markdown: index, name, meaning, unit, frame, low, high."""
    lines = [
        "| index | name | meaning | unit | frame | low | high |",
        "|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {index} | {row.column} | {row.meaning} | {row.unit} | {row.frame} | {row.low:g} | {row.high:g} |"
        for index, row in enumerate(table)
    ]
    return "\n".join(lines)


# An agent's increments: what an action of the plain tasks adds to the set points of the trim.

OFFSET_STEP_M = 1.0e-4
"""Increment of a vertical set point of ROBOCLIMBER for an action of 1: one encoder count a step."""
OFFSET_RANGE_M = 0.02
"""Furthest that an agent may move a vertical set point of ROBOCLIMBER."""
PULL_STEP_N = 200.0
"""Increment of a wanted pull of ROBOCLIMBER's ropes for an action of 1."""


def action_rows(
    meaning: str, names: Sequence[str], unit: str, frame: str, size: float
) -> list[Observed]:
    """Rows of an action's table: what -1 to 1 means for each of `names`, from -size to size."""
    return [
        Observed(f"action_{name}", meaning.format(name), unit, frame, -size, size) for name in names
    ]


INCREMENTS = (
    *action_rows("vertical set point of {}, increment", LEGS, "m", "joint", OFFSET_STEP_M),
    *action_rows("wanted pull of the {} rope, increment", SIDES, "N", "along it", PULL_STEP_N),
)
"""The action of ROBOCLIMBER, index by index."""


def increase(trim: Trim, by: Array, machine: Machine) -> None:
    """Add increments (6,), m and N, to a trim whose wanted pulls are known: set points within their
    range, pulls within the rating of the traction devices.
    """
    assert trim.pull_n is not None
    furthest_m = machine.scale.length * OFFSET_RANGE_M
    trim.goal_m = np.clip(trim.goal_m + by[: len(LEGS)], -furthest_m, furthest_m)
    trim.pull_n = np.clip(trim.pull_n + by[len(LEGS) :], 0.0, machine.traction.rating_n)


def increased(trim: Trim) -> dict[str, float]:
    """Where a trim's set points are by now, by the names of the observations' table: m, N."""
    assert trim.pull_n is not None
    return {
        **{f"orders.offset_{leg}": trim.goal_m[index] for index, leg in enumerate(LEGS)},
        **{f"orders.pull_{side}": trim.pull_n[index] for index, side in enumerate(SIDES)},
    }
