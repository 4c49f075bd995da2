"""Numbers of the machine that something else rules are refused with the name of what rules them."""

from __future__ import annotations

import pytest
from shipped import MACHINE

from testbed.errors import InputError
from testbed.machine.overridden import check_effective, check_kind


@pytest.mark.parametrize(
    ("path", "believed", "said"),
    [
        ("total_mass_kg", False, "the URDF alone gives it"),
        ("drill.blow_n", False, "task.blow_n rules it"),
        ("ground.friction", False, "terrain.friction rules it"),
        ("control.tolerance_m", False, "model.parameters.control.tolerance_m rules it"),
        ("rope.stiffness_ea_n", True, "ropes.stiffness_ea_n rules it"),
        ("oil.outer_leakage_m3_s_pa", True, "nothing reads it"),
        ("axes.fl_radial.oil.entrained_air", True, "nothing reads it"),
        ("axes.fl_vertical.oil.ambient_degc", False, "all axes share it"),
    ],
)
def test_who_rules_a_number_is_told(path: str, believed: bool, said: str) -> None:
    section = "model.parameters" if believed else "hydraulics.parameters"
    with pytest.raises(InputError, match="would have no effect") as caught:
        check_effective(path, 1.0, believed, "case.yaml", section)
    assert said in str(caught.value) and f"{section}.{path} = 1.0" in str(caught.value)


@pytest.mark.parametrize(
    ("path", "believed"),
    [
        ("ground.friction", True),
        ("control.tolerance_m", True),
        ("oil.outer_leakage_m3_s_pa", False),
        ("axes.fl_vertical.valve.deadband", True),
    ],
)
def test_a_number_that_is_read_passes(path: str, believed: bool) -> None:
    assert check_effective(path, 1.0, believed, "case.yaml", "any") is None  # type: ignore[func-returns-value]


def test_a_number_of_a_kind_that_the_machine_does_not_have_names_the_kind() -> None:
    path = "power_unit.unloading_band_pa"
    with pytest.raises(InputError, match=r"only power_unit\.supply_kind = 2 reads it"):
        check_kind(path, 1e6, MACHINE.replaced({"power_unit.supply_kind": 0}), "case.yaml", "any")
    other = MACHINE.replaced({"power_unit.supply_kind": 2})
    assert check_kind(path, 1e6, other, "case.yaml", "any") is None  # type: ignore[func-returns-value]
