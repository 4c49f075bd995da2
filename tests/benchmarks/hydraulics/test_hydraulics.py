"""The twelve cylinders on one supply: exact, conserving, bounded, and what happens to numbers that
cannot be.
"""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from testbed.benchmarks.harness import rounded, run
from testbed.benchmarks.hydraulics.balance import balance, creep, machine, oil
from testbed.benchmarks.hydraulics.benchmark import (
    KINDS,
    Hydraulics,
    compare,
    kernel_forces,
    manoeuvre,
)
from testbed.benchmarks.hydraulics.kernel_speed import compare_speed
from testbed.errors import InputError
from testbed.laws.axis_records import AxisInput, AxisState
from testbed.laws.holding import PILOT_CHECK
from testbed.laws.hydraulics import hydraulic_step, mean_of_nodes
from testbed.laws.initial import start_axes, start_supply
from testbed.laws.oil import ATMOSPHERE_PA, VAPOUR_PA, effective_bulk_modulus, enthalpy
from testbed.laws.supply import (
    LOAD_SENSING,
    accumulator,
    pump,
    relief,
    supply_oil,
    supply_pressure,
    wanted_stroke,
)
from testbed.machine.build import build_machine
from testbed.scenario.parts import HYDRAULIC_PARTS
from testbed.world.hydraulic_parameters import unit_parameters
from testbed.world.switches import AXIS_OFF, UNIT_OFF, switch_off

X = np.tile([0.12, 0.2, 0.25], 4)
LOAD = np.tile([0.0, 0.0, 7000.0], 4)


class Rig:
    """The declared machine at rest; `step` holds commands and rates over milliseconds."""

    def __init__(self, without: tuple[str, ...] = ()) -> None:
        self.params, self.unit = machine()
        switch_off(without, self.params, self.unit)
        self.given = AxisInput.zeros(12)
        self.given["extension"] = X
        self.axes, self.supply = (
            start_axes(self.params, X, LOAD),
            start_supply(self.unit, 40.0, 0.06),
        )

    def step(
        self, command: float | np.ndarray, v: float | np.ndarray = 0.0, count: int = 1
    ) -> np.ndarray:
        """Forces after `count` ms."""
        self.given["command"], self.given["rate"] = command, v
        for _ in range(count):
            hydraulic_step(self.axes, self.params, self.given, self.supply, self.unit, 1e-3, 2)
            self.given["extension"] += 1e-3 * self.given["rate"]
        return np.array(self.axes["force"])


# ---- exact ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [*(pytest.param(n, marks=pytest.mark.slow) for n in (5, 7)), 8])
def test_forces_agree_with_radau_and_converge(number: int) -> None:
    found = compare(number, rtol=1e-8)
    assert found.rms_n < 45.0
    assert found.worst_n < 300.0
    assert found.half_rms_n < 0.5 * found.rms_n


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 3, 4])
def test_forces_agree_with_radau_in_reversals_stops_and_starved_supply(number: int) -> None:
    assert compare(number, rtol=1e-8).holds


def test_manoeuvres_cover_what_they_are_named_after() -> None:
    seen = {kind: [manoeuvre(k + 6 * j) for j in range(2)] for k, kind in enumerate(KINDS)}
    assert all(m.kind == kind for kind, two in seen.items() for m in two)
    for m in seen["end stop"]:
        x = np.array([m.motion(t)[0][0] for t in np.linspace(0, m.duration_s, 2000)])
        assert x.min() < 0.0 or x.max() > m.params[0].stroke
    for m in seen["starved supply"]:
        assert kernel_forces(m, 2)[2] < 0.5 * m.supply.pressure
    for m in seen["near vapour pressure"]:
        assert kernel_forces(m, 2)[1] < 1.0e5
    for m in seen["sticking"]:
        v = np.array([m.motion(t)[1][0] for t in np.linspace(0, m.duration_s, 2000)])
        assert np.mean(v == 0.0) > 0.05


