"""Forces and friction of the twelve pistons, as believed, over bins."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from testbed.diagnosis.robot.bins import Bins
from testbed.diagnosis.robot.end_cushions import end_cushions_n
from testbed.diagnosis.robot.motion_noise import turning_from
from testbed.diagnosis.robot.tolerances import expected
from testbed.estimation.cylinder import friction_terms
from testbed.machine.groups import Cylinder, Seal
from testbed.machine.model import Axis, Machine
from testbed.machine.names import AXES
from testbed.robot.robot import Robot

Array = npt.NDArray[np.float64]


BEHIND = 0.4
"""Share of its dry friction that a piston at rest between two slides keeps of the sense it turns
from, in the mean (B: 0.3 to 0.6 in sways, 0.6 to 0.8 where the body is raised and lowered).
"""


def sense_of_friction(direction: Array) -> Array:
    """(n, 12) sense of dry friction, -1 to 1, of pistons that slide in a sense `direction` (n, 12):
    while one turns round its seal is behind.
    """
    return np.asarray(direction + BEHIND * (1.0 - np.abs(direction)) * turning_from(direction))


def areas(machine: Machine) -> tuple[Array, Array]:
    """Piston areas (12,) of chambers A and B, m2."""
    cylinders = [axis.cylinder for axis in machine.axes.values()]
    whole = np.array([0.25 * np.pi * c.bore_m**2 for c in cylinders])
    return whole, whole - np.array([0.25 * np.pi * c.rod_m**2 for c in cylinders])


def pistons_n(bins: Bins, robot: Robot) -> Array:
    """(n, 12) N along extension: pressures on their areas, and what end cushions brake."""
    area_a, area_b = areas(robot.machine)
    braked = end_cushions_n(
        bins.extension_m, bins.speed_m_s, robot.linkages.stroke_m, robot.machine
    )
    return np.asarray(bins.pressure_a_pa * area_a - bins.pressure_b_pa * area_b + braked)


def friction(bins: Bins, machine: Machine) -> tuple[Array, Array, Array]:
    """Dry friction of the sense of sliding, viscous friction with its sign, and half width at rest,
    (n, 12) each, N.
    """
    dry, viscous, spread = (np.zeros((bins.count, len(AXES))) for _ in range(3))
    for i, axis in enumerate(machine.axes.values()):
        c, seal = axis.cylinder, axis.seal
        speed = bins.speed_m_s[:, i]
        out, back = _dry(c, speed, "out"), _dry(c, speed, "in")
        extra = seal.pressure_coefficient_m2 * (bins.pressure_a_pa + bins.pressure_b_pa)[:, i]
        dry[:, i] = np.where(speed >= 0.0, out, back) + extra
        thin = np.exp(-seal.viscosity_rate_1_k * (bins.oil_degc - seal.viscosity_reference_degc))
        sigma = np.where(speed >= 0.0, c.viscous_out_n_s_m, c.viscous_in_n_s_m)
        viscous[:, i] = sigma * thin * speed
        spread[:, i] = 0.5 * (out + back + 2.0 * extra) * (1.0 - np.abs(bins.direction[:, i]))
    return dry, viscous, spread


def _dry(c: Cylinder, speed: Array, sense: str) -> Array:
    coulomb, static = getattr(c, f"coulomb_{sense}_n"), getattr(c, f"static_{sense}_n")
    fading = friction_terms(np.abs(speed), getattr(c, f"stribeck_{sense}_m_s"))[..., 2]
    return np.asarray(coulomb + static * fading)


def side_coefficient(axis: Axis, drawing: Seal) -> float:
    """Friction by a newton across the rod, as told of this cylinder, else as expected of its
    kind.
    """
    number = "axes.*.seal.side_load_coefficient"
    return expected(number, axis.seal.side_load_coefficient, drawing.side_load_coefficient)


def side_growth(axis: Axis, extension_m: Array, stroke_m: float) -> Array:
    """(n,) friction by side load at extensions (n,), over that at mid-stroke: a frame that is drawn
    out overhangs by more.
    """
    return np.asarray(1.0 + axis.seal.side_load_growth * (extension_m / stroke_m - 0.5))


def by_force_across(bins: Bins, robot: Robot) -> Array:
    """(n, 12) dry friction of every piston by a force of 1 N across its rod."""
    axes, stroke_m = robot.machine.axes.values(), robot.linkages.stroke_m
    coefficient = np.array([side_coefficient(axis, robot.machine.seal) for axis in axes])
    growth = [side_growth(axis, bins.extension_m[:, i], stroke_m[i]) for i, axis in enumerate(axes)]
    return np.asarray(coefficient * np.column_stack(growth))


def friction_across(bins: Bins, robot: Robot, stands: npt.NDArray[np.bool_]) -> tuple[Array, Array]:
    """Friction of every piston by a force of 1 N across its rod, with its sign, and how that grows
    with the joint, both (n, 12); stands (n, 12): whether its leg carries.
    """
    axes, stroke_m = robot.machine.axes.values(), robot.linkages.stroke_m
    coefficient = np.array([side_coefficient(axis, robot.machine.seal) for axis in axes])
    sense = stands * sense_of_friction(bins.direction)
    more = np.array([axis.seal.side_load_growth for axis in axes]) / stroke_m
    return sense * by_force_across(bins, robot), sense * coefficient * more * bins.arm_m
