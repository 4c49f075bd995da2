"""Oil with entrained air: the equation of state that chambers, lines and the supply share.

Oil is counted in **standard volume** (its volume at 1 bar absolute), so that what leaves one place
enters another to the last bit. With x = (p - p0) / bulk modulus and air fraction a (at p0), one
standard volume takes up

    nu(p) = (1 - a) (1 - x + x^2 / 2) + a (p0 / p)^(1 / 1.4)

whose compliance -nu' is 1/beta + a / (1.4 p) (p0 / p)^(1 / 1.4) to first order in x. Pressures here
are absolute.
"""

from __future__ import annotations

import math

from testbed.compiled import njit_law
from testbed.formats.records import Record, quantity

NEAR_GUESS, NEAR_STEP = 0.03, 1e-4
"""Shares of the pressure by which guess and step may be off for the series to be right to 1e-7."""

ATMOSPHERE_PA = 1.0e5
VAPOUR_PA = 1.0e3
"""Vapour pressure of mineral oil with dissolved water, absolute (assumed): a chamber never falls
below it.
"""
POLYTROPIC = 1.4
"""Exponent of the entrained air: it is compressed too quickly to give off its heat (assumed)."""
_POWER = 1.0 / POLYTROPIC
_SERIES_2 = _POWER * (_POWER + 1.0) / 2.0
_SERIES_3 = _SERIES_2 * (_POWER + 2.0) / 3.0
_SERIES_4 = _SERIES_3 * (_POWER + 3.0) / 4.0
_SERIES_5 = _SERIES_4 * (_POWER + 4.0) / 5.0
GAS_AT_VAPOUR = (ATMOSPHERE_PA / VAPOUR_PA) ** _POWER
_SMALL = 0.06
"""Relative change of pressure up to which the series serves instead of the power."""


class OilParameters(Record):
    """What an oil is."""

    bulk_modulus = quantity("Pa", "of the oil without air")
    air = quantity("1", "entrained air, share of the standard volume")


class OilNear(Record):
    """What is known of a chamber's oil at its last pressure, so that a small change needs no
    division.
    """

    inverse_pressure = quantity("1/Pa", "1 / pressure")
    gas = quantity("1", "gas volume of one standard volume")
    inverse_slope = quantity("Pa/m3", "1 / (oil dnu/dp - widening), negative; 0 in a void")


@njit_law
def gas_volume(p_pa: float, air: float) -> float:
    """A (p0 / p)^(1 / 1.4): what the air of one standard volume takes up at the absolute pressure
    p.
    """
    if air <= 0.0:
        return 0.0
    return air * math.exp(-math.log(p_pa / ATMOSPHERE_PA) * _POWER)


@njit_law
def gas_volume_near(p_pa: float, near_pa: float, gas_near: float) -> float:
    """`gas_volume` at p from its value at `near_pa`: five terms of the binomial series (2e-7) where
    that is close.
    """
    y = p_pa / near_pa - 1.0
    if -_SMALL < y < _SMALL:
        series = _SERIES_2 - y * (_SERIES_3 - y * (_SERIES_4 - y * _SERIES_5))
        return gas_near * (1.0 - y * (_POWER - y * series))
    return gas_near * math.exp(-math.log(p_pa / near_pa) * _POWER)


@njit_law
def specific_volume(p_pa: float, bulk_pa: float, air: float) -> tuple[float, float]:
    """nu(p), dimensionless, and d nu / dp in 1/Pa, at the absolute pressure p."""
    x = (p_pa - ATMOSPHERE_PA) / bulk_pa
    gas = gas_volume(p_pa, air)
    nu = (1.0 - air) * (1.0 - x + 0.5 * x * x) + gas
    return nu, -(1.0 - air) * (1.0 - x) / bulk_pa - gas * _POWER / p_pa


@njit_law
def vapour_volume(bulk_pa: float, air: float) -> float:
    """Nu at the vapour pressure: beyond it a chamber holds a void."""
    x = (VAPOUR_PA - ATMOSPHERE_PA) / bulk_pa
    return float((1.0 - air) * (1.0 - x + 0.5 * x * x) + air * GAS_AT_VAPOUR)