def test_a_locked_cylinder_is_the_spring_of_its_oil() -> None:
    rig = Rig(("friction", "leakage", "hose"))
    rig.params["valve"]["locked"] = 1.0
    before = rig.step(0.0)
    after = rig.step(0.0, 1e-3, 1)  # mean over a push of 1 um: half of it
    p = rig.params[2]
    stiffness = 0.0
    for area, dead, length, pressure in (
        (p.a.area, p.a.dead_volume, 0.25, rig.axes[2].a.pressure),
        (p.b.area, p.b.dead_volume, 0.25, rig.axes[2].b.pressure),
    ):
        stiffness += (
            area**2
            * effective_bulk_modulus(pressure, p.oil.bulk_modulus, p.oil.air)
            / (dead + area * length)
        )
    assert (before - after)[2] == pytest.approx(stiffness * 0.5e-6, rel=2e-3)
    assert 1e7 < stiffness < 3e7


def test_steady_extension_meets_both_edges_orifice_laws() -> None:
    rig = Rig(("friction", "leakage", "hose"))
    u, v = np.zeros(12), np.zeros(12)
    u[2], v[2] = 0.4, 0.05
    rig.step(u, v, 400)
    p, s = rig.params[2], rig.axes[2]
    o = (0.4 - p.valve.hysteresis - p.valve.dead_band) / (1.0 - p.valve.dead_band)
    ps, pt = rig.supply.pressure, rig.unit.tank_pressure
    assert p.a.from_supply * o * math.sqrt(ps - s.a.pressure) == pytest.approx(
        p.a.area * 0.05, rel=0.01
    )
    assert p.b.to_tank * o * math.sqrt(s.b.pressure - pt) == pytest.approx(
        p.b.area * 0.05, rel=0.01
    )


# ---- conserving ----------------------------------------------------------------------------------


def test_oil_and_energy_balance_at_work() -> None:
    found = balance(20.0)
    assert abs(found.oil_lost) < 1e-9
    assert abs(found.energy_lost) < 1e-5
    assert found.travel_m > 1.0
    assert found.loss_j > 0.5 * found.pump_j


def test_a_starved_machine_balances_too_and_keeps_the_power_limit() -> None:
    found = balance(10.0, drive=1.5)
    assert abs(found.oil_lost) < 1e-9
    assert abs(found.energy_lost) < 1e-3
    assert found.highest_power_w <= 16e3 * (1 + 1e-12)


def test_traction_draws_from_the_same_oil() -> None:
    rig = Rig()
    rig.supply.traction_flow = 3e-4
    before, tank = oil(rig.axes, rig.params, rig.supply), rig.supply.tank_oil
    pressure = rig.supply.pressure
    rig.step(0.0, 0.0, 20)
    assert oil(rig.axes, rig.params, rig.supply) == pytest.approx(before, rel=1e-14)
    assert rig.supply.pressure < pressure
    assert rig.supply.tank_oil - tank > 0.5 * 0.02 * 3e-4
    assert rig.supply.traction_work == pytest.approx(0.02 * 3e-4 * 8.8e6, rel=0.03)


def test_nothing_is_drawn_from_an_empty_line() -> None:
    rig = Rig()
    rig.unit.pump_on = 0.0
    rig.supply = start_supply(rig.unit, 40.0, 0.06)
    rig.supply.traction_flow = 1e-3
    before = oil(rig.axes, rig.params, rig.supply)
    rig.step(1.0, 0.0, 200)
    assert oil(rig.axes, rig.params, rig.supply) == pytest.approx(before, rel=1e-14)
    assert rig.supply.pressure >= VAPOUR_PA
    assert rig.supply.oil > 0.0


