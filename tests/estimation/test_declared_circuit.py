"""The `circuit` section of a rig: without it the published flow balance, with it each edge, leakage
and holding valve.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from testbed.effects.terms import Signals
from testbed.errors import InputError
from testbed.estimation.leg.flow import flow_balance, flow_terms
from testbed.formats.checked import checked
from testbed.recording.known import Known

KNOWN: dict[str, Any] = {
    "bore_m": 0.07,
    "rod_m": 0.04,
    "stroke_m": 0.5,
    "dead_volume_a_m3": 4e-4,
    "dead_volume_b_m3": 4e-4,
    "bulk_modulus_pa": 1e9,
    "supply_pressure_nominal_pa": 9e6,
    "tank_pressure_pa": 2e5,
    "valve_rated_flow_m3_s": 4e-4,
    "valve_rated_drop_per_edge_pa": 3.5e6,
}
PA, PB = 4.0e6, 2.0e6


def flows(circuit: dict[str, Any] | None, opening: float) -> tuple[float, float]:
    """Flow into A and into B of a piston at rest at steady pressures, m3/s."""
    known = checked(Known, KNOWN if circuit is None else KNOWN | {"circuit": circuit}, "rig")
    still = np.ones(5)
    signals = Signals(
        known=known,
        rate_hz=1e3,
        time_s=np.arange(5) * 1e-3,
        position_m=0.2 * still,
        velocity_m_s=0.0 * still,
        acceleration_m_s2=0.0 * still,
        pressure_a_pa=PA * still,
        pressure_b_pa=PB * still,
        supply_pressure_pa=6.0e6 * still,
    )
    balance = flow_balance(signals, flow_terms(signals, ()), opening * still)
    return float(balance.a_m3_s[2]), float(balance.b_m3_s[2])


def test_an_empty_circuit_is_the_published_flow_balance() -> None:
    assert flows({}, 0.3) == flows(None, 0.3) and flows({}, -0.3) == flows(None, -0.3)


def test_every_edge_has_its_size() -> None:
    sizes = {"edge_pa": 2.0, "edge_at": 3.0, "edge_pb": 0.5, "edge_bt": 1.5}
    for opening, factors in ((0.3, (2.0, 1.5)), (-0.3, (3.0, 0.5))):
        plain, sized = flows(None, opening), flows(sizes, opening)
        assert np.divide(sized, plain) == pytest.approx(factors)


def test_every_edge_has_its_leakage_and_a_shut_holding_valve_none() -> None:
    leaks = {"leakage_pa_m3_s_pa": 1e-13, "leakage_at_m3_s_pa": 2e-13}
    leaks |= {"leakage_pb_m3_s_pa": 3e-13, "leakage_bt_m3_s_pa": 4e-13}
    a, b = flows(leaks, 0.0)
    assert a == pytest.approx(1e-13 * 5e6 - 2e-13 * 3.8e6)
    assert b == pytest.approx(3e-13 * 7e6 - 4e-13 * 1.8e6)
    held_a, held_b = flows(leaks | {"holding_a": "check", "holding_b": "check"}, 0.0)
    assert held_a == 0.0 and held_b == pytest.approx(b)  # oil still enters B
    assert flows(leaks | {"holding_a": "check"}, -0.3) == flows(leaks, -0.3)


def test_a_varying_supply_is_the_measured_one() -> None:
    ratio = flows({"supply": "varying"}, 0.3)[0] / flows(None, 0.3)[0]
    assert ratio == pytest.approx(np.sqrt(2.0 / 5.0), rel=0.02)


def test_a_circuit_goes_to_a_file_and_back_and_nonsense_is_refused() -> None:
    known = checked(Known, KNOWN | {"circuit": {"holding_a": "check"}}, "rig")
    assert checked(Known, known.model_dump(mode="json"), "rig") == known
    assert "circuit" not in checked(Known, KNOWN, "rig").model_dump(mode="json")
    with pytest.raises(InputError, match=r"circuit\.holding_a"):
        checked(Known, KNOWN | {"circuit": {"holding_a": "glue"}}, "rig")
