"""Oil with entrained air: the equation of state that chambers, lines and the supply share.

Oil is counted in **standard volume** (its volume at 1 bar absolute), so that what leaves one place enters another
to the last bit. With x = (p - p0) / bulk modulus and air fraction a (at p0), one standard volume takes up

    nu(p) = (1 - a) (1 - x + x^2 / 2) + a (p0 / p)^(1 / 1.4)

which is the contract's 1/beta + a / (1.4 p) (p0 / p)^(1 / 1.4) to first order in x. Pressures here are absolute.
"""

from __future__ import annotations

import math

from numba import njit

ATMOSPHERE_PA = 1.0e5
VAPOUR_PA = 1.0e3
"""Vapour pressure of mineral oil with dissolved water, absolute (assumed): a chamber never falls below it."""
POLYTROPIC = 1.4


@njit(cache=True)
def specific_volume(p_pa: float, bulk_pa: float, air: float) -> tuple[float, float]:
    """nu(p), dimensionless, and d nu / dp in 1/Pa, at the absolute pressure p."""
    x = (p_pa - ATMOSPHERE_PA) / bulk_pa
    nu = (1.0 - air) * (1.0 - x + 0.5 * x * x)
    slope = -(1.0 - air) * (1.0 - x) / bulk_pa
    if air > 0.0:
        gas = air * math.exp(-math.log(p_pa / ATMOSPHERE_PA) / POLYTROPIC)
        nu += gas
        slope -= gas / (POLYTROPIC * p_pa)
    return nu, slope


@njit(cache=True)
def effective_bulk_modulus(p_pa: float, bulk_pa: float, air: float) -> float:
    """-nu / (d nu / dp) in Pa: what a pressure transient sees at the absolute pressure p."""
    nu, slope = specific_volume(p_pa, bulk_pa, air)
    return -nu / slope


@njit(cache=True)
def enthalpy(p_pa: float, bulk_pa: float, air: float) -> float:
    """h(p) = integral of nu from p0 to p, J per standard m3: what flowing oil carries; a throttle heats by its drop."""
    d = p_pa - ATMOSPHERE_PA
    x = d / bulk_pa
    liquid = (1.0 - air) * d * (1.0 - x / 2.0 + x * x / 6.0)
    k = 1.0 - 1.0 / POLYTROPIC
    return float(liquid + air * ATMOSPHERE_PA / k * ((p_pa / ATMOSPHERE_PA) ** k - 1.0))


@njit(cache=True)
def internal_energy(p_pa: float, bulk_pa: float, air: float) -> float:
    """e(p) = h - p nu + p0, J per standard m3, zero at p0: what oil at rest stores."""
    nu, _ = specific_volume(p_pa, bulk_pa, air)
    nu0, _ = specific_volume(ATMOSPHERE_PA, bulk_pa, air)
    return float(enthalpy(p_pa, bulk_pa, air) - p_pa * nu + ATMOSPHERE_PA * nu0)