def test_leakage_heats_by_flow_times_enthalpy_drop() -> None:
    rig = Rig(("internal_leakage", "outer_leakage", "edge_leakage", "relief"))
    rig.step(0.0, 0.0, 500)
    before, rise = rig.supply.loss, rig.supply.pressure
    rig.step(0.0, 0.0, 100)
    drop = rise - rig.unit.tank_pressure
    expected = (
        0.1
        * rig.unit.case_leakage
        * drop
        * (
            enthalpy(rise, rig.unit.oil.bulk_modulus, rig.unit.oil.air)
            - enthalpy(rig.unit.tank_pressure, rig.unit.oil.bulk_modulus, rig.unit.oil.air)
        )
    )
    assert rig.supply.loss - before == pytest.approx(expected, rel=2e-3)


def test_pressure_never_falls_below_vapour_and_the_void_closes_again() -> None:
    rig = Rig(("leakage", "hose"))
    rig.params["valve"]["locked"] = 1.0
    rig.step(0.0, 0.3, 220)  # 66 mm against shut valves
    assert rig.axes["a"]["pressure"].min() == VAPOUR_PA
    rig.step(0.0, -0.3, 220)
    assert rig.axes[2].a.pressure == pytest.approx(
        start_axes(rig.params, X, LOAD)[2].a.pressure, rel=0.02
    )


@pytest.mark.slow
def test_a_stuck_piston_does_not_creep_beyond_its_leakage() -> None:
    tight, leaking = creep(6.0, leakage=False), creep(6.0)
    assert abs(tight.moved_m) < 1e-6
    assert tight.load_n == leaking.load_n == pytest.approx(0.5 * (540.0 + 160.0))
    # some 0.05 cm3 a second pass the piston: it sinks by a millimetre a minute
    assert leaking.moved_m < -0.5e-4
    assert leaking.leakage_explains_m == pytest.approx(leaking.moved_m, abs=1e-6)
    assert leaking.beyond_m < 1e-5
    assert tight.beyond_m < 1e-6


def test_axes_starve_each_other_on_one_supply() -> None:
    alone, together = Rig(("accumulator",)), Rig(("accumulator",))
    u = np.zeros(12)
    u[2] = 1.0
    v = np.where(u > 0, 0.1, 0.0)
    force = alone.step(u, v, 100)[2]
    crowded = together.step(1.0, np.tile([0.0, 0.1, 0.1], 4), 100)[2]
    assert together.supply.pressure < 0.5 * alone.supply.pressure
    assert crowded < force - 5e3


# ---- stable --------------------------------------------------------------------------------------


@pytest.mark.parametrize("dt", [pytest.param(1e-4, marks=pytest.mark.slow), 1e-3, 1e-2])
def test_pressures_settle_at_any_step(dt: float) -> None:
    rig = Rig(("hysteresis",))
    rig.given["command"] = 0.5
    for _ in range(round(10.0 / dt)):
        hydraulic_step(rig.axes, rig.params, rig.given, rig.supply, rig.unit, dt, 1)
    assert rig.axes["a"]["pressure"] == pytest.approx(rig.supply.pressure, rel=2e-3)
    assert rig.axes["b"]["pressure"] == pytest.approx(
        rig.unit.tank_pressure, rel=0.04
    )  # edges leak from the supply


def test_the_same_step_twice_gives_the_same_bits() -> None:
    one, two = Rig(), Rig()
    rng = np.random.default_rng(3)
    for u, v in zip(rng.uniform(-1, 1, (50, 12)), rng.normal(0, 0.05, (50, 12)), strict=True):
        one.step(u, v)
        two.step(u, v)
    assert one.axes.tobytes() == two.axes.tobytes()
    assert one.supply.tobytes() == two.supply.tobytes()


def test_nan_comes_out_where_it_went_in() -> None:
    rig = Rig()
    v = np.zeros(12)
    v[4] = np.nan
    forces = rig.step(0.0, v)
    assert np.isnan(forces[4])
    assert np.isfinite(np.delete(forces, 4)).all()


# ---- power unit ----------------------------------------------------------------------------------


