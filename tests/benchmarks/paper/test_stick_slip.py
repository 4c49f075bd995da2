"""Stick-slip behind a valve: the condition says where it can be, the simulation where it is; the
machine's sets.
"""

from __future__ import annotations

import pytest

from testbed.benchmarks.paper.leg import Chosen, changed, chosen, of_set, once_per_machine
from testbed.benchmarks.paper.stick_slip import net_damping_n_s_m, seal_of, slips_at
from testbed.machine.build import build_machine
from testbed.machine.provenance import machine_set


def test_without_a_falling_curve_the_net_damping_is_the_viscous_one_and_the_oils() -> None:
    flat = {"vertical_cylinder.static_out_n": 0.0}
    viscous = build_machine().vertical_cylinder.viscous_out_n_s_m
    assert viscous < net_damping_n_s_m(3e-3, flat) < 1.1 * viscous


def test_a_bristle_without_length_leaves_the_slope_of_the_stribeck_curve() -> None:
    stiff = {"seal.bristle_stiffness_n_m": 1e12, "vertical_cylinder.static_out_n": 180.0}
    flat = stiff | {"vertical_cylinder.static_out_n": 0.0}
    slope = net_damping_n_s_m(7e-3, stiff) - net_damping_n_s_m(7e-3, flat)
    assert slope == pytest.approx(-180.0 / 7e-3 * 0.367879, rel=1e-3)  # -F_s0 / c_s exp(-1)


@pytest.mark.parametrize(
    ("pre_sliding_m", "speed_m_s"), [(2.7e-5, 3e-3), (3e-6, 3e-3), (3e-6, 1e-2), (1e-5, 1e-3)]
)
def test_where_a_piston_sticks_and_slips_the_net_damping_is_negative(
    pre_sliding_m: float, speed_m_s: float
) -> None:
    seal = seal_of(pre_sliding_m, 180.0)
    if slips_at(speed_m_s, seal, 2.0) > 2:
        assert net_damping_n_s_m(speed_m_s, seal) < 0.0
    else:
        assert net_damping_n_s_m(speed_m_s, seal) > -2500.0


def test_the_inferred_circuit_sticks_at_5_mm_s_and_not_at_10_and_the_original_nowhere() -> None:
    assert slips_at(5e-3, {}, 2.0) >= 3 and slips_at(1e-2, {}, 2.0) == 0
    with of_set("original"):
        assert slips_at(2e-3, {}, 2.0) == slips_at(4e-3, {}, 2.0) == 0


def test_a_machine_set_changes_numbers_that_there_are_and_nothing_by_default() -> None:
    assert machine_set("inferred") == {}
    original, default = build_machine(of_set="original"), build_machine()
    for path, quantity in machine_set("original").items():
        assert original.quantity(path) == quantity
        assert default.quantity(path).unit == quantity.unit
        assert default.quantity(path).value != quantity.value, f"{path} says nothing"


def test_experiments_see_the_machine_that_is_set_and_remember_each() -> None:
    seen = []

    @once_per_machine
    def once(x: float) -> float:
        seen.append(chosen().changes)
        return x

    assert once(1.0) == once(1.0) == 1.0
    with changed({"oil.entrained_air": 0.02}):
        once(1.0)
    assert seen == [(), (("oil.entrained_air", 0.02),)]
    assert chosen() == Chosen()
