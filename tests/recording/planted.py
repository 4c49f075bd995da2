"""Faults that recordings come with, each planted into a sound one, and where a checker should see
it.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.csv
import pyarrow.parquet
import yaml

from testbed.formats.table import write_columns
from testbed.formats.yaml_files import write_yaml

Columns = dict[str, np.ndarray]
REFERENCE = "reference_force"


@dataclass
class Sample:
    """A recording in memory: header, columns by name, and the column of each quantity."""

    head: dict[str, Any]
    columns: Columns

    def column(self, quantity: str) -> str | None:
        if quantity == REFERENCE:
            return (self.head.get(REFERENCE) or {}).get("column")
        return self.head["channels"].get(quantity, {}).get("column")

    def has(self, *quantities: str) -> bool:
        return all(self.column(q) for q in quantities)

    def __getitem__(self, quantity: str) -> np.ndarray:
        return self.columns[self.column(quantity)]  # type: ignore[index]

    def __setitem__(self, quantity: str, values: np.ndarray) -> None:
        self.columns[self.column(quantity)] = values  # type: ignore[index]

    def keep(self, rows: np.ndarray) -> None:
        self.columns = {name: v[rows] for name, v in self.columns.items()}

    def write(self, folder: Path) -> Path:
        folder.mkdir(parents=True, exist_ok=True)
        write_yaml(folder / "recording.yaml", self.head)
        write_columns(folder / self.head["data"], self.columns)
        return folder


def load(folder: Path) -> Sample:
    head = yaml.safe_load((folder / "recording.yaml").read_text())
    path = folder / head["data"]
    csv = path.suffix == ".csv"
    table = pyarrow.csv.read_csv(path) if csv else pyarrow.parquet.read_table(path)
    return Sample(head, {c: table[c].to_numpy().astype(float) for c in table.column_names})


@dataclass(frozen=True)
class Fault:
    """What is planted, whether a recording can show it at all, and the channels one of which must
    be named.
    """

    plant: Callable[[Sample], None]
    channels: tuple[str, ...]
    applies: Callable[[Sample], bool]


def planted(sample: Sample, fault: Fault) -> Sample:
    changed = copy.deepcopy(sample)
    fault.plant(changed)
    return changed


def _moving(s: Sample) -> np.ndarray:
    """Speeds by differences over 50 ms."""
    step = float(np.median(np.diff(s["time"])))
    k = max(1, round(0.05 / step))
    speed = np.zeros(len(s["time"]))
    speed[:-k] = (s["position"][k:] - s["position"][:-k]) / (k * step)
    return speed


def _row_in_motion(s: Sample) -> int:
    """A row in the middle half of the recording at which the position moves steadily."""
    speed = np.abs(_moving(s))
    n = len(speed)
    middle = slice(n // 4, 3 * n // 4)
    step = float(np.median(np.diff(s["time"])))
    k = max(3, round(0.1 / step))
    steady = np.convolve(speed, np.ones(k) / k, "same") * (speed > 0)
    return n // 4 + int(np.argmax(steady[middle]))


def times(quantity: str, factor: float) -> Callable[[Sample], None]:
    def plant(s: Sample) -> None:
        s[quantity] = factor * s[quantity]
        if quantity == "position" and "resolution" in s.head["channels"]["position"]:
            s.head["channels"]["position"]["resolution"] *= abs(factor)
        if abs(factor) != 1.0:
            s.head["known"].pop("stroke_m", None) if quantity == "position" else None

    return plant


def in_volt_or_pa(factor: float, *quantities: str) -> Callable[[Sample], None]:
    """Pressures scaled, calibration and all."""

    def plant(s: Sample) -> None:
        for quantity in quantities:
            channel = s.head["channels"].get(quantity)
            if channel is None:
                continue
            if "calibration" in channel:
                channel["calibration"]["k_pa_per_v"] *= factor
            else:
                s[quantity] = factor * s[quantity]
            channel.pop("range_pa", None)

    return plant


def swapped(s: Sample) -> None:
    channels = s.head["channels"]
    channels["pressure_a"], channels["pressure_b"] = channels["pressure_b"], channels["pressure_a"]


def clock_jump(s: Sample) -> None:
    time = s["time"].copy()
    time[_row_in_motion(s) :] += 0.05 if s.head["sample_rate_hz"] > 100 else 0.2
    s["time"] = time


def clock_back(s: Sample) -> None:
    time = s["time"].copy()
    time[len(time) // 2 :] -= 0.5
    s["time"] = time


def doubled(s: Sample) -> None:
    s.keep(np.sort(np.r_[np.arange(len(s["time"])), 100, 101, 102]))


def gap(s: Sample) -> None:
    time = s["time"]
    middle = 0.5 * (time[0] + time[-1])
    s.keep((time < middle) | (time > middle + 0.5))


def rate(s: Sample) -> None:
    s.head["sample_rate_hz"] *= 2


def milliseconds(s: Sample) -> None:
    s["time"] = 1e3 * s["time"]


def frozen(quantity: str, seconds: float = 1.0) -> Callable[[Sample], None]:
    def plant(s: Sample) -> None:
        values, time = s[quantity].copy(), s["time"]
        row = _row_in_motion(s)
        if quantity == "valve_command":
            seconds_here = 0.5 * (time[-1] - time[0])
            row = len(time) // 4
        else:
            seconds_here = seconds
        values[(time >= time[row]) & (time < time[row] + seconds_here)] = values[row]
        s[quantity] = values

    return plant


def clipped(quantity: str) -> Callable[[Sample], None]:
    def plant(s: Sample) -> None:
        values = s[quantity]
        s[quantity] = np.minimum(values, np.quantile(values, 0.9))
        s.head["channels"].get(quantity, {}).pop("range_pa", None)

    return plant


def not_a_number(quantity: str) -> Callable[[Sample], None]:
    def plant(s: Sample) -> None:
        values = s[quantity].copy()
        values[len(values) // 3 : len(values) // 3 + 7] = np.nan
        s[quantity] = values

    return plant


def dead(quantity: str) -> Callable[[Sample], None]:
    def plant(s: Sample) -> None:
        s[quantity] = np.full_like(s[quantity], float(np.median(s[quantity])))

    return plant


def spike(quantity: str) -> Callable[[Sample], None]:
    def plant(s: Sample) -> None:
        values = s[quantity].copy()
        values[len(values) // 4] += 20.0 * np.ptp(values)
        s[quantity] = values

    return plant


def mass_in_grams(s: Sample) -> None:
    s.head["known"]["moving_mass_kg"] *= 1e3


def lost(quantity: str) -> Callable[[Sample], None]:
    def plant(s: Sample) -> None:
        del s.columns[s.column(quantity)]  # type: ignore[arg-type]

    return plant


def coarser(s: Sample) -> None:
    s["position"] = np.round(s["position"] / 5e-4) * 5e-4


def needs(*quantities: str) -> Callable[[Sample], bool]:
    return lambda s: s.has(*quantities)


def slides(*quantities: str) -> Callable[[Sample], bool]:
    """Both ways, for more than a tenth of the time: a leg pressed on a load cell shows no sign of
    its position.
    """
    return lambda s: (
        s.has("position", *quantities)
        and all(np.mean(sign * _moving(s) > 3e-3) > 0.05 for sign in (1.0, -1.0))
    )


def loaded(s: Sample) -> bool:
    return s.has(REFERENCE) and s.has("pressure_a")


FORCES = ("position", "actuator_force")
PRESSURES = ("pressure_a", "pressure_b", "pressure_a, pressure_b")
FAULTS: dict[str, Fault] = {
    "position turned round": Fault(times("position", -1.0), (*FORCES, "valve_command"), slides()),
    "position in mm": Fault(times("position", 1e3), ("position",), slides()),
    "chambers exchanged": Fault(swapped, PRESSURES, needs("pressure_a", "pressure_b")),
    "actuator force turned round": Fault(
        times("actuator_force", -1.0), FORCES, needs("actuator_force")
    ),
    "load cell turned round": Fault(times(REFERENCE, -1.0), (REFERENCE,), loaded),
    "load cell in kN": Fault(times(REFERENCE, 1e-3), (REFERENCE, *PRESSURES), loaded),
    "valve turned round": Fault(
        times("valve_command", -1.0), ("valve_command",), slides("valve_command")
    ),
    "valve in per cent": Fault(
        times("valve_command", 100.0), ("valve_command",), needs("valve_command")
    ),
    "pressures in bar": Fault(
        in_volt_or_pa(1e-5, "pressure_a", "pressure_b"), PRESSURES, needs("pressure_a")
    ),
    "pressure A in bar": Fault(in_volt_or_pa(1e-5, "pressure_a"), PRESSURES, needs("pressure_a")),
    "pressure A in psi": Fault(
        in_volt_or_pa(1.0 / 6894.76, "pressure_a"), PRESSURES, needs("pressure_a")
    ),
    "pressure A turned round": Fault(
        in_volt_or_pa(-1.0, "pressure_a"),
        (*PRESSURES, "channels.pressure_a.calibration.k_pa_per_v"),
        needs("pressure_a"),
    ),
    "supply in bar": Fault(
        in_volt_or_pa(1e-5, "supply_pressure"), ("supply_pressure",), needs("supply_pressure")
    ),
    "clock jumps": Fault(clock_jump, ("time",), slides()),
    "clock set back": Fault(clock_back, ("time",), needs("time")),
    "rows doubled": Fault(doubled, ("time",), needs("time")),
    "gap": Fault(gap, ("time",), needs("time")),
    "another rate": Fault(rate, ("time",), needs("time")),
    "time in ms": Fault(milliseconds, ("time",), needs("time")),
    "position frozen": Fault(frozen("position"), ("position",), slides()),
    "pressure A frozen": Fault(frozen("pressure_a"), ("pressure_a",), slides("pressure_a")),
    "valve frozen": Fault(frozen("valve_command"), ("valve_command",), slides("valve_command")),
    "pressure A clipped": Fault(clipped("pressure_a"), ("pressure_a",), needs("pressure_a")),
    "pressure A not a number": Fault(
        not_a_number("pressure_a"), ("pressure_a",), needs("pressure_a")
    ),
    "position not a number": Fault(not_a_number("position"), ("position",), needs("position")),
    "pressure A dead": Fault(dead("pressure_a"), ("pressure_a",), slides("pressure_a")),
    "position has a spike": Fault(spike("position"), ("position",), needs("position")),
    "load cell half as large again": Fault(
        times(REFERENCE, 1.5), (REFERENCE, "pressure_a"), lambda s: loaded(s) and slides()(s)
    ),
    "mass in grams": Fault(
        mass_in_grams,
        ("known.moving_mass_kg", "actuator_force"),
        lambda s: bool(s.head["known"].get("moving_mass_kg")) and slides()(s),
    ),
    "column lost": Fault(lost("position"), ("channels.position.column",), needs("position")),
    "encoder coarser": Fault(
        coarser,
        ("position",),
        lambda s: "resolution" in s.head["channels"]["position"] and slides()(s),
    ),
}