def test_accumulator_by_hand() -> None:
    assert accumulator(9e6, 4e-3, 6e6) == pytest.approx((4e-3 / 3, 4e-3 * 6e6 / 81e12))
    assert accumulator(5e6, 4e-3, 6e6) == (0.0, 0.0)


def test_line_pressure_inverts_its_oil() -> None:
    unit = unit_parameters(build_machine())
    for p in (2e3, 3e5, 5.9e6, 6.1e6, 6.2e6, 9e6):
        for guess in (1e4, 5e6, 2e7):
            found, slope = supply_pressure(supply_oil(p, unit), guess, unit)
            assert found == pytest.approx(p, rel=1e-6)
            assert slope > 0.0


def test_pump_by_hand_flow_power_and_compensator() -> None:
    unit = unit_parameters(build_machine())
    assert pump(1.0, 5e6, unit) == 1.6e-3  # 8 kW
    assert pump(1.0, 2e7, unit) == pytest.approx(8e-4)  # 16 kW at 200 bar: 48 L/min
    assert wanted_stroke(unit.set_pressure, unit.set_pressure, unit) == 0.0
    assert wanted_stroke(unit.set_pressure - 2e5, unit.set_pressure, unit) == pytest.approx(0.5)
    flow, slope = relief(unit.relief_pressure + 5e5, unit)
    assert flow == pytest.approx(3e-9 * 5e5 + 5e-12 * (9.8e6 + 5e5 - 2e5))
    assert slope == pytest.approx(3e-9 + 5e-12)


def test_supply_settles_within_the_compensator_s_band() -> None:
    rig = Rig()
    rig.step(0.0, 0.0, 3000)
    assert (
        rig.unit.set_pressure - rig.unit.compensator_band
        < rig.supply.pressure
        < rig.unit.set_pressure
    )


def test_start_balances_the_load() -> None:
    params, _ = machine()
    s = start_axes(params, X, LOAD)
    p = params[2]
    force = (
        s[2].a.pressure * p.a.area
        - s[2].b.pressure * p.b.area
        - (p.a.area - p.b.area) * ATMOSPHERE_PA
    )
    assert force == pytest.approx(7000.0)


def test_mean_of_nodes_by_hand() -> None:
    assert mean_of_nodes(np.array([1.0, 2.0, 5.0])) == 2.5


# ---- switches and refusals -----------------------------------------------------------------------


def test_every_named_part_has_a_switch_and_no_switch_is_unnamed() -> None:
    assert set(AXIS_OFF) | set(UNIT_OFF) == set(HYDRAULIC_PARTS)


@pytest.mark.parametrize("part", HYDRAULIC_PARTS)
def test_every_part_can_be_left_out_and_makes_a_difference(part: str) -> None:
    rng = np.random.default_rng(5)
    commands, rates = rng.uniform(-0.6, 0.6, (60, 12)), rng.normal(0, 0.05, (60, 12))
    outcomes = []
    for without in ((), (part,)):
        rig = Rig()
        rig.params["seal"]["load_coefficient"] = 0.01
        rig.params["a"]["hose_elasticity"] = 2.3e-13
        rig.unit.relief_pressure, rig.unit.pump_power = 8.5e6, 3e3
        if part == "load_holding":
            rig.params["a"]["holding"]["kind"] = PILOT_CHECK
            rig.params["a"]["leak_from_supply"] = 0.0  # or the leaks fill A through the valve
        if part == "load_sensing":
            rig.unit.kind = LOAD_SENSING
        switch_off(without, rig.params, rig.unit)
        rig.axes = start_axes(rig.params, X, LOAD)
        rig.supply = start_supply(rig.unit, 40.0, 0.06)
        x = rig.given["extension"]
        x[2] = 0.02  # in the cushion
        rig.axes[2] = start_axes(rig.params[2:3], x[2:3], LOAD[2:3])[0]
        rig.given["load"] = rig.given["side_load"] = 1e3
        for u, v in zip(commands, rates, strict=True):
            rig.step(u, v)
        assert np.isfinite(AxisState.as_table(rig.axes)).all()
        sensed = rig.axes["transducers"]
        outcomes.append(np.r_[rig.axes["force"], sensed["a"], sensed["b"], rig.supply.temperature])
    assert not np.array_equal(*outcomes)