@njit_law
def pressure_of(
    nu: float,
    guess_pa: float,
    near_pa: float,
    gas_near: float,
    bulk_pa: float,
    air: float,
    nu_vapour: float,
    widening: float = 0.0,
) -> tuple[float, float, float]:
    """The absolute pressure at which one standard volume takes up `nu`: Newton's iteration from
    `guess_pa`.

    widening: by how much its room grows with the pressure, 1/Pa: `nu` is that at p0. `gas_near` is
    the gas volume at `near_pa` (the last pressure of this oil). Returns p (Pa), the gas volume
    there and d nu / dp (1/Pa; -inf in a void, which stays at vapour pressure). Relative error of p
    below 1e-6.
    """
    if nu + widening * (VAPOUR_PA - ATMOSPHERE_PA) >= nu_vapour:
        return VAPOUR_PA, air * GAS_AT_VAPOUR, -math.inf
    p = guess_pa if guess_pa > VAPOUR_PA else VAPOUR_PA
    gas = gas_volume_near(p, near_pa, gas_near)
    slope = 0.0
    for _ in range(60):
        x = (p - ATMOSPHERE_PA) / bulk_pa
        per_p = gas * _POWER / p
        slope = -(1.0 - air) * (1.0 - x) / bulk_pa - per_p
        room = nu + widening * (p - ATMOSPHERE_PA)
        step = (room - (1.0 - air) * (1.0 - x + 0.5 * x * x) - gas) / (slope - widening)
        if -1e-3 * p < step < 1e-3 * p:
            y = step / p
            return p + step, gas * (1.0 - y * (_POWER - y * _SERIES_2)), slope
        # nu is convex and falls: a step down may overshoot into negative pressure, a step up never
        # passes the root.
        new = p + step if p + step > p / 3.0 else p / 3.0
        new = new if new > VAPOUR_PA else VAPOUR_PA
        gas = gas_volume_near(new, p, gas)
        p = new
    return p, gas, slope


@njit_law(forceinline=True)
def pressure_near(
    volume: float,
    oil: float,
    guess_pa: float,
    near_pa: float,
    near: OilNear,
    per_bulk: float,
    air: float,
) -> tuple[float, float, float, bool]:
    """`pressure_of` without a division, for a small change: p (Pa), gas volume, nu, and whether it
    holds.

    near: the oil at the pressure near_pa; per_bulk: 1 / bulk modulus. Where it holds, p is right to
    1e-7.
    """
    per_near, inverse = near.inverse_pressure, near.inverse_slope
    y = (guess_pa - near_pa) * per_near
    series = _SERIES_2 - y * (_SERIES_3 - y * (_SERIES_4 - y * _SERIES_5))
    gas = near.gas * (1.0 - y * (_POWER - y * series))
    x = (guess_pa - ATMOSPHERE_PA) * per_bulk
    nu = (1.0 - air) * (1.0 - x * (1.0 - 0.5 * x)) + gas
    step = (volume - oil * nu) * inverse
    z = step * per_near
    p = guess_pa + step
    holds = inverse < 0.0 and abs(y) < NEAR_GUESS and abs(z) < NEAR_STEP and p > VAPOUR_PA
    return p, gas * (1.0 - _POWER * z * (1.0 - y)), nu, holds


@njit_law
def effective_bulk_modulus(p_pa: float, bulk_pa: float, air: float) -> float:
    """-nu / (d nu / dp) in Pa: what a pressure transient sees at the absolute pressure p."""
    nu, slope = specific_volume(p_pa, bulk_pa, air)
    return -nu / slope


@njit_law(forceinline=True)
def enthalpy_with_gas(p_pa: float, gas: float, per_bulk: float, air: float) -> float:
    """h(p) with the gas volume at p and 1 / bulk modulus known: see `enthalpy`."""
    d = p_pa - ATMOSPHERE_PA
    x = d * per_bulk
    liquid = (1.0 - air) * d * (1.0 - x * (0.5 - x / 6.0))
    return liquid + (p_pa * gas - air * ATMOSPHERE_PA) / (1.0 - _POWER)


@njit_law
def enthalpy(p_pa: float, bulk_pa: float, air: float) -> float:
    """h(p) = integral of nu from p0 to p, J per standard m3: what flowing oil carries; a throttle
    heats by its drop.
    """
    return enthalpy_with_gas(p_pa, gas_volume(p_pa, air), 1.0 / bulk_pa, air)
