"""Stick-slip behind a valve: the condition says where it can be, the simulation where it is; sets inferred by name."""

from __future__ import annotations

import pytest

from testbed.benchmarks.paper.machine import changed, changes, once_per_machine
from testbed.benchmarks.paper.stick_slip import net_damping_n_s_m, seal_of, slips_at
from testbed.errors import InputError
from testbed.machine.build import build_machine
from testbed.machine.inferred import inferred


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
        assert net_damping_n_s_m(speed_m_s, seal) > -1000.0


def test_the_inferred_seal_sticks_below_5_mm_s_and_not_above_the_declared_one_nowhere() -> None:
    seal = inferred("figure_9")
    assert slips_at(2e-3, seal, 2.0) > 10 and slips_at(4e-3, seal, 2.0) > 10
    assert slips_at(1e-2, seal, 2.0) == 0
    assert slips_at(2e-3, {}, 2.0) == slips_at(4e-3, {}, 2.0) == 0


def test_inferred_sets_name_numbers_that_there_are() -> None:
    sets = [set(inferred(name)) for name in ("figure_5", "figure_9", "paper")]
    assert set(inferred()) == set.union(*sets)
    assert inferred("figure_9") == {"seal.bristle_stiffness_n_m": 2.0e8}
    with pytest.raises(InputError, match=r"figure_6.*allowed: figure_5, figure_9, paper"):
        inferred("figure_6")


def test_the_inferred_circuit_sticks_at_5_mm_s_with_the_declared_seal_and_not_at_10() -> None:
    circuit = inferred("paper")
    assert slips_at(5e-3, circuit, 2.0) >= 3 and slips_at(1e-2, circuit, 2.0) == 0
    assert not any(path.startswith("seal.") for path in circuit)
    kept = ("valve.edge_at", "valve.edge_bt", "oil.entrained_air")
    assert slips_at(5e-3, {path: circuit[path] for path in kept}, 2.0) < 3


def test_experiments_see_the_machine_that_is_set_and_remember_each() -> None:
    seen = []

    @once_per_machine
    def once(x: float) -> float:
        seen.append(changes())
        return x

    assert once(1.0) == once(1.0) == 1.0
    with changed({"oil.entrained_air": 0.02}):
        once(1.0)
    assert seen == [{}, {"oil.entrained_air": 0.02}]
    assert changes() == {}
