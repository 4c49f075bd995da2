"""Random manoeuvres of an axis: smooth prescribed motion with valve commands that could have caused
it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.benchmarks.hydraulics.reference import machine_of_both
from testbed.formats.arrays import Array
from testbed.laws.initial import start_axes, start_supply
from testbed.world.hydraulic_parameters import axis_parameters, unit_parameters
from testbed.world.switches import switch_off

KINDS = ("reversals", "sticking", "dead band", "end stop", "starved supply", "near vapour pressure")
HOLD_S = 0.05
"""Commands are held this long."""
OTHERS = 2
"""Axes beside the one under test that draw from the same supply where it is starved."""


@dataclass(frozen=True)
class Manoeuvre:
    """What kernel and reference are both given; way points (m) of all axes at times (s), joined
    smoothly.
    """

    kind: str
    axes: NDArray[Any]
    params: NDArray[Any]
    supply: Any
    unit: Any
    times: Array
    points: Array
    commands: Array

    @property
    def duration_s(self) -> float:
        """Simulated time, s."""
        return len(self.commands) * HOLD_S

    def motion(self, t: float) -> tuple[Array, Array]:
        """Extensions (n), m, and rates (n), m/s: twice continuously differentiable."""
        k = min(int(np.searchsorted(self.times, t, side="right")) - 1, len(self.times) - 2)
        span = self.times[k + 1] - self.times[k]
        s = min(max((t - self.times[k]) / span, 0.0), 1.0)
        rise = self.points[k + 1] - self.points[k]
        shape, slope = s**3 * (10 - 15 * s + 6 * s * s), 30 * s * s * (1 - s) ** 2
        return self.points[k] + rise * shape, rise * slope / span


def manoeuvre(number: int, duration_s: float = 1.5) -> Manoeuvre:
    """Manoeuvre `number` (0, 1, ...): kinds take turns, everything else is drawn from its
    number.
    """
    rng = np.random.default_rng([20090714, number])
    kind = KINDS[number % len(KINDS)]
    machine = machine_of_both()
    n = 1 + OTHERS if kind == "starved supply" else 1
    params = axis_parameters(machine)[[2, 5, 8][:n]].copy()
    unit = unit_parameters(machine)
    switch_off(["oil_warming"], params, unit)  # the reference holds the oil's temperature
    if kind == "starved supply":
        unit.pump_flow *= rng.uniform(0.05, 0.25)
        unit.accumulator_volume *= rng.uniform(0.02, 0.2)
    segments = round(duration_s / HOLD_S)
    times, points = _way(kind, rng, n, params[0].stroke, duration_s)
    supply = start_supply(unit, rng.uniform(10.0, 60.0), 0.06)
    supply.traction_flow = rng.uniform(0.0, 1e-4)
    mean_pa = rng.uniform(2e6, 5e6) if kind != "near vapour pressure" else rng.uniform(2e5, 6e5)
    axes = start_axes(
        params, points[0], rng.uniform(0.0, 12e3 * min(1.0, mean_pa / 2e6), n), mean_pa / 3.0
    )
    draft = Manoeuvre(kind, axes, params, supply, unit, times, points, np.zeros((segments, n)))
    return Manoeuvre(kind, axes, params, supply, unit, times, points, _commands(draft, rng))


def _way(
    kind: str, rng: np.random.Generator, n: int, stroke: float, duration_s: float
) -> tuple[Array, Array]:
    """Times (k) and way points (k, n)."""
    count = int(rng.integers(5, 9))
    times = np.linspace(0.0, duration_s, count)
    times[1:-1] += rng.uniform(-0.3, 0.3, count - 2) * duration_s / count
    step = {
        "reversals": 0.03,
        "sticking": 0.01,
        "dead band": 0.004,
        "end stop": 0.02,
        "starved supply": 0.05,
    }
    points = rng.uniform(0.15, stroke - 0.15, n) + np.cumsum(
        rng.uniform(-1.0, 1.0, (count, n)) * step.get(kind, 0.0), axis=0
    )
    # Pulled off the oil with the valve in its dead band, and back.
    if kind == "near vapour pressure":
        points[1::2] = points[0] + rng.uniform(0.001, 0.006, points[1::2].shape)
    if kind == "sticking":  # rest between the moves
        points[1::2] = points[0:-1:2]
    if kind == "end stop":  # into one of the stops by some tens of micrometres, and away again
        stop, sign = (0.0, 1.0) if rng.random() < 0.5 else (stroke, -1.0)
        points = stop + sign * rng.uniform(0.01, 0.05, (count, n))
        points[count // 2] = stop - sign * rng.uniform(2e-5, 1.5e-4)
    return times, np.clip(points, -2e-4, stroke + 2e-4)


def _commands(manoeuvre: Manoeuvre, rng: np.random.Generator) -> Array:
    """What would drive the motion, held; off by a random factor, at rest somewhere in the dead
    band.
    """
    segments, n = manoeuvre.commands.shape
    out = np.zeros((segments, n))
    for index in range(segments):
        _, v = manoeuvre.motion((index + 0.7) * HOLD_S)
        for i, param in enumerate(manoeuvre.params):
            area, gain = (
                (param.a.area, param.a.from_supply)
                if v[i] > 0.0
                else (param.a.area, param.a.to_tank)
            )
            wanted = v[i] * area / (gain * np.sqrt(3.0e6)) * rng.uniform(0.9, 1.8)
            band = param.valve.dead_band
            if abs(v[i]) < 2e-4 or manoeuvre.kind == "near vapour pressure":
                out[index, i] = band * rng.uniform(-0.9, 0.9)
            elif manoeuvre.kind == "dead band":
                out[index, i] = band * rng.uniform(0.6, 1.8) * np.sign(v[i])
            else:
                out[index, i] = np.clip(wanted * (1.0 - band) + band * np.sign(v[i]), -1.0, 1.0)
    return out
