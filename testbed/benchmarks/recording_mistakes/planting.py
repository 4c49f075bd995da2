"""The mistakes that people make with recordings, each as a change of a sample.

A planter takes what the table of mistakes says of it and returns the change.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from testbed.benchmarks.recording_mistakes.sample import REFERENCE, Sample
from testbed.formats.arrays import Array
from testbed.formats.units import UNITS
from testbed.machine.names import AXES
from testbed.recording.axis_header import Header
from testbed.recording.checker.balance import WORST
from testbed.recording.checker.forces import Forces
from testbed.recording.checker.motion import even
from testbed.recording.checker.raw import read_raw

Plant = Callable[[Sample], None]
SLOW_HZ, JUMP_S, SLOW_JUMP_S = 100.0, 0.05, 0.2
"""A clock jumps by JUMP_S, and by SLOW_JUMP_S where no more than SLOW_HZ are recorded."""
BACK_S, GAP_S, FROZEN_S = 0.5, 0.5, 1.0
CLIPPED_FROM = 0.9
"""Quantile of its values from which on a clipped channel stands still."""


def times(quantity: str, factor: float) -> Plant:
    """A channel in another unit or with another sign than declared."""

    def plant(sample: Sample) -> None:
        sample[quantity] = factor * sample[quantity]
        entry = sample.entry(quantity)
        if quantity == "position":
            if "resolution" in entry:
                entry["resolution"] *= abs(factor)
            if abs(factor) != 1.0:
                sample.head["known"].pop("stroke_m", None)

    return plant


def pressures_times(quantities: Sequence[str], factor: float) -> Plant:
    """Pressures in another unit or with another sign, those that are recorded in V too."""

    def plant(sample: Sample) -> None:
        for quantity in filter(sample.has, _each(sample, quantities)):
            entry = sample.entry(quantity)
            if "calibration" in entry:
                entry["calibration"]["k_pa_per_v"] *= factor
            else:
                sample[quantity] = factor * sample[quantity]
            entry.pop("range_pa", None)

    return plant


def _each(sample: Sample, quantities: Sequence[str]) -> list[str]:
    """`every_pressure`, `every_position`: of a robot all of its axes', otherwise the axis' own."""
    found: list[str] = []
    for quantity in quantities:
        if quantity == "every_pressure":
            own = [f"pressure_{chamber}" for chamber in "ab"]
            found += [f"{p}_{axis}" for axis in AXES for p in own] if sample.axis else own
        elif quantity == "every_position":
            found += [f"position_{axis}" for axis in AXES] if sample.axis else ["position"]
        else:
            found.append(quantity)
    return found


def exchanged(first: str, second: str) -> Plant:
    """Two channels in each other's place."""

    def plant(sample: Sample) -> None:
        channels = sample.head["channels"]
        one, other = str(sample.channel(first)), str(sample.channel(second))
        channels[one], channels[other] = channels[other], channels[one]

    return plant


def from_the_rod_end() -> Plant:
    """Chambers, position, forces and valve all counted from the rod's end: the areas are
    exchanged, and nothing else.
    """

    def plant(sample: Sample) -> None:
        exchanged("pressure_a", "pressure_b")(sample)
        sample["position"] = float(np.max(sample["position"])) - sample["position"]
        for quantity in filter(sample.has, ("force", "valve_command")):
            sample[quantity] = -sample[quantity]
        if sample.head["known"].get("inclination_deg") is not None:
            sample.head["known"]["inclination_deg"] = (
                180.0 - sample.head["known"]["inclination_deg"]
            )

    return plant


def declared(number: str, factor: float) -> Plant:
    """A declared number that is off; of a robot, one of its vertical cylinders."""

    def plant(sample: Sample) -> None:
        known = sample.head["known"]
        if sample.axis is not None:
            known[f"vertical_cylinder.{number}"]["value"] *= factor
        else:
            known[number] *= factor

    return plant


