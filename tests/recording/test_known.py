"""What is declared about a rig: areas and gravity by hand, tolerances, and what cannot be."""

from __future__ import annotations

import math
from typing import Any

import pytest

from testbed.errors import InputError
from testbed.formats.checked import checked
from testbed.recording.known import DEFAULT_TOLERANCE, Known

FULL: dict[str, Any] = {
    "bore_m": 0.08,
    "rod_m": 0.045,
    "stroke_m": 0.5,
    "supply_pressure_nominal_pa": 1.6e7,
    "tank_pressure_pa": 2.0e5,
    "dead_volume_a_m3": 1e-4,
    "dead_volume_b_m3": 1e-4,
    "bulk_modulus_pa": 1.4e9,
    "valve_rated_flow_m3_s": 4e-4,
    "valve_rated_drop_per_edge_pa": 3.5e6,
    "valve_natural_frequency_hz": 40.0,
    "valve_damping": 0.8,
    "valve_deadband": 0.05,
    "internal_leakage_m3_s_pa": 0.0,
}


def known(**tree: Any) -> Known:
    return checked(Known, tree, "recording.yaml")


def test_areas_are_those_of_the_circle_and_of_the_ring() -> None:
    rig = known(bore_m=0.1, rod_m=0.06)
    assert rig.area_a_m2 == pytest.approx(7.85398e-3, rel=1e-5)
    assert rig.area_b_m2 == pytest.approx(5.02655e-3, rel=1e-5)  # pi/4 (0.1^2 - 0.06^2)


def test_without_a_rod_both_areas_are_one_and_without_a_bore_there_are_none() -> None:
    assert known(bore_m=0.1).area_b_m2 == known(bore_m=0.1).area_a_m2
    assert (known(rod_m=0.06).area_a_m2, known(rod_m=0.06).area_b_m2) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("inclination_deg", "gravity_m_s2"),
    [(None, 9.81), (0.0, 9.81), (60.0, 4.905), (90.0, 0.0), (180.0, -9.81)],
)
def test_gravity_along_the_axis_is_that_of_its_inclination(
    inclination_deg: float | None, gravity_m_s2: float
) -> None:
    rig = known(inclination_deg=inclination_deg)
    assert rig.gravity_along_axis_m_s2 == pytest.approx(gravity_m_s2, abs=0.005)


def test_a_number_may_be_written_with_its_tolerance() -> None:
    rig = known(bore_m={"value": 0.08, "tolerance": 0.01}, rod_m=0.045)
    assert rig.bore_m == 0.08
    assert rig.tolerance("bore_m") == 0.01 and rig.tolerance("rod_m") == DEFAULT_TOLERANCE
    assert known(bore_m=0.08, tolerances={"bore_m": 0.01}, rod_m=0.045) == rig


def test_a_value_without_a_tolerance_is_the_number_alone() -> None:
    assert known(bore_m={"value": 0.08}) == known(bore_m=0.08)


@pytest.mark.parametrize(
    ("tree", "said"),
    [
        ({"bore_m": {"size": 0.08}}, "bore_m has the keys size"),
        ({"bore_m": {"value": 0.08, "tolerance": 0.6}}, "is out of range (allowed: at most 0.5)"),
        ({"tolerances": {"bor_m": 0.01}}, "bor_m is no declared number"),
        ({"bore_m": 0.04, "rod_m": 0.04}, "must be smaller than bore_m"),
        ({"bore_m": 80.0}, "bore_m = 80.0: is out of range (allowed: at most 2)"),
        (
            {"bore_m": {"value": 0.08, "tolerance": 0.1}, "tolerances": None},
            "tolerances = 'nothing'",
        ),
        ({"valve_deadband": 1.0}, "valve_deadband = 1.0: is out of range"),
        ({"circuit": {"holding_a": "chek"}}, "circuit.holding_a = 'chek'"),
    ],
)
def test_what_no_rig_can_be_is_refused(tree: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError) as refused:
        known(**tree)
    assert said in str(refused.value)


def test_the_flow_balance_needs_every_number_and_a_zero_is_one() -> None:
    assert known(**FULL).declares_flow
    for name in FULL:
        assert not known(**{key: value for key, value in FULL.items() if key != name}).declares_flow


def test_files_carry_tolerances_and_circuit_only_where_they_are_stated() -> None:
    assert not {"tolerances", "circuit"} & set(known(bore_m=0.08).model_dump())
    stated = known(bore_m={"value": 0.08, "tolerance": 0.01}, circuit={"edge_at": 0.9})
    tree = stated.model_dump()
    assert tree["tolerances"] == {"bore_m": 0.01} and tree["circuit"]["edge_at"] == 0.9
    assert known(**tree) == stated


def test_numbers_that_are_none_are_no_numbers() -> None:
    with pytest.raises(InputError, match="a finite number"):
        known(stroke_m=math.nan)
