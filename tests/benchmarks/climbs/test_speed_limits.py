"""Bounds on a climb's speed from the machine's numbers: by hand, and what moves them."""

from __future__ import annotations

import pytest

from testbed.benchmarks.climbs.speed_limits import speed_limits
from testbed.machine.build import build_machine


def test_the_pumps_power_lifts_four_tonnes_up_a_wall_at_four_tenths_of_a_metre_a_second() -> None:
    """16 kW / (4000 kg x 9.81 m/s2) = 0.408 m/s; up 30 degrees twice that."""
    wall, slope = (speed_limits(build_machine(), 0.4, 0.05, deg, 4000.0) for deg in (90.0, 30.0))
    assert wall.pump_power == pytest.approx(0.408, rel=1e-3)
    assert slope.pump_power == pytest.approx(2.0 * wall.pump_power)


def test_the_traction_devices_need_time_to_go_back() -> None:
    """0.22 m at 60 mm/s, 0.22 m back at 150 mm/s and two clamps of 0.2 s: 0.22 m in 5.53 s."""
    assert speed_limits(build_machine(), 0.4, 0.05, 45.0, 4000.0).ropes == pytest.approx(
        0.22 / 5.533, rel=1e-3
    )


def test_the_ropes_bind_and_quick_ones_leave_it_to_the_pump() -> None:
    plain = speed_limits(build_machine(), 0.4, 0.05, 45.0, 4000.0)
    haul = {"traction.speed_max_m_s": 0.2, "traction.return_speed_m_s": 1.0}
    quick = speed_limits(build_machine(haul), 0.4, 0.05, 45.0, 4000.0)
    assert plain.lowest[0] == "ropes" and quick.lowest[0] == "pump_flow"
    assert plain.pump_flow == quick.pump_flow


def test_valves_of_half_the_flow_bind_at_half_the_speed() -> None:
    """Of the way of a stride a leg makes three quarters itself while the body goes on."""
    kinds = ("rotation", "radial", "vertical")
    numbers = {f"valve.rated_flow_{kind}_m3_s": 1.3333e-4 for kind in kinds}
    numbers["valve.rated_flow_vertical_m3_s"] = 2.08335e-4
    plain, small = (
        speed_limits(build_machine(given), 0.4, 0.05, 45.0, 4000.0) for given in ({}, numbers)
    )
    assert small.lowest[0] == "valves"
    assert small.valves == pytest.approx(0.5 * plain.valves, rel=1e-3)
    radial_s_m = 3.1172e-3 * 0.5 / 2.6667e-4  # at 60 degrees from the way
    assert plain.valves == pytest.approx(1.0 / (4 * 0.75 * radial_s_m), rel=1e-3)
