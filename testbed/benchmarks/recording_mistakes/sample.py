"""A recording in memory that may be spoilt: its header as it stands in the file, and columns."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from testbed.errors import InputError
from testbed.formats.arrays import Array, Flags
from testbed.formats.table import read_columns, write_columns
from testbed.formats.yaml_files import read_mapping, write_yaml
from testbed.machine.names import LEGS
from testbed.recording.axis import Recording, recording_folder
from testbed.recording.axis_header import RECORDING, check_format

Columns = dict[str, Array]
REFERENCE = "reference_force"
OF_ANY_RIG = {"force": (REFERENCE, "actuator_force", "force")}
"""One word for the force that is known from outside, whatever the rig calls it."""
SLIDES_M_S, SLIDES_SHARE = 3e-3, 0.05
"""Speed from which a piston slides for certain, and the share of the time in which it has to each
way."""


@dataclass
class Sample:
    """Header as in recording.yaml and columns (n,) in the header's units, both free to be changed.

    `axis`: of a robot, the one whose sensors are meant by `position`, `pressure_a` and the like.
    """

    head: dict[str, Any]
    columns: Columns
    axis: str | None = None

    def channel(self, quantity: str) -> str | None:
        """The name of a quantity's channel in this recording, None where it is not recorded."""
        names = OF_ANY_RIG.get(quantity, (quantity,))
        if self.axis is not None:
            own = {"time": "t", "valve_command": f"valve_{self.axis}"}
            names = (*names, own.get(quantity, f"{quantity}_{self.axis}"))
        for name in names:
            if name in self.head["channels"]:
                return name
            if name == REFERENCE and (self.head.get(REFERENCE) or {}).get("column"):
                return name
        return None

    def column(self, quantity: str) -> str | None:
        """The table's column of a quantity, None where it is not recorded."""
        name = self.channel(quantity)
        return None if name is None else str(self.entry(quantity)["column"])

    def entry(self, quantity: str) -> dict[str, Any]:
        """What the header says of a quantity that is recorded: column, unit and the like."""
        name = self.channel(quantity)
        found: dict[str, Any] = (
            self.head[REFERENCE] if name == REFERENCE else self.head["channels"][name]
        )
        return found

    def has(self, *quantities: str) -> bool:
        """Whether all of these are recorded."""
        return all(self.column(quantity) for quantity in quantities)

    def __getitem__(self, quantity: str) -> Array:
        return self.columns[str(self.column(quantity))]

    def __setitem__(self, quantity: str, values: Array) -> None:
        self.columns[str(self.column(quantity))] = values

    def keep(self, rows: Flags | Array) -> None:
        """Leave only these rows."""
        self.columns = {name: values[rows] for name, values in self.columns.items()}

    def with_mistake(self, plant: Callable[[Sample], None]) -> Sample:
        """A copy with a mistake in it."""
        changed = copy.deepcopy(self)
        plant(changed)
        return changed

    def write(self, folder: Path) -> Path:
        """Write it as a recording; returns the folder."""
        folder.mkdir(parents=True, exist_ok=True)
        write_yaml(folder / "recording.yaml", self.head)
        write_columns(folder / self.head["data"], self.columns)
        return folder

    def step_s(self) -> float:
        """Usual distance of two samples, in the unit of the time's column."""
        return float(np.median(np.diff(self["time"])))

    def speeds(self) -> Array:
        """Speeds (n,) by differences over 50 ms, in the position's unit, 0 in the last ones."""
        step = self.step_s()
        rows = min(max(1, round(0.05 / step)), len(self["time"]) - 1)
        speed = np.zeros(len(self["time"]))
        speed[:-rows] = (self["position"][rows:] - self["position"][:-rows]) / (rows * step)
        return speed

    def slides(self) -> bool:
        """Whether the piston slides both ways for longer than moments: a leg that is pressed on a
        load cell shows no sign of its position.
        """
        if not self.has("position"):
            return False
        speeds = self.speeds()
        return all(np.mean(way * speeds > SLIDES_M_S) > SLIDES_SHARE for way in (1.0, -1.0))

    def row_in_motion(self) -> int:
        """A row in the middle half of the recording at which the position moves steadily."""
        speed = np.abs(self.speeds())
        quarter = len(speed) // 4
        rows = min(max(3, round(0.1 / self.step_s())), len(speed))
        steady = np.convolve(speed, np.ones(rows) / rows, "same") * (speed > 0)
        return quarter + int(np.argmax(steady[quarter : 3 * quarter]))


def load(place: str | Path) -> Sample:
    """Read a recording as it stands. Raises InputError where there is none, or its table cannot be
    read.
    """
    folder = recording_folder(place)
    file = folder / "recording.yaml"
    head = read_mapping(file, RECORDING)
    check_format(head, file)
    wanted = {
        str(entry["column"]): f"channels.{name}.column" for name, entry in head["channels"].items()
    }
    reference = (head.get(REFERENCE) or {}).get("column")
    if reference is not None:
        wanted[str(reference)] = f"{REFERENCE}.column"
    columns = read_columns(folder / str(head["data"]), wanted, file)
    sample = Sample(head, {name: values.copy() for name, values in columns.items()})
    if head["rig"] == "robot":
        vertical = [f"{leg}_vertical" for leg in LEGS]
        sample.axis = max(vertical, key=lambda axis: float(np.ptp(sample[f"position_{axis}"])))
    return sample


def of_recording(recording: Recording) -> Sample:
    """A recording that was made in memory, as it would stand in its file."""
    head = recording.header.model_dump(mode="json", exclude_none=True)
    values = {
        "time": recording.time_s,
        "position": recording.position_m,
        "valve_command": recording.valve_command,
        "pressure_a": recording.pressure_a_pa,
        "pressure_b": recording.pressure_b_pa,
        "supply_pressure": recording.supply_pressure_pa,
        "oil_temperature": recording.oil_temperature_degc,
        "actuator_force": recording.actuator_force_n,
        **recording.extra,
    }
    columns: Columns = {}
    for name, channel in recording.header.channels.items():
        series = values[name]
        if series is None:
            raise InputError("has no values", field=f"channels.{name}")
        turned = channel.calibration is not None
        columns[channel.column] = channel.calibration.volts(series) if turned else series  # type: ignore[union-attr]
    reference = recording.header.reference_force
    if reference is not None and reference.column and recording.reference_force_n is not None:
        columns[reference.column] = recording.reference_force_n
    return Sample(head, columns)