def test_an_unknown_part_is_refused() -> None:
    params, unit = machine()
    with pytest.raises(InputError, match=r"hydraulics\.without.*'frictoin'"):
        switch_off(["frictoin"], params, unit)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("vertical_cylinder.rod_m", 0.071),
        ("vertical_cylinder.bore_m", -0.07),
        ("vertical_cylinder.stroke_m", 0.0),
        ("radial_cylinder.dead_volume_a_m3", -1e-4),
        ("rotation_cylinder.coulomb_out_n", -1.0),
        ("vertical_cylinder.stribeck_in_m_s", 0.0),
        ("valve.deadband", 1.0),
        ("valve.deadband", -0.1),
        ("valve.hysteresis", 1.0),
        ("valve.natural_frequency_hz", 0.0),
        ("valve.rated_drop_per_edge_pa", 0.0),
        ("valve.edge_pb", -0.5),
        ("valve.amplifier_lag_s", 0.0),
        ("oil.bulk_modulus_pa", 0.0),
        ("oil.entrained_air", 0.5),
        ("oil.entrained_air", -0.01),
        ("oil.internal_leakage_m3_s_pa", -1e-14),
        ("oil.hose_time_s", 0.0),
        ("oil.heat_capacity_j_k", 0.0),
        ("seal.bristle_stiffness_n_m", 0.0),
        ("seal.dwell_time_s", 0.0),
        ("end_stop.cushion_length_m", 0.0),
        ("end_stop.stiffness_n_m", -1.0),
        ("sensor.transducer_bandwidth_hz", 0.0),
        ("power_unit.power_w", 0.0),
        ("power_unit.line_volume_m3", -1e-3),
        ("power_unit.accumulator_volume_m3", -1e-3),
        ("power_unit.compensator_band_pa", 0.0),
        ("valve.rated_flow_radial_m3_s", 0.0),
        ("power_unit.tank_pressure_pa", -2e5),
        ("power_unit.supply_pressure_pa", 1e5),
    ],
)
def test_numbers_that_cannot_be_are_refused_by_name(path: str, value: float) -> None:
    with pytest.raises(InputError, match=path.replace(".", r"\.")):
        build_machine({path: value})


@pytest.mark.slow
def test_the_check_writes_its_table(tmp_path: Path) -> None:
    answer = run(
        Hydraulics(manoeuvres=1, seconds=2.0, free_motions=["stuck ramps"]), tmp_path / "out"
    )
    assert json.loads((tmp_path / "out" / "hydraulics.json").read_text()) == rounded(answer)
    lines = (tmp_path / "out" / "hydraulics.csv").read_text().splitlines()
    assert len(lines) == 3
    assert lines[1].split(",")[1] == "reversals"
    assert answer["free_mass"]["stuck ramps"]["holds"]
    assert answer["holds"]


@pytest.mark.slow
def test_a_worse_kernel_would_not_pass() -> None:
    good = compare(8, rtol=1e-7)
    assert good.holds
    assert not replace(good, rms_n=46.0).holds
    assert not replace(good, worst_n=301.0).holds
    assert not replace(good, half_rms_n=0.6 * good.rms_n).holds


@pytest.mark.slow
def test_kernel_is_far_faster_than_lsoda_at_equal_error() -> None:
    found = compare_speed(steps=60)
    assert found["lsoda_error_n"] <= found["kernel_error_n"] < 2.0
    assert found["lsoda_ratio"] > 40.0  # about a hundred on a machine left alone
