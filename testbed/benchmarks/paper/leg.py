"""One vertical joint with its 91.7 kg frame, valve, oil and sensors: the bench on which the paper's figures are run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.benchmarks.paper.machine import changes as machine_changes
from testbed.compiled import njit
from testbed.control.valve_loop import control_step, gains
from testbed.laws import columns as c
from testbed.laws.hydraulics import hydraulic_step
from testbed.laws.initial import start_axes, start_supply
from testbed.laws.oil import ATMOSPHERE_PA
from testbed.machine.build import build_machine
from testbed.machine.groups import Sensor
from testbed.machine.names import GRAVITY_M_S2
from testbed.world.plumbing import axis_parameters, unit_parameters
from testbed.world.sensing import counted
from testbed.world.switches import switch_off

Array = NDArray[np.float64]
RATE_HZ = 1000.0
STEPS = 4
"""Steps of frame and oil in one sample: the oil column and the load cell are stiff against 91.7 kg."""
COLD_DEGC = 20.0
"""The paper's oil was cold (A); the parameter file's viscous friction holds at this temperature."""
MASS_KG = 91.7
CELL_STIFFNESS_N_M, CELL_DAMPING_N_S_M = 1.0e6, 2.0e4
"""Load cell with its seat and the machine above it (E): 1 mm of piston is 1 kN."""
VERTICAL_AXIS = 2
(X, V, P_A, P_B, SENSED_A, SENSED_B, FRICTION, LOAD, COMMAND, COLUMNS) = range(10)


@dataclass(frozen=True)
class Trace:
    """What happened on the bench at RATE_HZ, truth and (gauge) readings, SI; `force_n` is (3) from true pressures."""

    time_s: Array
    reference_m: Array
    position_m: Array
    speed_m_s: Array
    pressure_a_pa: Array
    pressure_b_pa: Array
    read_a_pa: Array
    """Readings through perfectly calibrated sensors, with noise and steps of the converter."""
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
        arrays = {k: v[keep] for k, v in vars(self).items() if isinstance(v, np.ndarray)}
        return Trace(**arrays, area_a_m2=self.area_a_m2, area_b_m2=self.area_b_m2)


def run(
    reference_m: Array,
    changes: Mapping[str, float] | None = None,
    without: Sequence[str] = (),
    cell_at_m: float = 10.0,
    seed: int = 0,
) -> Trace:
    """The leg follows `reference_m` (n at RATE_HZ) by its position loop; a load cell waits at `cell_at_m`.

    `changes`: parameters of roboclimber.yaml by dotted path; `without`: parts of the hydraulics left out.
    """
    machine = build_machine(machine_changes() | dict(changes or {}))
    params = axis_parameters(machine)[[VERTICAL_AXIS]].copy()
    unit = unit_parameters(machine)
    unit[c.AMBIENT] = COLD_DEGC
    switch_off([*without, "oil_warming"], params, unit)
    start = np.array([reference_m[0]])
    axes = start_axes(params, start, np.array([-MASS_KG * GRAVITY_M_S2]))
    supply = start_supply(unit, COLD_DEGC, machine.power_unit.tank_oil_m3)
    gain = gains(machine, 1.0)[[VERTICAL_AXIS]].copy()
    rate = np.gradient(reference_m) * RATE_HZ
    rate[np.abs(rate) < 1e-9] = 0.0
    out = np.zeros((len(reference_m), COLUMNS))
    count_m = machine.sensor.encoder_linear_m
    _simulate(axes, params, supply, unit, gain, reference_m, rate, cell_at_m, count_m, out)
    return _trace(out, reference_m, params[0], machine.sensor, np.random.default_rng([4, seed]))


def _trace(
    out: Array, reference_m: Array, p: Array, sensor: Sensor, rng: np.random.Generator
) -> Trace:
    reads = []
    for column in (SENSED_A, SENSED_B):
        noisy = out[:, column] + sensor.pressure_noise_pa * rng.standard_normal(len(out))
        step = sensor.pressure_resolution_pa
        reads.append(np.clip(np.round(noisy / step) * step, 0.0, sensor.pressure_range_pa))
    time = (np.arange(len(out)) + 1) / RATE_HZ
    return Trace(
        time,
        reference_m,
        out[:, X],
        out[:, V],
        out[:, P_A],
        out[:, P_B],
        reads[0],
        reads[1],
        out[:, FRICTION],
        out[:, LOAD],
        out[:, COMMAND],
        float(p[c.AREA_A]),
        float(p[c.AREA_B]),
    )


@njit
def _simulate(
    axes: Any,
    params: Any,
    supply: Any,
    unit: Any,
    gain: Any,
    reference: Any,
    rate: Any,
    cell_at: float,
    count: float,
    out: Any,
) -> None:
    """Position loop at RATE_HZ; oil, friction and frame in STEPS steps a sample; pressures in `out` are gauge."""
    x, v = np.array([reference[0]]), np.zeros(1)
    shown, wanted, wanted_rate = np.zeros(1), np.zeros(1), np.zeros(1)
    integral, command, load, side = np.zeros(1), np.zeros(1), np.zeros(1), np.zeros(1)
    h = 1.0 / RATE_HZ / STEPS
    for k in range(reference.shape[0]):
        shown[0], wanted[0], wanted_rate[0] = counted(x[0], count), reference[k], rate[k]
        control_step(shown, wanted, wanted_rate, integral, gain, False, 1.0 / RATE_HZ, command)
        friction = mean_load = 0.0
        for _ in range(STEPS):
            depth = x[0] - cell_at
            load[0] = (
                max(CELL_STIFFNESS_N_M * depth + CELL_DAMPING_N_S_M * v[0], 0.0)
                if depth > 0.0
                else 0.0
            )
            hydraulic_step(axes, params, supply, unit, x, v, command, load, side, h, 1)
            v[0] += h * ((axes[0, c.FORCE] - load[0]) / MASS_KG + GRAVITY_M_S2)
            x[0] += h * v[0]
            friction += axes[0, c.FRICTION] / STEPS
            mean_load += load[0] / STEPS
        out[k, X], out[k, V] = x[0], v[0]
        out[k, P_A], out[k, P_B] = axes[0, c.P_A] - ATMOSPHERE_PA, axes[0, c.P_B] - ATMOSPHERE_PA
        out[k, SENSED_A], out[k, SENSED_B] = (
            axes[0, c.SENSED_A] - ATMOSPHERE_PA,
            axes[0, c.SENSED_B] - ATMOSPHERE_PA,
        )
        out[k, FRICTION], out[k, LOAD], out[k, COMMAND] = friction, mean_load, command[0]


def sinusoid(
    amplitude_m: float = 0.1, frequency_hz: float = 0.1, cycles: float = 3.0, middle_m: float = 0.25
) -> Array:
    """Set points (n) of the paper's motion: a sinusoidal speed, after a second at rest."""
    t = np.arange(round(cycles / frequency_hz * RATE_HZ)) / RATE_HZ
    moving = middle_m - amplitude_m * np.cos(2.0 * np.pi * frequency_hz * t)
    return np.concatenate([np.full(round(RATE_HZ), middle_m - amplitude_m), moving])
