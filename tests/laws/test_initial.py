"""Where the hydraulics begin: chambers that balance the rod, drained where their valve leaks, seals
stuck or free.
"""

from __future__ import annotations

import numpy as np
import pytest

from testbed.laws.axis_records import AxisInput
from testbed.laws.friction import friction_step
from testbed.laws.initial import UNLOADED_PA, settled_pa, start_axes, start_supply
from testbed.laws.oil import ATMOSPHERE_PA
from testbed.machine.build import build_machine
from testbed.world.hydraulic_parameters import axis_parameters, unit_parameters

MACHINE = build_machine()
PARAMETERS, UNIT = axis_parameters(MACHINE)[2:3], unit_parameters(MACHINE)
X, LOAD_N = np.array([0.25]), np.array([8000.0])


def _piston_n(axis: np.void) -> float:
    """Force of the pressures on the rod, N."""
    area_a, area_b = PARAMETERS[0]["a"]["area"], PARAMETERS[0]["b"]["area"]
    over = axis["a"]["pressure"] - ATMOSPHERE_PA, axis["b"]["pressure"] - ATMOSPHERE_PA
    return float(over[0] * area_a - over[1] * area_b)


def test_a_machine_that_has_stood_has_drained_its_unloaded_chambers() -> None:
    """Chamber B between 18 bar over 1e-14 and 2 bar over 8e-13 m3/(s Pa) settles at 2.2 bar."""
    supply = start_supply(UNIT, 40.0, 0.06)
    axis = start_axes(PARAMETERS, X, LOAD_N, supply=supply, tank_pa=UNIT["tank_pressure"])[0]
    assert axis["b"]["pressure"] - ATMOSPHERE_PA == pytest.approx(2.2e5, rel=0.01)
    assert _piston_n(axis) == pytest.approx(LOAD_N[0])


def test_without_a_supply_or_a_leak_the_unloaded_chamber_keeps_its_pressure() -> None:
    axis = start_axes(PARAMETERS, X, LOAD_N)[0]
    assert axis["b"]["pressure"] - ATMOSPHERE_PA == pytest.approx(UNLOADED_PA)
    tight = PARAMETERS[0]["b"].copy()
    tight["leak_from_supply"] = tight["leak_to_tank"] = 0.0
    assert settled_pa(tight, 2e6, 1e5, 7e5) == 7e5


@pytest.mark.parametrize("share", [0.5, -0.8])
def test_a_stuck_seal_carries_its_share_of_the_load_from_the_first_step(share: float) -> None:
    """Pressures push the load and the friction that holds them back; the contact is bent by just
    that.
    """
    axis = start_axes(PARAMETERS, X, LOAD_N, stuck=share)[0]
    own = MACHINE.vertical_cylinder
    out, back = own.coulomb_out_n + own.static_out_n, own.coulomb_in_n + own.static_in_n
    friction = share * (out if share > 0.0 else back)
    assert _piston_n(axis) - friction == pytest.approx(LOAD_N[0])
    rod = AxisInput.of()
    seal = PARAMETERS[0]["seal"].copy()
    assert friction_step(axis["seal"], seal, rod, 0.0, 0.0, 0.0, 1.0, 1e-3) == pytest.approx(
        friction, rel=1e-6
    )
