"""One vertical joint with its 91.7 kg frame, valve, oil and sensors: the bench on which the paper's
figures are run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from functools import lru_cache, wraps
from typing import Any, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.control.valve_loop import PositionLoop, position_loops, valve_command
from testbed.formats.arrays import Array
from testbed.formats.records import Record, Records, quantity
from testbed.laws.axis_records import AxisInput, AxisParameters, AxisState
from testbed.laws.coupling import centre_window
from testbed.laws.hydraulics import hydraulic_step
from testbed.laws.initial import start_axes, start_supply
from testbed.laws.oil import ATMOSPHERE_PA
from testbed.laws.supply import PowerUnit, SupplyState
from testbed.machine.build import build_machine
from testbed.machine.groups import Sensor
from testbed.machine.model import Machine
from testbed.machine.names import AXES, GRAVITY_M_S2
from testbed.machine.provenance import DEFAULT, SetName
from testbed.world.hydraulic_parameters import axis_parameters, unit_parameters
from testbed.world.sensing import Transducer, bend_transducers, counted, transduce
from testbed.world.switches import switch_off

# Which machine the paper's experiments run on: the default one, another set of numbers, or one with
# changes.

P = ParamSpec("P")
R = TypeVar("R")


@dataclass(frozen=True)
class Chosen:
    """A set of the machine's numbers, and changes of it by path."""

    of_set: SetName = DEFAULT
    changes: tuple[tuple[str, float], ...] = ()

    def machine(self, more: Mapping[str, float] | None = None) -> Machine:
        """The machine, with more changes."""
        return build_machine(dict(self.changes) | dict(more or {}), of_set=self.of_set)


_DEFAULT = Chosen()
_CHOSEN: ContextVar[Chosen] = ContextVar("the machine of the experiments", default=_DEFAULT)


def chosen() -> Chosen:
    """What experiments run on now."""
    return _CHOSEN.get()


@contextmanager
def _now(choice: Chosen) -> Iterator[None]:
    token = _CHOSEN.set(choice)
    try:
        yield
    finally:
        _CHOSEN.reset(token)


def changed(by: Mapping[str, float]) -> AbstractContextManager[None]:
    """Context: experiments inside run on the machine with these changes."""
    return _now(replace(chosen(), changes=tuple(sorted(by.items()))))


def of_set(name: SetName) -> AbstractContextManager[None]:
    """Context: experiments inside run on another set of numbers."""
    return _now(Chosen(name))


def once_per_machine(function: Callable[P, R]) -> Callable[P, R]:
    """Remember a function's results, for each machine by itself."""

    @lru_cache(maxsize=32)
    def remembered(_machine: Any, args: tuple[Any, ...], named: tuple[tuple[str, Any], ...]) -> Any:
        return function(*args, **dict(named))

    @wraps(function)
    def call(*args: P.args, **named: P.kwargs) -> R:
        found: R = remembered(chosen(), args, tuple(sorted(named.items())))
        return found

    return call


RATE_HZ = 1000.0
STEPS = 4
"""Steps of frame and oil in one sample: the oil column and the load cell are stiff against 91.7
kg.
"""
COLD_DEGC = 20.0
"""The paper's oil was cold (A); the parameter file's viscous friction holds at this temperature."""
MASS_KG = 91.7
CELL_STIFFNESS_N_M, CELL_DAMPING_N_S_M = 1.0e6, 2.0e4
"""Load cell with its seat and the machine above it (E): 1 mm of piston is 1 kN."""
VERTICAL_AXIS = 2


class Sample(Record):
    """One sample of the bench: what the leg follows, and what it did. Pressures are gauge."""

    reference = quantity("m", "set point")
    reference_rate = quantity("m/s", "its rate")
    position = quantity("m", "of the piston")
    speed = quantity("m/s", "of the piston")
    pressure_a = quantity("Pa", "piston side")
    pressure_b = quantity("Pa", "rod side")
    sensed_a = quantity("Pa", "at the transducer, piston side")
    sensed_b = quantity("Pa", "at the transducer, rod side")
    friction = quantity("N", "mean over the sample")
    load = quantity("N", "of the load cell, mean over the sample")
    command = quantity("1", "of the valve")


class Cell(Record):
    """The bench beside the hydraulics."""

    at = quantity("m", "extension at which the load cell waits")
    count = quantity("m", "one count of the encoder")


@dataclass(frozen=True)
class Trace:
    """What happened on the bench at RATE_HZ, truth and (gauge) readings, SI; `force_n` is (3) from
    true pressures.
    """

    time_s: Array
    reference_m: Array
    position_m: Array
    speed_m_s: Array
    pressure_a_pa: Array
    pressure_b_pa: Array
    read_a_pa: Array
    """Readings through calibrated sensors: bow, hysteresis, noise, steps of the converter."""
    read_b_pa: Array
    friction_n: Array
    load_n: Array
    command: Array
    area_a_m2: float
    area_b_m2: float

    @property
    def one_chamber_n(self) -> Array:
        """(1): pA A_A from the reading, N."""
        return self.read_a_pa * self.area_a_m2

    @property
    def two_chamber_n(self) -> Array:
        """(3): (pA - alpha pB) A_A from the readings, N."""
        return self.one_chamber_n - self.read_b_pa * self.area_b_m2

    @property
    def encoder_m(self) -> Array:
        """Position in encoder counts of 0.1 mm, m."""
        return np.round(self.position_m / 1e-4) * 1e-4

    def after(self, start_s: float) -> Trace:
        """The part from `start_s` on."""
        keep = self.time_s >= start_s
        arrays = {
            name: value[keep] for name, value in vars(self).items() if isinstance(value, np.ndarray)
        }
        return Trace(**arrays, area_a_m2=self.area_a_m2, area_b_m2=self.area_b_m2)


