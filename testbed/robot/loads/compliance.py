"""How much a foot gives: the oil columns of its three cylinders in series with the ground.

A locked cylinder is a spring of the two oil volumes, k = A_A^2 / (V_A / beta + E_A) + A_B^2 / (V_B
/ beta + E_B), V_A = dead + A_A x, V_B = dead + A_B (stroke - x), E the widening of their hoses.
Through the leg's Jacobian J (3 x 3) its compliance reaches the foot: J diag(1/k) J^T. Use it where
positions are those of the unloaded cylinders; where positions are measured under load they contain
the oil's give already, and only the ground (and frame) is left.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from testbed.formats.arrays import Array
from testbed.laws.oil import ATMOSPHERE_PA, effective_bulk_modulus
from testbed.machine.model import Machine
from testbed.robot.linkage import Linkages

WORKING_PRESSURE_PA = 4.0e6
"""Gauge pressure at which the oil's modulus is taken: 15 kN on the 70 mm bore (a foot's share with
its load).
"""


class OilColumns:
    """The twelve locked cylinders as springs."""

    def __init__(self, machine: Machine) -> None:
        """Areas and volumes of the twelve cylinders of the machine."""
        self._linkages = Linkages.from_machine(machine)
        cylinders = [axis.cylinder for axis in machine.axes.values()]
        self._area_a = np.array([math.pi / 4 * cylinder.bore_m**2 for cylinder in cylinders])
        self._area_b = self._area_a - np.array(
            [math.pi / 4 * cylinder.rod_m**2 for cylinder in cylinders]
        )
        self._dead_a = np.array([cylinder.dead_volume_a_m3 for cylinder in cylinders])
        self._dead_b = np.array([cylinder.dead_volume_b_m3 for cylinder in cylinders])
        self._stroke = self._linkages.stroke_m
        oil = machine.oil
        self._hoses = oil.hose_elasticity_m3_pa, oil.hose_elasticity_b_m3_pa
        self._bulk, self._air = oil.bulk_modulus_pa, oil.entrained_air
        self._modulus = self._modulus_pa(WORKING_PRESSURE_PA)

    def _modulus_pa(self, gauge_pa: float) -> float:
        return float(
            effective_bulk_modulus(max(gauge_pa, 0.0) + ATMOSPHERE_PA, self._bulk, self._air)
        )

    def stiffness_n_m(
        self, extensions_m: ArrayLike, pressures_pa: tuple[Array, Array] | None = None
    ) -> Array:
        """Stiffness (12,) of the locked cylinders at extensions (12,), N/m (module docstring).

        pressures_pa: gauge pressures (12,), (12,) of chambers A and B where they are known: oil
        with air in it is softer at low pressure. Without them it is that of WORKING_PRESSURE_PA.
        """
        extensions = np.asarray(extensions_m, dtype=float)
        volume_a = self._dead_a + self._area_a * extensions
        volume_b = self._dead_b + self._area_b * (self._stroke - extensions)
        of_a = of_b = np.asarray(self._modulus)
        if pressures_pa is not None:
            of_a, of_b = (np.array([self._modulus_pa(float(p)) for p in of]) for of in pressures_pa)
        gives_a, gives_b = volume_a / of_a + self._hoses[0], volume_b / of_b + self._hoses[1]
        return np.asarray(self._area_a**2 / gives_a + self._area_b**2 / gives_b)

    def joint_compliance(
        self, positions: ArrayLike, pressures_pa: tuple[Array, Array] | None = None
    ) -> Array:
        """Compliance (12,) of the locked joints at joint positions (12,): rad/(N m) for rotation,
        else m/N.

        pressures_pa: see stiffness_n_m.
        """
        extensions, arms = self._linkages.rods(positions)
        return np.asarray(1.0 / (self.stiffness_n_m(extensions, pressures_pa) * arms**2))
