"""Twelve position loops: encoder -> valve command, compiled.

u = dead-band compensation of [ k_p e + k_f x_ref' / v_max + k_i integral(e) ], |u| <= 1, with e in metres of cylinder.
Within `tolerance` of the set point and with a set point at rest the valve is closed: it would only hunt over one
encoder count. Gains assumed; the machine had digital PIDs whose numbers are not published.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.compiled import njit
from testbed.machine.model import Machine
from testbed.machine.names import AXES

Array = NDArray[np.float64]
(KP, KI, FEEDFORWARD, DEADBAND, TOLERANCE, LIMIT, INTEGRAL_LIMIT, GAIN_COLUMNS) = range(8)


def gains(machine: Machine, arm_m: float) -> Array:
    """(12, GAIN_COLUMNS) for joint coordinates: joint 1's rad are turned into cylinder metres by its arm (m/rad)."""
    out = np.zeros((len(AXES), GAIN_COLUMNS))
    control = machine.control
    for i, axis in enumerate(machine.axes.values()):
        speed = axis.rated_flow_m3_s / (np.pi / 4 * axis.cylinder.bore_m**2)
        scale = arm_m if i % 3 == 0 else 1.0
        out[i, KP] = control.loop_gain_1_s / speed * scale
        out[i, KI] = control.integral_gain_1_s2 / speed * scale
        out[i, FEEDFORWARD] = scale / speed
        out[i, DEADBAND] = control.deadband_compensation
        out[i, TOLERANCE] = control.tolerance_m / scale
        out[i, LIMIT] = 1.0
        out[i, INTEGRAL_LIMIT] = control.integral_limit
    return out


@njit
def control_step(
    position: Any,
    reference: Any,
    rate: Any,
    integral: Any,
    gain: Any,
    locked: bool,
    dt: float,
    command: Any,
) -> None:
    """One control period. position, reference (12, rad or m), rate (12, 1/s of it); command (12) is filled."""
    for i in range(position.shape[0]):
        if locked:
            command[i] = 0.0
            continue
        g = gain[i]
        e = reference[i] - position[i]
        moving = rate[i] != 0.0
        if not moving and abs(e) <= g[TOLERANCE]:
            command[i] = 0.0
            continue
        integral[i] += dt * g[KI] * e
        integral[i] = min(max(integral[i], -g[INTEGRAL_LIMIT]), g[INTEGRAL_LIMIT])
        u = g[KP] * e + g[FEEDFORWARD] * rate[i] + integral[i]
        if u > 0.0:
            u += g[DEADBAND]
        elif u < 0.0:
            u -= g[DEADBAND]
        command[i] = min(max(u, -g[LIMIT]), g[LIMIT])
