"""What effects say about their own fit: starts, bounds, prices and why recordings do not show
them.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from testbed.diagnosis.leg.hypotheses import narrowed
from testbed.diagnosis.leg.points import Point, point, start_vector
from testbed.effects import OF_A_CYLINDER, by_name
from testbed.effects.force_cushion import LEFT_COST
from testbed.effects.force_periodic import natural_frequency_hz, strongest_line
from testbed.effects.friction_presliding import BENT_M, SOUND_BEND_M, SOUND_COST
from testbed.effects.sensor_line_b import SOUND_COST as LINE_COST
from testbed.effects.sensor_line_b import SOUND_LAG_S
from testbed.effects.terms import USUAL, ForceResidual, Observed, Signals
from testbed.estimation.leg.flow import Edges
from testbed.formats.arrays import Array
from testbed.recording.known import Known
from testbed.recording.leg_model import Friction

RATE_HZ, SECONDS = 250.0, 60.0
TIME_S = np.arange(round(RATE_HZ * SECONDS)) / RATE_HZ


def observed(kind: str = "vertical-leg", **changes: Any) -> Observed:
    """Sixty seconds of slow strokes between 0.1 and 0.4 m in the air, with warming oil."""
    position = 0.25 + 0.15 * np.sin(0.4 * TIME_S)
    zero = np.zeros_like(TIME_S)
    channels: dict[str, Array] = {"position_m": position, "oil_temperature_degc": 20.0 + TIME_S / 6}
    given: dict[str, Any] = {"known": changes.pop("known", Known()), "reference_n": (None,)}
    channels |= {k: changes.pop(k) for k in list(changes) if k in Signals.__dataclass_fields__}
    signals = Signals(
        TIME_S, RATE_HZ, Known(), velocity_m_s=zero, acceleration_m_s2=zero, **channels
    )
    friction = Friction(coulomb_plus_n=400.0, stribeck_plus_n=100.0)
    return Observed(kind, friction=friction, signals=(signals,), **given | changes)


def leg_of(area: float) -> Known:
    """A leg whose areas, volumes and flow are so many times the usual one's."""
    bore = float(np.sqrt(4.0 / np.pi * USUAL[0] * area))
    return Known(
        bore_m=bore,
        rod_m=0.5 * bore,
        stroke_m=USUAL[1],
        moving_mass_kg=100.0 * area,
        supply_pressure_nominal_pa=USUAL[2],
        tank_pressure_pa=2e5,
        dead_volume_a_m3=4e-4 * area,
        dead_volume_b_m3=4e-4 * area,
        bulk_modulus_pa=1e9,
        valve_rated_flow_m3_s=USUAL[3] * area,
        valve_rated_drop_per_edge_pa=3.5e6,
        valve_natural_frequency_hz=30.0,
        valve_damping=0.9,
        valve_deadband=0.03,
        internal_leakage_m3_s_pa=5e-14 * area,
    )


def test_what_a_fit_starts_from_grows_with_the_leg() -> None:
    tiny, usual = observed(known=leg_of(0.01)), observed(known=leg_of(1.0))
    for name, key in (
        ("friction.pressure", "coefficient"),
        ("force.spring", "stiffness"),
        ("force.cushion", "stiffness"),
        ("leakage.internal", "coefficient"),
    ):
        small, large = (by_name(name).starts(seen)[0][key] for seen in (tiny, usual))
        assert small == pytest.approx(0.01 * large)
    assert tiny.size("Pa s/m3") == pytest.approx(100.0) and tiny.size("Hz") == 1.0
    assert observed("cylinder", known=leg_of(0.01)).size("m2") == 1.0


@pytest.mark.parametrize("area", [1e-4, 0.01, 1.0, 30.0])
def test_every_effect_starts_within_its_bounds_on_legs_of_any_size(area: float) -> None:
    seen = observed(known=leg_of(area))
    problem: Any = SimpleNamespace(observed=lambda *_: seen, base=SimpleNamespace(friction=None))
    for effect in OF_A_CYLINDER:
        if effect.name == "force.periodic":
            continue  # begins at a residual's strongest line
        for start in effect.starts(seen):
            found = narrowed(problem, effect, start)
            first = point(found, start_vector(found), Point(Friction(), Edges(), ()))
            (active,) = first.effects
            assert all(c.low < c.high for c in found)
            assert all(np.isfinite(value) for value in active.values.values())


def test_load_friction_is_not_seen_in_the_air_nor_thinning_oil_at_one_temperature() -> None:
    load, thinning = by_name("friction.load"), by_name("friction.temperature")
    assert "no recording with load" in (load.unseen(observed()) or "")
    assert load.unseen(observed(reference_n=(np.full_like(TIME_S, 2000.0),))) is None
    assert thinning.unseen(observed()) is None
    cold = observed(oil_temperature_degc=np.full_like(TIME_S, 20.0))
    assert "hardly changes" in (thinning.unseen(cold) or "")


def test_a_mass_is_not_seen_on_a_bench_that_does_not_accelerate() -> None:
    assert by_name("inertia.mass").unseen(observed("cylinder")) is not None
    assert by_name("inertia.mass").unseen(observed("vertical-leg")) is None


def test_a_cushion_begins_inside_the_travel_and_costs_where_the_piston_never_leaves_it() -> None:
    cushion, seen = by_name("force.cushion"), observed()
    start = next(c for c in cushion.coordinates() if c.name == "start")
    bounded = cushion.narrowed(start, seen)
    assert 0.1 < bounded.low < bounded.high < 0.4
    assert all(0.1 < values["start"] < 0.4 for values in cushion.starts(seen))
    assert cushion.price({"start": 0.45, "stiffness": 1e3}, seen) == pytest.approx(LEFT_COST)
    assert cushion.price({"start": 0.2, "stiffness": 1e3}, seen) == 0.0


