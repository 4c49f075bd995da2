"""What an agent sees: one table, each row with its meaning, unit, frame and range.

An observation is the vector of all rows, each mapped from [low, high] to [-1, 1] and clipped there. Everything in it
is a measurement, an estimate or an order of control itself, never a truth of the world.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from testbed.control.distribution.corrected import VIEW
from testbed.machine.names import AXES, LEGS, SIDES

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Row:
    """One number of the observation."""

    column: str
    """Column of the run's data, or a name under `orders.` or `control.`: what control itself ordered or worked out."""
    meaning: str
    unit: str
    frame: str
    low: float
    high: float


def _joints() -> list[Row]:
    ranges = {
        "rotation": (-0.62, 0.62, "rad"),
        "radial": (0.0, 0.4, "m"),
        "vertical": (0.0, 0.5, "m"),
    }
    rows = []
    for axis in AXES:
        low, high, unit = ranges[axis.split("_")[1]]
        rows.append(Row(f"position_{axis}", f"encoder of {axis}", unit, "joint", low, high))
    return rows


def _pressures() -> list[Row]:
    return [
        Row(
            f"pressure_{chamber}_{axis}",
            f"transducer at chamber {chamber.upper()} of {axis}",
            "Pa",
            "gauge",
            0.0,
            1e7,
        )
        for chamber in "ab"
        for axis in AXES
    ]


def _body() -> list[Row]:
    return [
        Row("supply_pressure", "supply", "Pa", "gauge", 0.0, 1e7),
        Row("oil_temperature", "oil in the tank", "degC", "-", -20.0, 100.0),
        *(
            Row(f"rope_tension_{side}", f"load pin of the {side} rope", "N", "along it", 0.0, 5e4)
            for side in SIDES
        ),
        Row("attitude_roll", "roll", "rad", "body to world", -0.5, 0.5),
        Row(
            "attitude_pitch",
            "pitch; minus the slope where parallel to it",
            "rad",
            "body to world",
            -math.pi / 2,
            0.2,
        ),
        Row("attitude_yaw", "yaw", "rad", "body to world", -0.5, 0.5),
        *(Row(f"angular_rate_{k}", f"rate about {k}", "rad/s", "body", -0.2, 0.2) for k in "xyz"),
    ]


def _estimates() -> list[Row]:
    along = "vertical joint, + ground pushes the foot up"
    return [
        *(
            Row(f"estimate_own_{leg}", f"estimated load of {leg}", "N", along, -2e3, 4e4)
            for leg in LEGS
        ),
        *(
            Row(
                f"own_low_{leg}",
                f"lower end of its interval, {leg}",
                "N",
                along,
                -2e3,
                4e4,
            )
            for leg in LEGS
        ),
        *(
            Row(
                f"own_high_{leg}",
                f"upper end of its interval, {leg}",
                "N",
                along,
                -2e3,
                4e4,
            )
            for leg in LEGS
        ),
        *(Row(f"contact_{leg}", f"contact word of {leg}", "1", "-", 0.0, 1.0) for leg in LEGS),
        *(
            Row(f"expected_{leg}", f"load of {leg} expected from the model", "N", along, -2e3, 4e4)
            for leg in LEGS
        ),
    ]


def _offsets() -> list[Row]:
    return [
        Row(f"orders.offset_{leg}", f"set point offset, {leg}_vertical", "m", "joint", -0.02, 0.02)
        for leg in LEGS
    ]


def _orders() -> list[Row]:
    return [
        *(
            Row(f"orders.pull_{side}", f"wanted pull of the {side} rope", "N", "along it", 0.0, 5e4)
            for side in SIDES
        ),
        Row(
            "orders.thrust",
            "feed ordered, + lifts the body; pulling out is -",
            "N",
            "body z",
            -2e4,
            2e4,
        ),
        Row(
            "orders.torque", "torque ordered, its reaction on the body", "N m", "body z", -2e3, 2e3
        ),
        *(Row(f"carrying_{leg}", f"{leg} is meant to carry", "1", "-", 0.0, 1.0) for leg in LEGS),
    ]


_SEEN = (*_joints(), *_pressures(), *_body(), *_estimates())
TABLE: tuple[Row, ...] = (*_SEEN, *_offsets(), *_orders())
"""The observation of the environments that move set points, index by index."""
SHARE_TABLE: tuple[Row, ...] = tuple(Row(*row) for row in VIEW)
"""The observation where wanted loads are moved: what a controller that shares the load sees."""


class Observer:
    """Reads the table's rows off a run's data columns and control's orders."""

    def __init__(self, data_columns: Sequence[str], table: Sequence[Row] = TABLE) -> None:
        columns = {name: k for k, name in enumerate(data_columns)}
        ordered = [row.column.startswith(("orders.", "control.")) for row in table]
        self._data_to = np.array([k for k, own in enumerate(ordered) if not own])
        self._data_from = np.array([columns[table[k].column] for k in self._data_to])
        self._orders_to = np.array([k for k, own in enumerate(ordered) if own])
        self._middle = np.array([(row.high + row.low) / 2 for row in table])
        self._half = np.array([(row.high - row.low) / 2 for row in table])
        self._raw = np.zeros(len(table))

    def look(self, data_row: Array, orders: Array) -> NDArray[np.float32]:
        """A new observation (len(table),) in [-1, 1] of a data row and the orders (8,) in the table's order."""
        self._raw[self._data_to] = data_row[self._data_from]
        self._raw[self._orders_to] = orders
        clipped = np.clip((self._raw - self._middle) / self._half, -1.0, 1.0)
        return np.asarray(clipped, dtype=np.float32)


def in_units(observation: NDArray[np.float32], table: Sequence[Row] = TABLE) -> dict[str, float]:
    """Column -> value in its unit, from a normalised observation (clipped rows stay clipped)."""
    return {
        row.column: float((row.high + row.low) / 2 + value * (row.high - row.low) / 2)
        for row, value in zip(table, observation, strict=True)
    }


def as_markdown(table: Sequence[Row] = TABLE) -> str:
    """A table as markdown: index, name, meaning, unit, frame, low, high."""
    lines = [
        "| index | name | meaning | unit | frame | low | high |",
        "|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {k} | {r.column} | {r.meaning} | {r.unit} | {r.frame} | {r.low:g} | {r.high:g} |"
        for k, r in enumerate(table)
    ]
    return "\n".join(lines)
