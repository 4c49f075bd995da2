"""Ropes pull and never push nor give energy; drill blows carry their momentum at every step size;
transducers.
"""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from testbed.laws import drill as d
from testbed.laws.rope import (
    Rope,
    rope_pull,
    rope_tension,
    sagging_tension,
    slip_through,
    unstrained_length,
    unstrained_sagging,
)
from testbed.laws.transducer import (
    TransducerParameters,
    TransducerState,
    sense_path,
    transducer_weights,
)

EA, L0 = 9.8e6, 30.0


def test_tension_by_hand() -> None:
    assert rope_tension(30.03, 0.0, L0, EA, 5e3) == pytest.approx(9800.0)  # EA / L0 * 30 mm
    assert rope_tension(30.03, 0.1, L0, EA, 5e3) == pytest.approx(10300.0)


@given(st.floats(1.0, 30.0), st.floats(-5.0, 5.0))
def test_slack_is_exactly_zero(length: float, rate: float) -> None:
    assert rope_tension(length, rate, L0, EA, 5e3) == 0.0


@given(st.floats(1.0, 40.0), st.floats(-5.0, 5.0))
def test_rope_never_pushes(length: float, rate: float) -> None:
    assert rope_tension(length, rate, L0, EA, 5e3) >= 0.0


@given(st.floats(0.0, 0.05), st.floats(0.5, 20.0), st.floats(0.0, 2e4))
def test_rope_gives_no_energy_over_a_cycle(swing: float, hz: float, damping: float) -> None:
    t = np.linspace(0.0, 1.0 / hz, 4001)
    length = L0 + 0.01 + swing * np.sin(2 * math.pi * hz * t)
    rate = swing * 2 * math.pi * hz * np.cos(2 * math.pi * hz * t)
    power = np.array(
        [rope_tension(x, v, L0, EA, damping) * v for x, v in zip(length, rate, strict=True)]
    )
    assert np.trapezoid(power, t) >= -1e-3


def test_paid_out_length_gives_the_tension_back() -> None:
    paid = unstrained_length(30.0, 1.2e4, EA)
    assert rope_tension(30.0, 0.0, paid, EA, 0.0) == pytest.approx(1.2e4)


def test_wrench_points_to_the_anchor() -> None:
    rope = Rope.of(anchor=(18.0, 0.0, 24.03), unstrained=L0, stiffness_ea=EA, clearance=0.6)
    tension = rope_pull(rope, np.zeros(3), np.zeros(3))
    assert np.linalg.norm(rope.force) == pytest.approx(tension)
    assert rope.force[2] / rope.force[0] == pytest.approx(24.03 / 18.0)


W, H = 6.8, 0.6


def hung(anchor: Any, paid_out_m: float, weight_n_m: float) -> Any:
    """A rope with a damper."""
    return Rope.of(
        anchor=anchor,
        unstrained=paid_out_m,
        stiffness_ea=EA,
        damping=5e3,
        weight=weight_n_m,
        clearance=H,
    )


@pytest.mark.parametrize(("tension", "softer"), [(1e4, 0.033), (5e3, 0.214), (2e3, 0.81)])
def test_sagging_rope_has_ernsts_modulus(tension: float, softer: float) -> None:
    """EA / L0 / (1 + w^2 L0^2 EA / (12 T^3)) for 6.8 N/m across, 30 m: 3 % at 10 kN, 21 % at 5 kN,
    81 % at 2 kN.
    """
    paid = unstrained_sagging(L0, tension, EA, W, H)
    assert sagging_tension(L0, paid, EA, W, H) == pytest.approx(tension, rel=1e-6)
    slope = (
        sagging_tension(L0 + 1e-5, paid, EA, W, H) - sagging_tension(L0 - 1e-5, paid, EA, W, H)
    ) / 2e-5
    assert 1.0 - slope / (EA / L0) == pytest.approx(softer, abs=0.01)


def test_arc_of_a_sagging_rope_is_its_stretched_length() -> None:
    """The parabola under w at tension T is as long as the rope, by numerical integration, to 0.1
    mm.
    """
    tension, chord = 3000.0, 30.0
    paid = unstrained_sagging(chord, tension, EA, W, H)
    arc = quad(lambda x: math.hypot(1.0, W * (x - chord / 2) / tension), 0.0, chord)[0]
    assert arc == pytest.approx(paid * (1.0 + tension / EA), abs=1e-4)


@given(st.floats(25.0, 30.5), st.floats(1e-6, 0.3))
def test_tension_of_a_sagging_rope_grows_with_its_distance_and_ends_in_slack(
    length: float, more: float
) -> None:
    low, high = sagging_tension(length, L0, EA, W, H), sagging_tension(length + more, L0, EA, W, H)
    assert 0.0 <= low <= high
    assert low > 0.0 or length < L0 - 2 * H + 0.01


def test_slack_of_a_sagging_rope_is_exactly_zero() -> None:
    assert sagging_tension(L0 - 2 * H, L0, EA, W, H) == 0.0
    rope = hung((3.0, 0.0, 20.0), L0, W)
    rope.force = 1.0
    assert rope_pull(rope, np.zeros(3), np.ones(3)) == 0.0
    assert not rope.force.any()
    paid = unstrained_sagging(L0, 0.0, EA, W, H)
    assert sagging_tension(L0, paid, EA, W, H) == 0.0 and paid < L0 + 2 * H + 0.01