def test_a_bristle_that_bends_less_than_a_sound_seal_s_costs_by_what_it_lacks() -> None:
    bristle = by_name("friction.presliding")  # slips at 400 N + 100 N
    stiff = {"stiffness": 500.0 / (0.5 * SOUND_BEND_M), "damping": 1e3}
    soft = {"stiffness": 500.0 / (2.0 * SOUND_BEND_M), "damping": 1e3}
    assert bristle.price(stiff, observed()) == pytest.approx(0.5 * SOUND_COST)
    assert bristle.price(soft, observed()) == 0.0
    assert bristle.price(stiff, observed("drive")) == 0.0


def test_a_bristle_turns_the_encoder_s_rounding_into_force_until_it_slips() -> None:
    bristle, friction = by_name("friction.presliding"), Friction(coulomb_plus_n=400.0)
    assert bristle.floor_n({"stiffness": 1e4}, friction, 3e-5) == pytest.approx(0.3)
    assert bristle.floor_n({"stiffness": 1e9}, friction, 3e-5) == pytest.approx(
        3e-5 * 400.0 / BENT_M
    )
    assert by_name("force.spring").floor_n({"stiffness": 1e4}, friction, 3e-5) == 0.0


def test_the_strongest_line_of_a_residual_is_found_with_its_frequency_and_amplitude() -> None:
    rng = np.random.default_rng(4)
    bin_s = 3.0 / RATE_HZ
    time = np.arange(5000) * bin_s
    force = 120.0 * np.sin(2.0 * np.pi * 7.3 * time) + rng.normal(0.0, 20.0, time.size)
    shown = np.ones(time.size, dtype=np.bool_)
    residual = ForceResidual(force, shown, np.full(time.size, 20.0), bin_s, 0.0)
    seen = observed(residual=(residual,))
    frequency, amplitude = strongest_line(seen)
    assert frequency == pytest.approx(7.3, abs=0.02)
    assert amplitude * np.sinc(frequency * bin_s) == pytest.approx(120.0, rel=0.05)
    (start,) = by_name("force.periodic").starts(seen)
    assert start == {"frequency": frequency, "amplitude": amplitude}
    assert [c.name for c in by_name("force.periodic").coordinates(start)] == ["frequency"]


def test_a_heavy_leg_that_rings_on_its_own_oil_has_no_vibration() -> None:
    """What swings by less than its encoder counts leaves its own inertia in the force balance."""
    heavy = leg_of(1.0).model_copy(update={"moving_mass_kg": 1200.0})
    own_hz = natural_frequency_hz(heavy, 0.25)
    rng, bin_s = np.random.default_rng(4), 3.0 / RATE_HZ
    time = np.arange(5000) * bin_s
    rings = 200.0 * np.sin(2.0 * np.pi * own_hz * time)
    shaken = 60.0 * np.sin(2.0 * np.pi * 7.3 * time)
    shown = np.ones(time.size, dtype=np.bool_)
    noise = np.full(time.size, 20.0)
    force = rings + shaken + rng.normal(0.0, 20.0, time.size)
    residual = (ForceResidual(force, shown, noise, bin_s, 0.0),)
    assert strongest_line(observed(residual=residual))[0] == pytest.approx(own_hz, abs=0.05)
    found, _ = strongest_line(observed(residual=residual, known=heavy))
    assert found == pytest.approx(7.3, abs=0.02)


def test_the_natural_frequency_of_a_mass_on_two_closed_chambers() -> None:
    """No rod and equal dead volumes, in the middle: k = 2 beta A^2 / V."""
    known = leg_of(1.0).model_copy(update={"rod_m": 0.0})
    middle, area = 0.5 * float(known.stroke_m or 0.0), known.area_a_m2
    stiffness = 2.0 * 1e9 * area**2 / (4e-4 + area * middle)
    expected = np.sqrt(stiffness / 100.0) / (2.0 * np.pi)
    assert natural_frequency_hz(known, middle) == pytest.approx(expected)


@pytest.mark.parametrize("name", ["friction.pressure", "friction.load"])
def test_what_is_pressed_sticks_never_less(name: str) -> None:
    """Friction that falls under load is another law: a load cell that bears some of it, say."""
    everywhere = by_name(name)
    here = everywhere.at("fl_vertical")
    assert everywhere.narrowed(everywhere.coordinates()[0], observed()).low == 0.0
    assert here.narrowed(here.coordinates()[0], observed("robot")).low == 0.0


def test_sizes_without_a_sign_are_fitted_as_logarithms() -> None:
    stiffness, damping = by_name("friction.presliding").coordinates()
    assert stiffness.log and damping.log
    low, high = by_name("friction.presliding").spec("stiffness").prior
    assert stiffness.start == pytest.approx(np.sqrt(low * high))
    assert not any(c.log for c in by_name("force.spring").coordinates())


def test_a_line_that_is_late_by_no_more_than_a_transducer_costs_for_it() -> None:
    line = by_name("sensor.line_b")
    half = {"natural_frequency": 1.0 / (np.pi * SOUND_LAG_S), "damping": 0.5}
    pipe = {"natural_frequency": 10.0, "damping": 0.7}
    assert line.price(half, observed()) == pytest.approx(0.5 * LINE_COST)
    assert line.price(pipe, observed()) == 0.0
    assert line.price(half, observed("cylinder")) == 0.0