def run(
    reference_m: Array,
    changes: Mapping[str, float] | None = None,
    without: Sequence[str] = (),
    cell_at_m: float = 10.0,
    seed: int = 0,
) -> Trace:
    """The leg follows `reference_m` (n at RATE_HZ) by its position loop; a load cell waits at
    `cell_at_m`.

    `changes`: parameters of roboclimber.yaml by dotted path; `without`: parts of the hydraulics
    left out.
    """
    machine = chosen().machine(changes)
    params = axis_parameters(machine, oil_degc=COLD_DEGC)[[VERTICAL_AXIS]].copy()
    unit = unit_parameters(machine, oil_degc=COLD_DEGC)
    unit.ambient = COLD_DEGC
    switch_off([*without, "oil_warming"], params, unit)
    start = np.array([reference_m[0]])
    axes = start_axes(params, start, np.array([-MASS_KG * GRAVITY_M_S2]))
    supply = start_supply(unit, COLD_DEGC, machine.power_unit.tank_oil_m3)
    loops, given, bench = (
        position_loops(machine, np.ones(len(AXES)))[[VERTICAL_AXIS]].copy(),
        AxisInput.zeros(),
        Cell.zeros()[0],
    )
    bench.at, bench.count = cell_at_m, machine.sensor.encoder_linear_m
    samples = Sample.zeros(len(reference_m))
    samples["reference"] = reference_m
    samples["reference_rate"] = np.gradient(reference_m) * RATE_HZ
    samples["reference_rate"][np.abs(samples["reference_rate"]) < 1e-9] = 0.0
    _simulate(axes, params, given, supply, unit, loops, bench, samples)
    return _trace(samples, params[0], machine.sensor, seed)


def _trace(samples: NDArray[Any], p: Any, sensor: Sensor, seed: int) -> Trace:
    rng = np.random.default_rng([4, seed])
    transducers = Transducer.zeros(2)
    transducers["gain"], transducers["range"] = 1.0, sensor.pressure_range_pa
    transducers["noise"] = sensor.pressure_noise_pa
    transducers["resolution"] = sensor.pressure_resolution_pa
    bend_transducers(transducers, sensor, "the bench", seed)
    reads = []
    for transducer, name in zip(transducers, ("sensed_a", "sensed_b"), strict=True):
        transducer["shown"] = samples[name][0]
        reads.append(_read(samples[name], rng.standard_normal(len(samples)), transducer))
    return Trace(
        time_s=(np.arange(len(samples)) + 1) / RATE_HZ,
        reference_m=samples["reference"],
        position_m=samples["position"],
        speed_m_s=samples["speed"],
        pressure_a_pa=samples["pressure_a"],
        pressure_b_pa=samples["pressure_b"],
        read_a_pa=reads[0],
        read_b_pa=reads[1],
        friction_n=samples["friction"],
        load_n=samples["load"],
        command=samples["command"],
        area_a_m2=float(p.a.area),
        area_b_m2=float(p.b.area),
    )


@njit
def _read(pressures: Array, noise: Array, transducer: Transducer) -> Array:
    """What a Transducer shows of pressures (n), Pa gauge."""
    out = np.empty_like(pressures)
    for index in range(pressures.size):
        out[index] = transduce(pressures[index], 0.0, 0.0, noise[index], transducer)
    return out


@njit
def _simulate(
    axes: Records[AxisState],
    params: Records[AxisParameters],
    given: Records[AxisInput],
    supply: SupplyState,
    unit: PowerUnit,
    loops: Records[PositionLoop],
    bench: Cell,
    samples: Records[Sample],
) -> None:
    """Position loop at RATE_HZ; oil, friction and frame in STEPS steps a sample."""
    axis, rod, loop = axes[0], given[0], loops[0]
    position, rate = samples[0].reference, 0.0
    h = 1.0 / RATE_HZ / STEPS
    for index in range(samples.shape[0]):
        now = samples[index]
        loop.reference, loop.reference_rate = now.reference, now.reference_rate
        rod.command = valve_command(loop, counted(position, bench.count), 1.0 / RATE_HZ)
        for _ in range(STEPS):
            depth = position - bench.at
            push = CELL_STIFFNESS_N_M * depth + CELL_DAMPING_N_S_M * rate
            rod.load = max(push, 0.0) if depth > 0.0 else 0.0
            centre_window(rod, position, rate, h)
            hydraulic_step(axes, params, given, supply, unit, h, 1)
            rate += h * ((axis.force - rod.load) / MASS_KG + GRAVITY_M_S2)
            position += h * rate
            now.friction += axis.friction / STEPS
            now.load += rod.load / STEPS
        now.position, now.speed, now.command = position, rate, rod.command
        now.pressure_a = axis.a.pressure - ATMOSPHERE_PA
        now.pressure_b = axis.b.pressure - ATMOSPHERE_PA
        now.sensed_a = axis.transducers.a - ATMOSPHERE_PA
        now.sensed_b = axis.transducers.b - ATMOSPHERE_PA


def sinusoid(
    amplitude_m: float = 0.1, frequency_hz: float = 0.1, cycles: float = 3.0, middle_m: float = 0.25
) -> Array:
    """Set points (n) of the paper's motion: a sinusoidal speed, after a second at rest."""
    t = np.arange(round(cycles / frequency_hz * RATE_HZ)) / RATE_HZ
    moving = middle_m - amplitude_m * np.cos(2.0 * np.pi * frequency_hz * t)
    return np.concatenate([np.full(round(RATE_HZ), middle_m - amplitude_m), moving])
