"""Friction: the paper's (5) in steady sliding, true sticking below break-away, ageing; ends of the
stroke.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shipped import MACHINE

from testbed.benchmarks.paper.figure_08 import steady_friction
from testbed.laws.axis_records import AxisInput
from testbed.laws.end_stops import (
    EndParameters,
    ExtraForces,
    end_force,
    extra_force,
    mean_ramp,
    share_above,
)
from testbed.laws.friction import (
    SealParameters,
    SealState,
    Sliding,
    bend,
    dwell_step,
    friction_step,
    relax,
    stribeck_level,
)

K, D = 3e7, 1e4


STROKE = 0.5


def _seal(**changes: float) -> tuple[Any, Any]:
    """State and parameters of a seal."""
    p = SealParameters.of(bristle_stiffness=K, bristle_damping=D, dwell_time=20.0, **changes)
    p.outward = Sliding.of(coulomb=620.0, static=180.0, stribeck_speed=0.007, viscous=5200.0)
    p.inward = Sliding.of(coulomb=540.0, static=160.0, stribeck_speed=0.007, viscous=4100.0)
    return SealState.zeros()[0], p


def _slide(
    seal: tuple[Any, Any],
    v: float,
    steps: int = 200,
    place: float = 0.0,
    pressures: float = 0.0,
    thinning: float = 1.0,
    **loads: float,
) -> float:
    """Friction after `steps` ms at v, N."""
    rod = AxisInput.of(rate=v, **loads)
    for _ in range(steps):
        force = friction_step(*seal, rod, 0.0, place, pressures, thinning, 1e-3)
    return float(force)


def test_stribeck_level_by_hand() -> None:
    assert stribeck_level(0.0, 620.0, 180.0, 0.007) == 800.0
    assert stribeck_level(0.007, 620.0, 180.0, 0.007) == pytest.approx(620.0 + 180.0 / math.e)
    assert steady_friction(0.1, 620.0, 180.0, 0.007, 5200.0) == pytest.approx(
        620.0 + 520.0, abs=1e-3
    )
    assert steady_friction(0.0, 620.0, 180.0, 0.007, 5200.0) == 0.0


@pytest.mark.parametrize("v", [-0.2, -0.004, 0.003, 0.05])
def test_steady_sliding_is_equation_5(v: float) -> None:
    force = _slide(_seal(), v, steps=400)
    pos = (620.0, 180.0, 0.007, 5200.0) if v > 0 else (540.0, 160.0, 0.007, 4100.0)
    assert force == pytest.approx(steady_friction(v, *pos), rel=1e-4)


def test_stuck_bristle_is_a_spring_that_keeps_its_load() -> None:
    assert bend(1e-5, 0.0, 800.0 / K, 0.0) == (1e-5, 1e-5)
    rod = AxisInput.zeros()[0]
    state, p = _seal()
    state.bristle = 1e-5
    assert friction_step(state, p, rod, 0.0, 0.0, 0.0, 1.0, 1e-3) == pytest.approx(300.0)


def _force_after_a_minute_of_vibration(share: float) -> float:
    """What is left of 300 N, N, after 60 s of +-20 N at 30 Hz on a contact of 826 N break-away."""
    longest, z = 826.0 / K, 300.0 / K
    ways = np.diff(20.0 / K * np.sin(2.0 * np.pi * 30.0 * 1e-3 * np.arange(60_001)))
    for way in ways:
        z, _ = bend(z, way, longest, share)
    return K * z


def test_vibration_leaves_an_elasto_plastic_seal_its_force_and_takes_it_from_a_plain_bristle() -> (
    None
):
    declared = MACHINE.seal.elastic_share
    assert _force_after_a_minute_of_vibration(declared) == pytest.approx(300.0, abs=0.1)
    assert abs(_force_after_a_minute_of_vibration(0.0)) < 30.0


def test_an_elasto_plastic_seal_slides_at_the_same_level_and_keeps_what_it_had_below() -> None:
    force = _slide(_seal(elastic_share=0.7), 0.05)
    assert force == pytest.approx(_slide(_seal(), 0.05), rel=1e-6)
    longest = 800.0 / K
    there, _ = bend(0.0, 0.69 * longest, longest, 0.7)
    back, _ = bend(there, -0.69 * longest, longest, 0.7)
    assert back == pytest.approx(0.0, abs=1e-12 * longest)
    beyond, _ = bend(0.0, 1.5 * longest, longest, 0.7)
    returned, _ = bend(beyond, -1.5 * longest, longest, 0.7)
    assert returned < -0.4 * longest


def test_a_skipped_way_bends_the_contact_before_the_step() -> None:
    """A stuck contact that is taken back and forth by the same way is where it was, with the same
    force.
    """
    state, p = _seal()
    p.bristle_damping = p.outward.viscous = 0.0
    rod = AxisInput.of(rate=1e-6)
    ahead = friction_step(state, p, rod, -1e-9, 0.0, 0.0, 1.0, 1e-3)
    assert ahead == pytest.approx(K * (-1e-9 + 0.5e-9), rel=1e-3)  # the middle of the step
    assert state.bristle == pytest.approx(0.0, abs=1e-15)


SHARES = st.sampled_from([0.0, 0.3, 0.7])
"""Plain and elasto-plastic contacts."""


@given(st.floats(-2e-5, 2e-5), st.floats(-5e-3, 5e-3), SHARES)
def test_bristle_never_passes_its_level(z: float, way: float, share: float) -> None:
    new, _ = bend(z, way, 800.0 / K, share)
    assert K * abs(new) <= max(800.0, K * abs(z)) * (1 + 1e-9)


@given(st.floats(-2e-5, 2e-5), st.floats(-5e-4, 5e-4), SHARES)
def test_two_half_slides_are_one_slide(z: float, way: float, share: float) -> None:
    whole, mean = bend(z, way, 800.0 / K, share)
    half, first = bend(z, 0.5 * way, 800.0 / K, share)
    twice, second = bend(half, 0.5 * way, 800.0 / K, share)
    assert twice == pytest.approx(whole, rel=1e-6, abs=1e-15)
    assert 0.5 * (first + second) == pytest.approx(mean, rel=1e-5, abs=1e-11)


def test_relaxation_by_hand_and_its_series_meet() -> None:
    assert relax(1.0, 0.0, 1.0) == pytest.approx((1 / math.e, 1 - 1 / math.e))
    assert relax(1.0, 0.0, 0.01 - 1e-9) == pytest.approx(relax(1.0, 0.0, 0.01 + 1e-9), abs=1e-8)


def test_rest_ages_the_contact_and_sliding_renews_it() -> None:
    aged, _ = dwell_step(0.0, 0.15, 1 / 20.0, 0.0, 20.0)
    assert aged == pytest.approx(0.15 * (1 - 1 / math.e))
    worn, _ = dwell_step(aged, 0.15, 1 / 20.0, 0.1 * K / 620.0, 0.01)
    assert worn < 1e-5


@pytest.mark.parametrize(
    ("parameter", "value", "acting", "change"),
    [
        ("position_slope", 0.1, {"place": 0.4}, 0.1 * 0.4 * 620.0),
        ("pressure_coefficient", 6e-6, {"pressures": 1.2e7}, 6e-6 * 1.2e7),
        ("load_coefficient", 0.01, {"load": 5e3}, 0.01 * 5e3),
        ("side_load_coefficient", 0.02, {"side_load": -1e3}, 0.02 * 1e3),
    ],
)
def test_position_pressure_load_and_side_raise_the_coulomb_part(
    parameter: str, value: float, acting: dict[str, float], change: float
) -> None:
    raised = _slide(_seal(**{parameter: value}), 0.2, **acting)
    assert raised - _slide(_seal(), 0.2, **acting) == pytest.approx(change, rel=1e-6)


def test_an_overhang_that_grows_takes_more_of_a_side_load() -> None:
    """0.1 mid-stroke, all of that more over the stroke: 0.14 at four tenths of the stroke beyond
    the middle.
    """
    across = {"side_load_coefficient": 0.1, "side_load_growth": 1.0}
    for place in (0.4, -0.4):
        raised = _slide(_seal(**across), 0.2, place=place, side_load=1e3)
        assert raised - _slide(_seal(), 0.2, place=place) == pytest.approx(100.0 * (1.0 + place))


def test_warm_oil_scales_the_viscous_part_alone() -> None:
    cold, warm = (_slide(_seal(), 0.2, thinning=share) for share in (1.0, 0.5))
    assert cold - warm == pytest.approx(0.5 * 5200.0 * 0.2)


def test_ramp_means_by_hand() -> None:
    assert mean_ramp(-1.0, 1.0) == 0.25
    assert mean_ramp(2.0, 4.0) == 3.0
    assert mean_ramp(-2.0, -1.0) == 0.0
    assert share_above(-1.0, 3.0) == 0.75


def _end_force(x: float, v: float, dt: float) -> float:
    ends = EndParameters.of(
        cushion_length=0.03, cushion_damping=6e4, stop_stiffness=5e7, stop_damping=3e4
    )
    return float(end_force(ends, STROKE, x, v, v, dt))


def test_cushion_brakes_the_approach_only() -> None:
    assert _end_force(0.25, -0.1, 1e-3) == 0.0
    assert _end_force(0.015, -0.1, 1e-9) == pytest.approx(6e4 * 0.1 * 0.5, rel=1e-6)
    assert _end_force(0.015, +0.1, 1e-9) == 0.0
    assert _end_force(0.485, +0.1, 1e-9) == pytest.approx(-6e4 * 0.1 * 0.5, rel=1e-6)


def test_stop_is_a_spring_that_never_pulls() -> None:
    assert _end_force(-1e-4, 0.0, 1e-3) == pytest.approx(5e3)
    assert _end_force(0.5001, 0.0, 1e-3) == pytest.approx(-5e3)
    assert _end_force(-1e-6, 0.5, 1e-9) == 0.0  # leaving faster than the spring follows


def test_mean_end_force_is_the_mean_of_its_parts() -> None:
    for x, v in ((2e-4, -0.4), (0.0305, -0.8), (0.4998, 0.5), (-3e-4, 0.6)):
        parts = [_end_force(x + v * 1e-5 * k, v, 1e-5) for k in range(100)]
        assert _end_force(x, v, 1e-3) == pytest.approx(np.mean(parts), rel=1e-9, abs=1e-6)


def test_extra_forces_by_hand() -> None:
    spring = ExtraForces.of(spring_stiffness=1e4, spring_rest=0.2)
    assert extra_force(spring, 0.3, 0.0, 0.0, 1e-3) == pytest.approx(-1e3)
    band = ExtraForces.of(periodic_force=100.0, periodic_frequency=2 * math.pi * 25.0)
    assert extra_force(band, 0.3, 0.0, 0.0, 0.04) == pytest.approx(0.0, abs=1e-9)  # a whole period
    assert extra_force(band, 0.3, 0.0, 0.0, 0.02) == pytest.approx(100.0 * 2 / math.pi)
    cushion = ExtraForces.of(cushion_stiffness=1e5, cushion_start=0.1)
    assert extra_force(cushion, 0.06, 0.0, 0.0, 1e-3) == pytest.approx(4e3)
    assert extra_force(cushion, 0.2, 0.0, 0.0, 1e-3) == 0.0