@pytest.mark.slow
@pytest.mark.parametrize("weight", [0.0, 9.6])
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=15, deadline=None)
def test_a_rope_gives_no_energy_on_any_closed_way(weight: float, seed: int) -> None:
    """Its end goes round a random closed curve, through slack too: the work done on it is never
    less than nothing.
    """
    rng, t = np.random.default_rng(seed), np.linspace(0.0, 1.0, 6001)
    phases, sizes = (
        rng.uniform(0.0, 2 * math.pi, (3, 3)),
        rng.uniform(0.0, 0.02, (3, 3)) / [1.0, 2.0, 3.0],
    )
    angles = 2 * math.pi * t[:, None, None] * np.arange(1, 4) + phases
    place = (sizes * np.sin(angles)).sum(axis=2)
    speed = (2 * math.pi * np.arange(1, 4) * sizes * np.cos(angles)).sum(axis=2)
    anchor, power = np.array([20.0, 3.0, 22.6]), np.zeros(len(t))
    rope = hung(anchor, float(np.linalg.norm(anchor)) - rng.uniform(-0.02, 0.02), weight)
    for k in range(len(t)):
        rope_pull(rope, place[k], speed[k])
        power[k] = -rope.force @ speed[k]
    assert np.trapezoid(power, t) >= -1e-3 * np.abs(power).max()


@given(st.floats(0.0, 3.0), st.floats(1e-3, 3.0), st.floats(0.05, 0.9))
def test_blow_mean_is_the_integral_of_the_blows(start: float, span: float, width: float) -> None:
    def blow(phase: float) -> float:
        part = phase % 1.0
        return math.sin(math.pi * part / width) if part < width else 0.0

    edges = [k + e for k in range(7) for e in (0.0, width) if start < k + e < start + span]
    integral, _ = quad(blow, start, start + span, points=edges or None, limit=200)
    assert d.blow_mean(start, start + span, width) * span == pytest.approx(integral, abs=1e-6)


def test_momentum_of_a_blow_by_hand_and_at_any_rate() -> None:
    loads = d.DrillLoads.of(blow=3000.0, blow_rate=25.0)
    for hz in (250, 1000, 4000):
        phases = np.linspace(0.0, 1.0, hz // 25 + 1)
        momentum = sum(d.axial_force(loads, a, b, 0.0) / hz for a, b in itertools.pairwise(phases))
        assert momentum == pytest.approx(3000.0 * 2 * d.BLOW_WIDTH / math.pi / 25.0)


def test_axial_force_signs() -> None:
    loads = d.DrillLoads.of(feed=5000.0, pull=1000.0, string_mass=100.0)
    assert d.axial_force(loads, 0.0, 0.0, -9.81) == pytest.approx(5000.0 - 1000.0 - 981.0)


def test_transducers_lag_and_b_rings_behind_its_pipe() -> None:
    p = TransducerParameters.of(pipe_frequency=2 * math.pi * 460.0, pipe_damping=0.15, lag=1e-3)
    s = TransducerState.zeros()[0]
    one = np.ones(3)
    weights = transducer_weights(p.pipe_frequency, p.pipe_damping, p.lag, 5e-4)
    line = []
    for k in range(300):
        sense_path(s, p, one, one, 5e-4, weights)
        line.append(s.pipe_pressure)
        if k == 0:
            assert s.a == pytest.approx(1 - 1 / math.e)
    assert max(line) == pytest.approx(
        1 + math.exp(-math.pi * 0.15 / math.sqrt(1 - 0.15**2)), abs=0.06
    )
    assert s.b == pytest.approx(1.0, abs=1e-6)


def test_line_passes_a_ramp_late_by_twice_its_damping_over_its_frequency() -> None:
    wn, zeta = 2 * math.pi * 40.0, 0.4
    p = TransducerParameters.of(pipe_frequency=wn, pipe_damping=zeta, lag=1e-9)
    s = TransducerState.zeros()[0]
    weights = transducer_weights(wn, zeta, 1e-9, 1e-3)
    for k in range(1000):
        ramp = np.array([k * 1e-3, (k + 1) * 1e-3])
        sense_path(s, p, ramp, ramp, 1e-3, weights)
    assert s.pipe_pressure == pytest.approx(1.0 - 2 * zeta / wn, rel=1e-9)


def test_a_rope_that_is_hauled_as_fast_as_its_end_comes_is_not_damped() -> None:
    """The damper acts on the rope's own stretching: 5e3 N s/m at 0.05 m/s is 250 N, and nothing
    where the rope keeps up.
    """
    rope = Rope.of(
        anchor=(30.0, 0.0, 0.0), unstrained=29.95, stiffness_ea=9.8e6, damping=5e3, whole=1.0
    )
    coming = np.array([0.05, 0.0, 0.0])
    spring = rope_pull(rope, np.zeros(3), np.zeros(3))
    assert rope_pull(rope, np.zeros(3), coming) == pytest.approx(spring - 250.0)
    rope.rate = -0.05
    assert rope_pull(rope, np.zeros(3), coming) == pytest.approx(spring)
    assert rope_pull(rope, np.zeros(3), np.zeros(3)) == pytest.approx(spring + 250.0)


def test_a_rope_slips_through_its_clamps_until_they_hold_it() -> None:
    rope = Rope.of(anchor=(30.0, 0.0, 0.0), unstrained=29.8, stiffness_ea=9.8e6, whole=1.0)
    rope.tension = rope_pull(rope, np.zeros(3), np.zeros(3))
    assert slip_through(rope, 1e6) == 0.0 and rope.tension > 6e4
    slipped = slip_through(rope, 4e4)
    assert (rope.tension, rope.force[0]) == (4e4, pytest.approx(4e4))
    assert rope.unstrained == pytest.approx(29.8 + slipped)
    assert rope_pull(rope, np.zeros(3), np.zeros(3)) == pytest.approx(4e4, rel=0.01)
