"""A mass that rides freely on the rod of a vertical cylinder, stepped as the engine does, and the
same in Radau.

Here hydraulics and motion answer each other, as they do beside the engine: what differs is the
error of both and of how they take turns (coupling.py). Kernel step k covers the reference's time
from k dt to (k + 1) dt; valve commands are held over whole steps, and the load on the rod is that
of the step's middle.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.benchmarks.hydraulics.reference import (
    N_AXIS,
    Amplifiers,
    machine_of_both,
    pack,
    rates,
)
from testbed.compiled import njit
from testbed.formats.arrays import Array
from testbed.formats.records import Record, Records, quantity
from testbed.laws.axis_records import AxisInput, AxisParameters, AxisState
from testbed.laws.coupling import centre_window
from testbed.laws.hydraulics import hydraulic_step
from testbed.laws.initial import start_axes, start_supply
from testbed.laws.supply import PowerUnit, SupplyState
from testbed.machine.names import GRAVITY_M_S2
from testbed.world.hydraulic_parameters import axis_parameters, unit_parameters
from testbed.world.switches import switch_off

QUARTER_KG, FRAME_KG = 1000.0, 91.7
"""A quarter of the robot, and the inner sliding frame alone (A)."""
STEP_S = 1e-3
SUBSTEPS = 2
HOLD_S = 0.01
"""Commands are held this long."""
MOST_RMS_N, MOST_N = 20.0, 120.0
"""How far the force may be off, RMS and at worst."""


class Mass(Record):
    """What rides on the rod."""

    mass = quantity("kg", "of it")
    load = quantity("N", "on it from outside, + presses the rod in")
    position = quantity("m", "extension of the rod")
    rate = quantity("m/s", "of the half step before")


@njit
def free_step(
    axes: Records[AxisState],
    params: Records[AxisParameters],
    given: Records[AxisInput],
    supply: SupplyState,
    unit: PowerUnit,
    masses: Records[Mass],
    dt: float,
    substeps: int,
) -> None:
    """One axis and the mass on its rod by dt: force, then rate, then position, as the engine
    does.
    """
    mass = masses[0]
    centre_window(given[0], mass.position, mass.rate, dt)
    hydraulic_step(axes, params, given, supply, unit, dt, substeps)
    mass.rate += dt * (axes[0].force - mass.load) / mass.mass
    mass.position += dt * mass.rate


@njit
def free_run(
    axes: Records[AxisState],
    params: Records[AxisParameters],
    given: Records[AxisInput],
    supply: SupplyState,
    unit: PowerUnit,
    masses: Records[Mass],
    dt: float,
    steps: Records[FreeStep],
) -> None:
    """A step for every row of `steps` (command, load): leaves the mean force in `force`, and where
    the rod then is.
    """
    for index in range(steps.shape[0]):
        now = steps[index]
        given[0].command, masses[0].load = now.command, now.load
        free_step(axes, params, given, supply, unit, masses, dt, SUBSTEPS)
        now.force, now.position = axes[0].force, masses[0].position


class FreeStep(Record):
    """What a step is given, and what came of it."""

    command = quantity("1", "of the valve")
    load = quantity("N", "on the mass, + presses the rod in")
    force = quantity("N", "mean of the cylinder on the mass")
    position = quantity("m", "extension at the step's end")


@dataclass
class FreeRig:
    """A vertical cylinder with a mass on its rod, at rest under its load."""

    axes: NDArray[Any]
    params: NDArray[Any]
    supply: Any
    unit: Any
    masses: NDArray[Any]

    @classmethod
    def at_rest(
        cls,
        mass_kg: float,
        load_n: float,
        position_m: float,
        without: tuple[str, ...] = (),
        hoses: bool = False,
    ) -> FreeRig:
        """The declared machine's cylinder, `without` parts of its hydraulics; the oil keeps its
        temperature. hoses: their widening is apart from the oil's bulk modulus.
        """
        machine = machine_of_both(hoses)
        params, unit = axis_parameters(machine)[2:3].copy(), unit_parameters(machine)
        switch_off([*without, "oil_warming"], params, unit)
        masses = Mass.zeros()
        masses["mass"], masses["load"], masses["position"] = mass_kg, load_n, position_m
        axes = start_axes(params, masses["position"], masses["load"])
        return cls(axes, params, start_supply(unit, 40.0, 0.06), unit, masses)

    def run(self, commands: Array, loads_n: Array, dt: float = STEP_S) -> NDArray[Any]:
        """FreeStep (n): commands and loads (n) of every step, with forces and positions."""
        steps = FreeStep.zeros(len(commands))
        steps["command"], steps["load"] = commands, loads_n
        given = AxisInput.zeros()
        free_run(self.axes, self.params, given, self.supply, self.unit, self.masses, dt, steps)
        return steps

    def reference(
        self, commands: Array, load_n: Callable[[float], float], dt: float, rtol: float
    ) -> tuple[Array, Array]:
        """Mean force (N) over, and position (m) in the middle of, every dt; commands (segments)
        held HOLD_S.
        """
        from scipy.integrate import solve_ivp

        mass, axes = self.masses[0], self.axes
        valve = axes["valve"]
        amplifiers = Amplifiers(self.params, valve["amplifier"].copy(), valve["play"].copy())
        warmth = float(self.supply.temperature - self.unit.viscosity_reference)
        y = np.r_[pack(axes, self.supply), mass.position, mass.rate]
        halves = round(HOLD_S / dt) * 2
        impulse, position = [y[N_AXIS - 1 : N_AXIS]], []
        for number, command in enumerate(np.atleast_2d(commands).T):
            start = number * HOLD_S

            def slope(t: float, y: Array, command: Array = command, start: float = start) -> Array:
                played = amplifiers.after(t, command)[1]
                dy = rates(y[:-2], self.params, self.unit, y[-2:-1], y[-1:], played, 0.0, warmth)
                force = 100.0 * dy[N_AXIS - 1]
                return np.asarray(np.r_[dy, y[-1], (force - load_n(start + t)) / mass.mass])

            grid = np.linspace(0.0, HOLD_S, halves + 1)
            tolerance = np.r_[np.full(len(y) - 2, 1e-9), 1e-12, 1e-9]
            answer = solve_ivp(slope, (0.0, HOLD_S), y, "Radau", grid, rtol=rtol, atol=tolerance)
            if not answer.success:
                raise RuntimeError(f"the reference solver gave up: {answer.message}")
            impulse.append(answer.y[N_AXIS - 1, 2::2])
            position.append(answer.y[-2, 1::2])
            y = answer.y[:, -1]
            amplifiers.amplifier, amplifiers.played = amplifiers.after(HOLD_S, command)
        return np.diff(np.concatenate(impulse)) * 100.0 / dt, np.concatenate(position)


@dataclass(frozen=True)
class FreeMotion:
    """A motion of the free mass: commands held HOLD_S, and the load over time.

    hoses: their widening is apart from the oil's bulk modulus.
    """

    mass_kg: float
    start_m: float
    commands: Array
    load_n: Callable[[float], float]
    hoses: bool = False


def _pulse(size: float, seconds: float = 0.5, whole_s: float = 1.2) -> Array:
    """A command from 0.1 s on for `seconds`, then shut."""
    t = HOLD_S * np.arange(round(whole_s / HOLD_S))
    return np.where((t >= 0.1) & (t < 0.1 + seconds), size, 0.0)


def _carried(t: float) -> float:
    return QUARTER_KG * GRAVITY_M_S2


def _ramps(t: float) -> float:
    """The weight, and 400 N more and less in ramps: below break-away."""
    wave = t / 0.6 % 1.0
    return _carried(t) + 400.0 * (1.0 - abs(4.0 * ((wave + 0.25) % 1.0) - 2.0))


def _in_the_air(t: float) -> float:
    return -FRAME_KG * GRAVITY_M_S2


AIR_SINE = 0.3 * np.sin(2.0 * np.pi * HOLD_S * np.arange(round(1.5 / HOLD_S)))
_MOTIONS: Mapping[str, FreeMotion] = {
    "lift and hold": FreeMotion(QUARTER_KG, 0.2, _pulse(0.4), _carried),
    "lower and shut": FreeMotion(QUARTER_KG, 0.3, _pulse(-0.3), _carried),
    "into the cushion": FreeMotion(QUARTER_KG, 0.045, _pulse(-0.4, 0.9), _carried),
    "into the stop": FreeMotion(QUARTER_KG, 0.045, _pulse(-0.4, 1.3, 1.4), _carried),
    "stuck ramps": FreeMotion(QUARTER_KG, 0.25, _pulse(0.0), _ramps),
    "air sine": FreeMotion(FRAME_KG, 0.25, AIR_SINE, _in_the_air),
}
FREE_MOTIONS: Mapping[str, FreeMotion] = {
    **_MOTIONS,
    **{f"{name}, hoses": replace(motion, hoses=True) for name, motion in _MOTIONS.items()},
}


@dataclass(frozen=True)
class FreeDifference:
    """Kernel with its free mass less the reference, mean force over each step, N, and position,
    m.
    """

    rms_n: float
    worst_n: float
    worst_m: float

    @property
    def holds(self) -> bool:
        """Within MOST_RMS_N and MOST_N."""
        return self.rms_n <= MOST_RMS_N and self.worst_n <= MOST_N


def compare_free(name: str, step_s: float = STEP_S, rtol: float = 1e-8) -> FreeDifference:
    """One of FREE_MOTIONS at `step_s`, against the reference."""
    motion = FREE_MOTIONS[name]
    load_n = motion.load_n(0.0)
    rig = FreeRig.at_rest(motion.mass_kg, load_n, motion.start_m, hoses=motion.hoses)
    force, position = rig.reference(motion.commands, motion.load_n, step_s, rtol)
    steps = len(force)
    middles = step_s * (np.arange(steps) + 0.5)
    commands = np.repeat(motion.commands, round(HOLD_S / step_s))
    run = rig.run(commands, np.array([motion.load_n(middle) for middle in middles]), step_s)
    error = run["force"] - force
    away = run["position"][:-1] - position[1:]
    return FreeDifference(
        float(np.sqrt(np.mean(error**2))), float(np.abs(error).max()), float(np.abs(away).max())
    )
