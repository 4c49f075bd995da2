"""Oil with air, edges, and their agreement with the declared formulas."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import quad

from testbed.laws.oil import (
    VAPOUR_PA,
    effective_bulk_modulus,
    enthalpy,
    gas_volume,
    gas_volume_near,
    pressure_of,
    specific_volume,
    vapour_volume,
)
from testbed.laws.orifice import orifice

BULK, AIR = 1.4e9, 0.005


def test_bulk_modulus_at_6_bar_by_hand() -> None:
    # gas: 0.005 (1/6)^(1/1.4) = 0.001391; compliance 1/1.4e9 + 0.001391 / (1.4 * 6e5) = 2.370e-9
    # 1/Pa
    assert effective_bulk_modulus(6.0e5, BULK, AIR) == pytest.approx(1.0 / 2.370e-9, rel=5e-3)


@pytest.mark.parametrize("gauge", [2e5, 1e6, 4e6, 9e6])
def test_compliance_is_the_declared_formula_to_first_order(gauge: float) -> None:
    p = gauge + 1e5
    declared = 1.0 / BULK + AIR / (1.4 * p) * (1e5 / p) ** (1.0 / 1.4)
    _, slope = specific_volume(p, BULK, AIR)
    assert -slope == pytest.approx(declared, rel=2 * AIR + 2 * p / BULK)


def test_modulus_grows_with_pressure_and_reaches_the_oil_s() -> None:
    moduli = [effective_bulk_modulus(p, BULK, AIR) for p in (1e5, 5e5, 25e5, 40e5, 300e5)]
    assert all(a < b for a, b in itertools.pairwise(moduli))
    assert moduli[-1] == pytest.approx(BULK, rel=0.03)


@pytest.mark.parametrize("p", [VAPOUR_PA * 1.01, 5e3, 1e5, 3e5, 9e6, 4e7])
@pytest.mark.parametrize("guess", [1.5e3, 1e5, 9e6, 5e7])
def test_pressure_from_volume_inverts_the_law_from_any_guess(p: float, guess: float) -> None:
    nu, slope = specific_volume(p, BULK, AIR)
    found, gas, at = pressure_of(
        nu, guess, 1e5, gas_volume(1e5, AIR), BULK, AIR, vapour_volume(BULK, AIR)
    )
    assert found == pytest.approx(p, rel=2e-6)
    assert gas == pytest.approx(gas_volume(p, AIR), rel=2e-6)
    assert at == pytest.approx(slope, rel=1e-2)


def test_a_void_stays_at_vapour_pressure_and_gives_no_stiffness() -> None:
    nu = 1.001 * vapour_volume(BULK, AIR)
    p, _, slope = pressure_of(nu, 1e6, 1e5, AIR, BULK, AIR, vapour_volume(BULK, AIR))
    assert (p, slope) == (VAPOUR_PA, -math.inf)


@pytest.mark.parametrize("ratio", [0.5, 0.95, 1.0, 1.05, 3.0])
def test_gas_follows_its_series_as_the_power(ratio: float) -> None:
    near = gas_volume(2e6, AIR)
    assert gas_volume_near(2e6 * ratio, 2e6, near) == pytest.approx(
        gas_volume(2e6 * ratio, AIR), rel=3e-7
    )


def test_enthalpy_is_the_integral_of_the_volume() -> None:
    integral, _ = quad(lambda p: specific_volume(p, BULK, AIR)[0], 1e5, 9e6)
    assert enthalpy(9e6, BULK, AIR) == pytest.approx(integral, rel=1e-9)
    assert enthalpy(1e5, BULK, AIR) == pytest.approx(0.0, abs=1e-6)


def test_orifice_is_the_root_law_and_laminar_near_zero() -> None:
    flow, slope = orifice(3.5e6)
    assert flow == pytest.approx(math.sqrt(3.5e6), rel=1e-5)  # 1870.8 sqrt(Pa)
    assert slope == pytest.approx(0.5 / math.sqrt(3.5e6), rel=1e-4)
    flow, slope = orifice(1.0)
    assert flow == pytest.approx(slope, rel=1e-6)
    assert slope == pytest.approx(1.0 / math.sqrt(2.0e4), rel=1e-6)


def test_orifice_is_odd_and_its_slope_its_derivative() -> None:
    for drop in (-6e6, -3e4, 1e3, 2e5, 9e6):
        assert orifice(-drop)[0] == -orifice(drop)[0]
        numeric = (orifice(drop + 1.0)[0] - orifice(drop - 1.0)[0]) / 2.0
        assert orifice(drop)[1] == pytest.approx(numeric, rel=1e-5)


def test_no_air_is_plain_oil() -> None:
    assert gas_volume(5e6, 0.0) == 0.0
    assert effective_bulk_modulus(1e5, BULK, 0.0) == pytest.approx(BULK)
    assert np.isclose(enthalpy(1.41e7, BULK, 0.0), 1.4e7 * (1 - 0.005 + 1e-4 / 6), rtol=1e-9)
