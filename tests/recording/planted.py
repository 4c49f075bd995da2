"""Faults that recordings come with, each planted into a sound one, and where a checker should see
it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from testbed.benchmarks.recording_mistakes.planting import (
    Plant,
    another_rate,
    clipped,
    clock_jumps,
    clock_set_back,
    coarser,
    dead,
    declared,
    exchanged,
    frozen,
    gap,
    lost,
    not_a_number,
    pressures_times,
    rows_doubled,
    spike,
    times,
)
from testbed.benchmarks.recording_mistakes.sample import REFERENCE, Sample, load

__all__ = ["FAULTS", "REFERENCE", "Fault", "Sample", "load", "planted"]


@dataclass(frozen=True)
class Fault:
    """What is planted, whether a recording can show it at all, and the channels one of which must
    be named.
    """

    plant: Plant
    channels: tuple[str, ...]
    applies: Callable[[Sample], bool]


def planted(sample: Sample, fault: Fault) -> Sample:
    return sample.with_mistake(fault.plant)


def needs(*quantities: str) -> Callable[[Sample], bool]:
    return lambda sample: sample.has(*quantities)


def slides(*quantities: str) -> Callable[[Sample], bool]:
    return lambda sample: sample.has("position", *quantities) and sample.slides()


def loaded(sample: Sample) -> bool:
    return sample.has(REFERENCE, "pressure_a")


FORCES = ("position", "actuator_force")
PRESSURES = ("pressure_a", "pressure_b", "pressure_a, pressure_b")
FAULTS: dict[str, Fault] = {
    "position turned round": Fault(times("position", -1.0), (*FORCES, "valve_command"), slides()),
    "position in mm": Fault(times("position", 1e3), ("position",), slides()),
    "chambers exchanged": Fault(
        exchanged("pressure_a", "pressure_b"), PRESSURES, needs("pressure_a", "pressure_b")
    ),
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
        pressures_times(("pressure_a", "pressure_b"), 1e-5), PRESSURES, needs("pressure_a")
    ),
    "pressure A in bar": Fault(
        pressures_times(("pressure_a",), 1e-5), PRESSURES, needs("pressure_a")
    ),
    "pressure A in psi": Fault(
        pressures_times(("pressure_a",), 1.0 / 6894.76), PRESSURES, needs("pressure_a")
    ),
    "pressure A turned round": Fault(
        pressures_times(("pressure_a",), -1.0),
        (*PRESSURES, "channels.pressure_a.calibration.k_pa_per_v"),
        needs("pressure_a"),
    ),
    "supply in bar": Fault(
        pressures_times(("supply_pressure",), 1e-5), ("supply_pressure",), needs("supply_pressure")
    ),
    "clock jumps": Fault(clock_jumps(), ("time",), slides()),
    "clock set back": Fault(clock_set_back(), ("time",), needs("time")),
    "rows doubled": Fault(rows_doubled(), ("time",), needs("time")),
    "gap": Fault(gap(), ("time",), needs("time")),
    "another rate": Fault(another_rate(2.0), ("time",), needs("time")),
    "time in ms": Fault(times("time", 1e3), ("time",), needs("time")),
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
        declared("moving_mass_kg", 1e3),
        ("known.moving_mass_kg", "actuator_force"),
        lambda s: bool(s.head["known"].get("moving_mass_kg")) and slides()(s),
    ),
    "column lost": Fault(lost("position"), ("channels.position.column",), needs("position")),
    "encoder coarser": Fault(
        coarser("position", 5e-4),
        ("position",),
        lambda s: "resolution" in s.head["channels"]["position"] and slides()(s),
    ),
}