def in_unit(quantities: Sequence[str], unit: str, as_declared: str | None = None) -> Plant:
    """Channels written in `unit`; declared so, or as `as_declared`."""

    def plant(sample: Sample) -> None:
        for quantity in filter(sample.has, _each(sample, quantities)):
            entry = sample.entry(quantity)
            here, there = UNITS[str(entry["unit"])], UNITS[unit]
            if here.si != there.si:
                continue  # a pressure in V
            factor = here.factor / there.factor
            sample[quantity] = (sample[quantity] + here.zero) * factor - there.zero
            entry["unit"] = as_declared or unit
            for name in ("resolution", "standard_deviation"):
                if entry.get(name):
                    entry[name] *= factor

    return plant


def clock_jumps() -> Plant:
    """Later times in the midst of a motion, which goes on as if nothing had happened."""

    def plant(sample: Sample) -> None:
        time = sample["time"].copy()
        quick = sample.head["sample_rate_hz"] > SLOW_HZ
        time[sample.row_in_motion() :] += JUMP_S if quick else SLOW_JUMP_S
        sample["time"] = time

    return plant


def clock_set_back() -> Plant:
    """Earlier times from the middle on."""

    def plant(sample: Sample) -> None:
        time = sample["time"].copy()
        time[len(time) // 2 :] -= BACK_S
        sample["time"] = time

    return plant


def clock_jitters(share: float) -> Plant:
    """Even samples with stamps that come late or early by up to a share of a step."""

    def plant(sample: Sample) -> None:
        time = sample["time"]
        off = np.random.default_rng(0).uniform(-share, share, len(time))
        sample["time"] = time + off * sample.step_s()

    return plant


def rows_doubled() -> Plant:
    """Three rows twice."""

    def plant(sample: Sample) -> None:
        sample.keep(np.sort(np.r_[np.arange(len(sample["time"])), 100, 101, 102]))

    return plant


def gap() -> Plant:
    """Rows that are missing in the middle."""

    def plant(sample: Sample) -> None:
        time = sample["time"]
        middle = 0.5 * (time[0] + time[-1])
        sample.keep((time < middle) | (time > middle + GAP_S))

    return plant


def another_rate(factor: float) -> Plant:
    """Another rate than declared."""

    def plant(sample: Sample) -> None:
        sample.head["sample_rate_hz"] *= factor

    return plant


def frozen(quantity: str, seconds: float = FROZEN_S) -> Plant:
    """One value from a moment in motion on, a force's from where it changes most; a valve's for
    half of the recording.
    """

    def plant(sample: Sample) -> None:
        values, time = sample[quantity].copy(), sample["time"]
        row, lasts_s = sample.row_in_motion(), seconds
        if quantity == "force":
            row = _where_it_changes(values, round(seconds / sample.step_s()))
        if quantity == "valve_command":
            row, lasts_s = len(time) // 4, 0.5 * float(time[-1] - time[0])
        values[(time >= time[row]) & (time < time[row] + lasts_s)] = values[row]
        sample[quantity] = values

    return plant


def _where_it_changes(values: Array, rows: int) -> int:
    """The row in the middle half about which values (n,) change most within `rows` rows."""
    half, quarter = max(rows // 2, 1), len(values) // 4
    change = np.abs(values[2 * half :] - values[: -2 * half])
    low, high = max(quarter - half, 0), max(3 * quarter - half, quarter - half + 1)
    return low + half + int(np.argmax(change[low:high]))


def dead(quantity: str) -> Plant:
    """One value all the time."""

    def plant(sample: Sample) -> None:
        values = sample[quantity]
        sample[quantity] = np.full_like(values, float(np.median(values)))

    return plant


def clipped(quantity: str) -> Plant:
    """A tenth of the values cut off at the top, with no range declared."""

    def plant(sample: Sample) -> None:
        values = sample[quantity]
        sample[quantity] = np.minimum(values, np.quantile(values, CLIPPED_FROM))
        sample.entry(quantity).pop("range_pa", None)

    return plant


def late(quantity: str, seconds: float) -> Plant:
    """A channel that comes later than the others."""

    def plant(sample: Sample) -> None:
        time = sample["time"]
        sample[quantity] = np.interp(time - seconds, time, sample[quantity])

    return plant


def not_a_number(quantity: str) -> Plant:
    """Seven rows without a number."""

    def plant(sample: Sample) -> None:
        values = sample[quantity].copy()
        values[len(values) // 3 : len(values) // 3 + 7] = np.nan
        sample[quantity] = values

    return plant


def spike(quantity: str) -> Plant:
    """A single value far away."""

    def plant(sample: Sample) -> None:
        values = sample[quantity].copy()
        values[len(values) // 4] += 20.0 * np.ptp(values)
        sample[quantity] = values

    return plant


def zero_off(quantity: str, share: float) -> Plant:
    """A sensor's zero that is off by a share of its range; where none is declared, of what it
    reads at most.
    """

    def plant(sample: Sample) -> None:
        entry, values = sample.entry(quantity), sample[quantity]
        low, high = entry.get("range_pa", (0.0, float(np.quantile(np.abs(values), 0.99))))
        off = share * (high - low)
        if "calibration" in entry:
            entry["calibration"]["b"] += off / entry["calibration"]["k_pa_per_v"]
        else:
            sample[quantity] = values + off
        entry.pop("range_pa", None)

    return plant


def lost(quantity: str) -> Plant:
    """A declared column that the table does not have."""

    def plant(sample: Sample) -> None:
        del sample.columns[str(sample.column(quantity))]

    return plant


def coarser(quantity: str, step: float) -> Plant:
    """Values in steps of `step`, another one than declared."""

    def plant(sample: Sample) -> None:
        sample[quantity] = np.round(sample[quantity] / step) * step

    return plant


PLANTERS: Mapping[str, Callable[..., Plant]] = {
    planter.__name__: planter
    for planter in (
        times,
        pressures_times,
        exchanged,
        from_the_rod_end,
        declared,
        in_unit,
        clock_jumps,
        clock_set_back,
        clock_jitters,
        rows_doubled,
        gap,
        another_rate,
        frozen,
        dead,
        clipped,
        late,
        not_a_number,
        spike,
        zero_off,
        lost,
        coarser,
    )
}
"""Name in the table of mistakes -> planter."""

Sees = Callable[[Sample, Sample], bool]


def _known(sample: Sample, number: str) -> Any:
    return sample.head["known"].get(number)


def _force_is_known(sample: Sample) -> bool:
    kind = (sample.head.get(REFERENCE) or {}).get("kind")
    return sample.axis is not None or kind is not None


def _closes(spoilt: Sample) -> bool:
    """Whether the forces balance, but for what models of sound machines lack too."""
    with tempfile.TemporaryDirectory() as place:
        raw = read_raw(spoilt.write(Path(place)))
    names = {
        "pressure_a": "pressure_a",
        "pressure_b": "pressure_b",
        "force": "actuator_force",
        "reference": REFERENCE,
    }
    if not isinstance(raw.header, Header) or not _force_is_known(spoilt):
        return False
    return Forces(even(raw, names), raw.header.known).misfit({}) < WORST


BLIND: Mapping[str, Sees] = {
    "force unknown": lambda sample, _: not _force_is_known(sample),
    "slides too little": lambda sample, _: not sample.slides(),
    "mass unknown": lambda sample, _: sample.axis is None and not _known(sample, "moving_mass_kg"),
    "no valve flow declared": lambda sample, _: (
        not sample.has("valve_command")
        or (sample.axis is None and not _known(sample, "valve_rated_flow_m3_s"))
    ),
    "robot": lambda sample, _: sample.axis is not None,
    "drive of unknown mass": lambda sample, _: (
        sample.head["rig"] == "drive" and not _known(sample, "moving_mass_kg")
    ),
    "balances all the same": lambda _, spoilt: _closes(spoilt),
}
"""What a recording, or it with the mistake, may lack so that physics cannot show it; by the name
that the table gives it."""
