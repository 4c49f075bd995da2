"""Zeros of the legs' pressure sensors: they move with the oil's temperature as declared, and that is no finding."""

from __future__ import annotations

import math
from dataclasses import replace

from testbed.diagnosis.leg.fit import Fit
from testbed.diagnosis.robot.problem import RobotProblem
from testbed.effects.base import Active
from testbed.effects.fitting import Coordinate
from testbed.effects.unnamed import UNNAMED
from testbed.machine.model import Machine

LEAST_N = 20.0
"""Two sensors' zeros are never known better than that, as a force (E)."""
SCALE_N = 50.0


def zeros(problem: RobotProblem, machine: Machine) -> tuple[tuple[Active, ...], list[Coordinate]]:
    """A constant force of each axis and its coordinate, bounded by the data sheet at this oil temperature."""
    sensor, c = machine.sensor, machine.vertical_cylinder
    per_kelvin = sensor.thermal_zero_share * sensor.pressure_range_pa / sensor.thermal_range_k
    both_m2 = 0.25 * math.pi * (2.0 * c.bore_m**2 - c.rod_m**2)
    active, coordinates = [], []
    for s in problem.series:
        degc = s.signals.oil_temperature_degc
        warm_k = (
            0.0 if degc is None else abs(float(degc.mean()) - sensor.calibration_temperature_degc)
        )
        most = per_kelvin * warm_k * both_m2 + LEAST_N
        effect = UNNAMED.at(s.name)
        active.append(effect.active())
        prior = (0.0, most / math.sqrt(3.0))
        coordinates.append(Coordinate(effect.name, "bias", 0.0, -most, most, SCALE_N, prior=prior))
    return tuple(active), coordinates


def without_zeros(fit: Fit) -> Fit:
    """The fit as a model has it: an estimator learns the zeros itself."""
    kept = tuple(a for a in fit.at.effects if a.effect.kind != UNNAMED.kind)
    return replace(fit, at=replace(fit.at, effects=kept))
