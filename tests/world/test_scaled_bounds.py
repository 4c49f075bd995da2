"""Bounds chosen on ROBOCLIMBER go with the machine: the quarter model weighs 49 kg, a foot
of it bears 120 N.
"""

from __future__ import annotations

import numpy as np
import pytest

from testbed.control.distribution.distribution import add_pull, internal_force_state
from testbed.control.distribution.quadratic import Quadratic
from testbed.control.distribution.statics import NORMALS, Statics
from testbed.control.gait import Measured
from testbed.estimation.live.believed import Believed
from testbed.estimation.live.body_belief import body_of
from testbed.estimation.live.chain import belief_of
from testbed.estimation.live.uncertainty import Uncertainty
from testbed.machine.build import build_machine
from testbed.machine.folder import machine_folder
from testbed.machine.names import AXES
from testbed.machine.scale import ROBOCLIMBER
from testbed.robot.robot import Robot
from testbed.robot.rope_bearings import NO_ROPES
from testbed.scenario.machines import WORKSHOP, draw_machine
from testbed.simulation.residuals import residual_summary

ROBOT = Robot.of(build_machine(folder=machine_folder("quarter_model")))
MACHINE, SHIPPED = ROBOT.machine, build_machine()
QUARTER_N = 0.25 * 9.81 * MACHINE.total_mass_kg


def _standing() -> Measured:
    joints = np.tile([0.0, 0.05, 0.0625], 4)
    return Measured.of(
        position=joints, load=QUARTER_N, contact=1.0, supply_pressure=3.0e6, attitude=np.zeros(3)
    )


def test_a_plan_leaves_each_foot_its_lowest_load() -> None:
    now = Statics(ROBOT.model, MACHINE, NO_ROPES).balance(_standing(), np.ones(4, dtype=bool))
    sharing = Quadratic()
    for _ in range(30):
        loads = sharing.plan(now).forces[NORMALS]
    assert loads.sum() == pytest.approx(4.0 * QUARTER_N, rel=1e-3)
    assert loads.min() > 0.3 * QUARTER_N
    assert sharing._last is not None and sharing._last.lowest == pytest.approx(1.0)


def test_a_foot_with_half_its_load_is_not_in_the_air() -> None:
    legs = Believed.from_machine(MACHINE, 1e-3).legs
    body = body_of(MACHINE, ROBOT.model, legs, 1e-3, NO_ROPES)[0]
    assert 0.1 * QUARTER_N < body["air_load"] < 0.5 * QUARTER_N
    assert body["decisions"]["end_force"] < 10.0 * QUARTER_N
    assert body["filter"]["innovation_limit"] < 0.1 * QUARTER_N


def test_friction_that_the_contact_state_explains_is_the_machines() -> None:
    numbers = belief_of(Believed.from_machine(MACHINE, 1e-3))[0]["combined"]
    cylinder = MACHINE.vertical_cylinder
    assert numbers["break_away"] < 2.0 * (cylinder.coulomb_out_n + cylinder.static_out_n)
    shipped = belief_of(Believed.from_machine(SHIPPED, 1e-3))[0]["combined"]
    assert shipped["break_away"] == 800.0


@pytest.mark.parametrize("seed", range(5))
def test_a_drawn_model_differs_by_shares_of_itself(seed: int) -> None:
    drawn = draw_machine(WORKSHOP, seed, MACHINE).numbers
    masses = [n["value"] for name, n in drawn.items() if name.endswith(".mass")]
    assert 0.0 < max(map(abs, masses)) < 0.05 * MACHINE.total_mass_kg
    offsets = {name: n["value"] for name, n in drawn.items() if "encoder_offset" in name}
    assert max(abs(v) for name, v in offsets.items() if "vertical" in name) < 3.0e-4
    same = draw_machine(WORKSHOP, seed, SHIPPED).numbers
    for name in (n for n in offsets if "rotation" in n):
        assert offsets[name] == same[name]["value"], "an angle has no size"


def test_what_is_not_known_of_the_model_is_a_share_of_it() -> None:
    sure = Uncertainty(WORKSHOP)
    weight = sure.sd("robot.payload@body.mass", MACHINE)
    assert weight == pytest.approx(0.012 * sure.sd("robot.payload@body.mass", SHIPPED), rel=0.05)


def test_a_leg_that_reads_a_tenth_too_little_stands_out() -> None:
    data = {"t": np.arange(5.0)}
    for leg in ("fl", "fr", "rl", "rr"):
        data[f"expected_{leg}"] = np.full(5, QUARTER_N)
        data[f"estimate_kbf_{leg}"] = np.full(5, (0.9 if leg == "rl" else 1.0) * QUARTER_N)
    found = residual_summary(data, ["kbf"], MACHINE.scale.nominal_load_n)["stands_out"]
    assert found is not None and found["leg"] == "rl"
    assert residual_summary(data, ["kbf"])["stands_out"] is None, "on 4 t it would be noise"


def test_ropes_of_twice_the_machine_are_hauled_by_twice_the_force_at_its_speed() -> None:
    large = build_machine(folder=machine_folder("climber_8t")).scale
    rates = {}
    for scale, force in ((ROBOCLIMBER, 1.0), (large, large.force)):
        pull, out = np.array([1.0e4, 1.0e4]) * force, np.zeros(2)
        add_pull(pull, pull + 2000.0 * force, 0.01, internal_force_state(scale), pull.copy(), out)
        rates[scale] = out / scale.speed
    np.testing.assert_allclose(rates[large], rates[ROBOCLIMBER], rtol=1e-9)
    assert len(AXES) == internal_force_state(large).tolerance.size
