"""How many times faster the compiled hydraulics is than SciPy's LSODA at equal error.

Both get what the engine gives: commands and rates held over a millisecond, twelve axes on one
supply, one call a millisecond, and both are to deliver the mean forces on the rods. LSODA's
right-hand side is compiled too.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.benchmarks.harness import rms
from testbed.benchmarks.hydraulics.reference import (
    N_AXIS,
    Amplifiers,
    held_rates,
    machine_of_both,
    pack,
)
from testbed.compiled import njit
from testbed.formats.arrays import Array
from testbed.formats.records import Records
from testbed.laws.axis_records import AxisInput, AxisParameters, AxisState
from testbed.laws.hydraulics import hydraulic_step
from testbed.laws.initial import start_axes, start_supply
from testbed.laws.supply import PowerUnit, SupplyState
from testbed.scenario.parts import Rates
from testbed.world.hydraulic_parameters import axis_parameters, unit_parameters
from testbed.world.switches import switch_off

STEP_S = 1e-3
LADDER = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
"""Tolerances offered to LSODA, loosest first."""


@dataclass(frozen=True)
class Walk:
    """Twelve axes moving: rates and commands (steps, 12) held over each step."""

    params: NDArray[Any]
    unit: Any
    axes: NDArray[Any]
    supply: Any
    x: Array
    v: Array
    commands: Array


def walk(steps: int = 150) -> Walk:
    """Every axis on its own sine, driven by a valve command that fits it."""
    machine = machine_of_both()
    params, unit = (
        axis_parameters(machine),
        unit_parameters(machine),
    )
    switch_off(["oil_warming"], params, unit)
    rng = np.random.default_rng(20090715)
    t = (np.arange(steps)[:, None] + 0.5) * STEP_S
    w, phase, speed = rng.uniform(4, 20, 12), rng.uniform(0, 6, 12), rng.uniform(0.01, 0.04, 12)
    v = speed * np.sin(w * t + phase)
    gain = np.where(v > 0, params["a"]["from_supply"], params["a"]["to_tank"])
    commands = 1.2 * v * params["a"]["area"] / (gain * np.sqrt(3e6)) + params["valve"][
        "dead_band"
    ] * np.sign(v)
    x = np.tile([0.12, 0.2, 0.25], 4)
    axes, supply = (
        start_axes(params, x, np.tile([0.0, 0.0, 7e3], 4)),
        start_supply(unit, 40.0, 0.06),
    )
    return Walk(params, unit, axes, supply, x, v, commands)


@njit
def kernel_loop(
    axes: Records[AxisState],
    params: Records[AxisParameters],
    given: Records[AxisInput],
    unit: tuple[SupplyState, PowerUnit],
    moves: Array,
    substeps: int,
    out: Array,
) -> None:
    """Forces of every step into out (steps, n): the kernel called from compiled code, as the world
    does.

    given (n): with the extensions at the start; moves (2, steps, n): rates and commands.
    """
    supply, power = unit
    for index in range(out.shape[0]):
        for i in range(axes.shape[0]):
            given[i].rate, given[i].command = moves[0, index, i], moves[1, index, i]
        hydraulic_step(axes, params, given, supply, power, STEP_S, substeps)
        for i in range(axes.shape[0]):
            out[index, i] = axes[i].force
            given[i].extension += STEP_S * given[i].rate


def kernel_run(run: Walk, substeps: int) -> tuple[Array, float]:
    """Forces (steps, 12), N, and processor time, s."""
    out = np.empty_like(run.v)
    given, unit = AxisInput.zeros(len(run.axes)), (run.supply.copy(), run.unit)
    given["extension"] = run.x
    axes, moves = run.axes.copy(), np.stack([run.v, run.commands])
    start = time.thread_time()
    kernel_loop(axes, run.params, given, unit, moves, substeps, out)
    return out, time.thread_time() - start


def lsoda_run(run: Walk, rtol: float, bare: bool = False) -> tuple[Array, float]:
    """Forces and processor time by SciPy's LSODA at `rtol` (absolute tolerance a tenth of it on
    states of order one).

    solve_ivp(method="LSODA"), or with `bare` the old odeint: the same solver with less around it.
    """
    from scipy.integrate import odeint, solve_ivp

    y, x = pack(run.axes, run.supply), run.x.copy()
    amplifiers = Amplifiers(
        run.params, run.axes["valve"]["amplifier"].copy(), run.axes["valve"]["play"].copy()
    )
    warmth = float(run.supply.temperature - run.unit.viscosity_reference)
    out, spent, units = np.empty_like(run.v), 0.0, np.array([run.unit])
    for index, (v, command) in enumerate(zip(run.v, run.commands, strict=True)):
        arguments = (
            run.params,
            units,
            (x, v),
            (amplifiers.amplifier, command, amplifiers.played),
            (0.0, warmth),
        )
        start = time.thread_time()
        if bare:
            after = odeint(
                held_rates, y, (0.0, STEP_S), arguments, tfirst=True, rtol=rtol, atol=0.1 * rtol
            )[-1]
        else:
            after = solve_ivp(
                held_rates,
                (0.0, STEP_S),
                y,
                method="LSODA",
                args=arguments,
                rtol=rtol,
                atol=0.1 * rtol,
            ).y[:, -1]
        spent += time.thread_time() - start
        integral = slice(8, N_AXIS * 12, N_AXIS)
        out[index] = (after[integral] - y[integral]) * 100.0 / STEP_S
        y = after
        amplifiers.amplifier, amplifiers.played = amplifiers.after(STEP_S, command)
        x = x + STEP_S * v
    return out, spent


def equal_error(run: Walk, truth: Array, error_n: float, bare: bool) -> tuple[float, float, float]:
    """LSODA at the loosest tolerance of the ladder that is as exact: time (us a step), error (N,
    RMS), tolerance.
    """
    time_s = error = rtol = 0.0
    for rtol in LADDER:
        forces, time_s = lsoda_run(run, rtol, bare)
        error = rms(forces - truth)
        if error <= error_n:
            break
    return time_s / len(run.v) * 1e6, error, rtol


def compare_speed(steps: int = 150) -> dict[str, float]:
    """Times (us a step), errors (N, RMS) and tolerances of the kernel and of LSODA at equal error,
    and the ratios.
    """
    run = walk(steps)
    truth, _ = lsoda_run(run, 1e-9, bare=True)
    substeps = Rates().hydraulic_substeps
    kernel_run(run, substeps)
    spent = []
    for _ in range(5):
        forces, once = kernel_run(run, substeps)
        spent.append(once / steps * 1e6)
    error = rms(forces - truth)
    kernel = float(np.median(spent))
    out = {"kernel_us": kernel, "kernel_error_n": error}
    for name, bare in (("lsoda", False), ("odeint", True)):
        time_us, off, rtol = equal_error(run, truth, error, bare)
        out |= {
            f"{name}_us": time_us,
            f"{name}_error_n": off,
            f"{name}_rtol": rtol,
            f"{name}_ratio": time_us / kernel,
        }
    return out


def kernel_vs_lsoda() -> float:
    """How many times faster the kernel is than SciPy's LSODA at equal error."""
    return compare_speed()["lsoda_ratio"]
