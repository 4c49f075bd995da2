"""Bounds on a climb's speed from the machine's numbers: by hand, and what moves them."""

from __future__ import annotations

import pytest

from testbed.control.gaits.crawl.limits import speed_limits
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


def test_the_valves_bind_and_quicker_ones_raise_the_bound_in_proportion() -> None:
    plain = speed_limits(build_machine(), 0.4, 0.05, 45.0, 4000.0)
    kinds = ("rotation", "radial", "vertical")
    numbers = {f"valve.rated_flow_{kind}_m3_s": 1.6e-3 for kind in kinds}
    quick = speed_limits(build_machine(numbers), 0.4, 0.05, 45.0, 4000.0)
    assert plain.lowest[0] == "valves" and quick.lowest[0] != "valves"
    assert 0.025 < plain.valves < 0.035
    longer = speed_limits(build_machine(), 0.6, 0.05, 45.0, 4000.0)
    assert longer.valves > plain.valves
